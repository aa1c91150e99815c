"""Effects concealed in recordings of a real axis: the diagnosis examined on its own motions, noise and unknown physics.

A force that opposes the motion more than it did needs that much more effort for the same motion, exactly: what is added to the
recorded effort is a law of the measured motion, and nothing of the recording's own dirt is lost. A delay of the drive is
the recorded effort ahead of its time, a lag the recorded effort with as much of its slope as the lag takes off, and
friction of a gear asks for more of the effort that drives and for less of the effort that brakes. The recording as it is
stands beside: what is found there is the axis's own and counts neither way.

How large an effect has to be to leave a multiple of what stays unexplained in the recording as it is says :mod:`.yardstick`.
Where it is to have a multiple of its detection limit, it is the law for which that limit was stated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import butter, sosfiltfilt

from ...identification.equations import surroundings
from ...model import Model, Term
from ...record import Array, Record
from ...simulation import predict_force
from ..limits import Limit

__all__ = ["CHANGED", "INJECTED", "Injected", "acting", "at_limit", "can_be_at_limit", "injected", "injections"]

_CUTOFF = 40.0  # physical [Hz]: where axes' friction changes with their motion
_TOLD = 0.1  # numerical, of the sampling rate: what is faster isn't told from noise
_REST = 0.01  # physical, of fast motion: below, the axis may rest, where friction balances whatever is left
_FAST = 0.98  # statistical: quantile of the speed that is fast motion
_ACTS = 0.05  # of its largest value: where an added force is less it does not act


@dataclass(frozen=True, eq=False)
class Motion:
    """Measured motion of one recording: position [x], velocity [x/s], sign of it (0 where it may rest), time [s], ``(n,)``."""

    position: Array
    velocity: Array
    sign: Array
    time: Array
    fast: float
    low: float
    high: float


def _bump(s: Motion) -> Array:
    middle, width = 0.5 * (s.low + s.high), 0.1 * (s.high - s.low)
    return np.exp(-0.5 * ((s.position - middle) / width) ** 2) * s.sign


INJECTED: dict[str, Callable[[Motion], Array]] = {
    # Another Coulomb level forward than backward is a constant force while the axis moves, which nominal models have.
    "asymmetry": lambda s: np.abs(s.velocity) / s.fast,
    "stribeck": lambda s: np.exp(-np.abs(s.velocity) / (0.05 * s.fast)) * s.sign,
    "quadratic_drag": lambda s: s.velocity * np.abs(s.velocity) / s.fast**2,
    "ripple": lambda s: np.sin(2.0 * np.pi * s.position / (0.037 * (s.high - s.low))),
    "position_dependence": _bump,
    "stiffness": lambda s: (s.position - s.low) / (s.high - s.low),
    "nonlinear_stiffness": lambda s: ((s.position - 0.5 * (s.low + s.high)) / (s.high - s.low)) ** 3,
    "shear_thinning": lambda s: (1.0 - np.exp(-np.abs(s.velocity) / (0.1 * s.fast))) * s.sign,
    "time_drift": lambda s: (s.time - s.time[0]) / (s.time[-1] - s.time[0]) * s.sign,
}
"""Forces along the motion, of the size of one, by the effect of the vocabulary that they are."""


def _slope(force: Array, motion: Motion) -> Array:
    """What changes per second of delay or lag [F/s]."""
    return np.asarray(np.gradient(force, motion.time), dtype=np.float64)


@dataclass(frozen=True)
class Changed:
    """An effect that changes the effort itself.

    Attributes:
        parameter: of the vocabulary's effect, that says how large it is.
        slope: what a small one adds, of the size of one [F], to a force without noise and with the motion, shape ``(n,)``.
        force: the whole force with one of the given size [F], shape ``(n,)``.
    """

    parameter: str
    slope: Callable[[Array, Motion], Array]
    force: Callable[[Array, Motion, float], Array]


CHANGED: dict[str, Changed] = {
    "delay": Changed("time", _slope, lambda force, motion, size: np.interp(motion.time + size, motion.time, force)),
    "actuator_lag": Changed("time", _slope, lambda force, motion, size: force + size * _slope(force, motion)),
    "gear_friction": Changed(
        "coefficient",
        lambda force, motion: np.abs(force) * motion.sign,
        # The effort of which friction of ``size`` times itself leaves the recorded one.
        lambda force, motion, size: force / (1.0 - size * motion.sign * np.sign(force)),
    ),
}
"""Those that are no force along the motion. The sensor's noise passes through none of them, and stays as it is."""


@dataclass(frozen=True)
class Injected:
    """One effect and how large it was made.

    Attributes:
        effect: id of the vocabulary.
        times: what stays unexplained in the recording as it is, where the effect acts.
    """

    effect: str
    times: float


