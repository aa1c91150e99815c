"""Velocity, acceleration and friction from recordings, cut into blocks, for tensor-product friction.

Where the acceleration was measured (a signal ``acceleration``), the samples are those of slips, as in
:mod:`..static_maps.stick_slip`: its integral is the velocity, the force less m a the friction; each slip is a block. Otherwise
they are the filtered position's derivatives and the force filtered alike, where the motion doesn't reverse within the filter's
reach; each recording is cut into blocks of equal length.

What noise decides is left out: speeds within two standard deviations of the velocity's error, and accelerations within three of
their own, over a window as long as it takes to tell speeding up from slowing down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

from ...record import Array, Index, Mask, Record
from ..equations import equations
from ..result import IdentificationError, Options
from ..static_maps.stick_slip import Slip, slips

__all__ = ["Samples", "samples_of"]

_QUIET = 2.0  # standard deviations of the velocity's error
_SIGN = 3.0  # standard deviations of the smoothed acceleration
_SMALL = 0.03  # of the typical acceleration: smoothed until its noise is as small
_LONGEST = 0.1  # of a slip: the longest window
_BLOCKS = 24
_FEWEST = 200


@dataclass(frozen=True, eq=False)
class Samples:
    """What the cells are filled from; arrays of shape ``(n,)``.

    Attributes:
        velocity: [x/s].
        acceleration: smoothed, for its sign [x/s^2].
        friction: force less m a [F].
        block: number of the block.
        least_speed: below which there are no samples [x/s].
        least_acceleration: below which there are none [x/s^2].
        measured: True where the acceleration was measured.
        left_out: share of moving samples that noise took.
    """

    velocity: Array
    acceleration: Array
    friction: Array
    block: Index
    least_speed: float
    least_acceleration: float
    measured: bool
    left_out: float

    @property
    def speeding_up(self) -> Mask:
        """True where the speed grows."""
        return np.asarray(self.velocity * self.acceleration > 0.0)

    def only(self, kept: Mask) -> Samples:
        """The same with the samples ``kept`` alone."""
        return replace(
            self,
            velocity=self.velocity[kept],
            acceleration=self.acceleration[kept],
            friction=self.friction[kept],
            block=self.block[kept],
        )


def samples_of(records: Sequence[Record], mass: float, options: Options) -> Samples:
    """The samples of ``records`` for a joint of this mass [F s^2/x].

    Raises:
        IdentificationError: there are none, or too few.
    """
    if all("acceleration" in record.extra for record in records):
        found = _of_slips(records, mass)
    else:
        found = _of_positions(records, mass, options)
    if found.velocity.shape[0] < _FEWEST or np.unique(found.block).shape[0] < 2:
        raise IdentificationError(
            records[0].source,
            f"{found.velocity.shape[0]} samples of {np.unique(found.block).shape[0]} stretch(es) of motion above its noise",
            "record several slips or strokes that speed up and slow down, and the acceleration beside them where it can be had",
        )
    return found


def _of_slips(records: Sequence[Record], mass: float) -> Samples:
    own: list[Slip] = []
    for record in records:
        own += slips(record.time, np.asarray(record.extra["acceleration"], dtype=np.float64), record.effort, mass)
    if not own:
        raise IdentificationError(
            records[0].source,
            "no slip from rest to rest in the signal acceleration",
            "record stick-slip with a rest before and after each slip",
        )
    step = float(np.median(np.diff(own[0].time)))
    # Neighbouring samples of the acceleration differ by its noise, for a slip lasts over many.
    noise = float(np.median([1.4826 * np.median(np.abs(np.diff(slip.acceleration, 2))) for slip in own])) / np.sqrt(6.0)
    typical = float(np.median([np.sqrt(np.mean(slip.acceleration**2)) for slip in own]))
    length = min(slip.time.shape[0] for slip in own)
    width = int(np.clip((noise / (_SMALL * typical)) ** 2, 1, max(_LONGEST * length, 1.0)))
    smooth = np.concatenate([uniform_filter1d(slip.acceleration, width, mode="nearest") for slip in own])
    # A random walk that is brought back to zero at its end: half of what it would have come to.
    error = 0.5 * noise * float(np.sqrt(step * np.median([slip.time[-1] - slip.time[0] for slip in own])))
    velocity, friction = (np.concatenate([getattr(slip, name) for slip in own]) for name in ("velocity", "friction"))
    block = np.repeat(np.arange(len(own)), [slip.time.shape[0] for slip in own])
    return _kept(
        (velocity, smooth, friction, block), np.ones(block.shape[0], dtype=np.bool_), error, noise / np.sqrt(width), True
    )


def _of_positions(records: Sequence[Record], mass: float, options: Options) -> Samples:
    found = equations(list(records), options)
    parts: list[tuple[Array, Array, Array, Array]] = []
    inside: list[Mask] = []
    for stretch in found.stretches:
        reach = 2 * round(1.0 / found.cutoff / stretch.sample_time) + 1
        v = stretch.velocity
        inside.append(np.asarray(minimum_filter1d(v, reach) * maximum_filter1d(v, reach) > 0.0))
        parts.append((v, stretch.acceleration, stretch.smooth(stretch.force) - mass * stretch.acceleration, stretch.time))
    total = sum(part[0].shape[0] for part in parts)
    length = max(total // _BLOCKS, 1)
    block = np.arange(total) // length
    velocity, acceleration, friction, _ = (np.concatenate(values) for values in zip(*parts, strict=True))
    # What a filter of so many samples leaves of the noise changes over as many.
    wiggle = np.concatenate([part[1] - uniform_filter1d(part[1], 5) for part in parts])
    noise = 1.4826 * float(np.median(np.abs(wiggle)))
    data = (velocity, acceleration, friction, block)
    return _kept(data, np.concatenate(inside), found.rest_velocity / _QUIET, noise, False)


def _kept(data: tuple[Array, Array, Array, Index], moving: Mask, error: float, noise: float, measured: bool) -> Samples:
    velocity, acceleration, friction, block = data
    slow, weak = _QUIET * error, _SIGN * noise
    kept = moving & (np.abs(velocity) >= slow) & (np.abs(acceleration) >= weak)
    lost = 1.0 - float(np.sum(kept)) / max(float(np.sum(moving)), 1.0)
    return Samples(velocity[kept], acceleration[kept], friction[kept], block[kept], slow, weak, measured, lost)