def injections(sizes: Sequence[float]) -> list[Injected]:
    """Every effect in every size."""
    return [Injected(effect, size) for effect in (*INJECTED, *CHANGED) for size in sizes]


def injected(records: Sequence[Record], effect: str, size: float) -> list[Record]:
    """``records`` with ``effect`` concealed in their effort.

    Args:
        records: of one axis.
        effect: id of the vocabulary, of :data:`INJECTED` or :data:`CHANGED`.
        size: root mean square of the force that is added where the effect acts [F].
    """
    moved = _motions(records)
    changing = CHANGED.get(effect)
    made = [
        INJECTED[effect](motion) if changing is None else changing.slope(_without_noise(record), motion)
        for record, motion in zip(records, moved, strict=True)
    ]
    joined = np.concatenate(made)
    scale = size / float(np.sqrt(np.mean(joined[acting(joined)] ** 2)))
    added = []
    for record, motion, force in zip(records, moved, made, strict=True):
        if changing is None:
            added.append(scale * force)
        else:
            plain = _without_noise(record)
            added.append(changing.force(plain, motion, scale) - plain)
    return [replace(record, effort=record.effort + each) for record, each in zip(records, added, strict=True)]


def acting(force: Array) -> Array:
    """Where a force acts: True where it isn't small beside its largest value, shape ``(n,)``."""
    size = np.abs(force)
    return np.asarray(size > _ACTS * np.max(size))


def can_be_at_limit(limit: Limit, times: float) -> bool:
    """True where an effect can be put into the effort with ``times`` the size that its detection limit states."""
    changing = CHANGED.get(limit.effect)
    known = limit.effect in INJECTED if changing is None else limit.parameter == changing.parameter
    if limit.term is None or not known:
        return False
    declared = next(each for each in limit.term.effect.parameters if each.name == limit.parameter)
    return declared.lower <= times * limit.term.by_name[limit.parameter] <= declared.upper


def at_limit(records: Sequence[Record], model: Model, limit: Limit, times: float) -> list[Record]:
    """``records`` with an effect concealed in their effort that has ``times`` the strength of its detection limit.

    Args:
        records: of one axis.
        model: beside which the limit was stated.
        limit: of the effect, one with which this can be done (:func:`can_be_at_limit`).
        times: of it.
    """
    held, changing = limit.term, CHANGED.get(limit.effect)
    assert held is not None
    strength = times * held.by_name[limit.parameter]
    values = held.by_name | {limit.parameter: strength}
    whole = model.with_terms((*model.terms, Term(held.effect, tuple(values.values()))))
    found = []
    for record, motion in zip(records, _motions(records), strict=True):
        if changing is None:
            added = _needed(whole, record, motion) - _needed(model, record, motion)
        else:
            plain = _without_noise(record)
            added = changing.force(plain, motion, strength) - plain
        found.append(replace(record, effort=record.effort + added))
    return found


def _needed(model: Model, record: Record, motion: Motion) -> Array:
    """Force that ``model`` needs for the motion [F]; of friction, none where the axis may rest."""
    moves = np.where(motion.sign == 0.0, 0.0, motion.velocity)
    acceleration = np.gradient(motion.velocity, motion.time)
    load, temperature = surroundings(record)
    return predict_force(model, motion.time, motion.position, moves, acceleration, record.sample_time, load, temperature)


def _motions(records: Sequence[Record]) -> list[Motion]:
    """Of recordings of one axis, which have one fast motion and one travel."""
    motions = [_motion(record) for record in records]
    fast = float(np.quantile(np.abs(np.concatenate([each.velocity for each in motions])), _FAST))
    low = min(float(np.min(each.position)) for each in motions)
    high = max(float(np.max(each.position)) for each in motions)
    return [
        replace(
            each,
            sign=np.where(np.abs(each.velocity) > _REST * fast, np.sign(each.velocity), 0.0),
            fast=fast,
            low=low,
            high=high,
        )
        for each in motions
    ]


def _without_noise(record: Record) -> Array:
    """The effort, low-passed without delay where samples tell noise from it [F]."""
    cutoff = min(_CUTOFF, _TOLD / record.sample_time)
    return np.asarray(sosfiltfilt(butter(2, cutoff, fs=1.0 / record.sample_time, output="sos"), record.effort))


def _motion(record: Record) -> Motion:
    position, h = record.position, record.sample_time
    if _CUTOFF * h < 0.4:
        position = sosfiltfilt(butter(2, _CUTOFF, fs=1.0 / h, output="sos"), position)
    velocity = np.gradient(position, record.time)
    return Motion(position, velocity, np.sign(velocity), record.time, 1.0, 0.0, 1.0)
