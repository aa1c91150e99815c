"""What a recording says at each sample that the model, corrected until the sample before, did not foresee.

The model is simulated from sample to sample, so that what happens in between (a body ringing on its bristles, a stop) is not
filtered away, and its state is pulled to the measured position after each one, so that no error builds up through the
integrator. The correction is the steady-state Kalman filter of a double integrator whose acceleration is disturbed with
standard deviation s_a, and whose position is read with noise s_q. Its gains follow from the tracking index L = s_a h^2 / s_q
(Kalata 1984): r = (4 + L - sqrt(8 L + L^2)) / 4, alpha = 1 - r^2, beta = 2 (2 - alpha) - 4 sqrt(1 - alpha).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import make_interp_spline

from ..model import Model
from ..record import Array, Record
from ..signals.initial_state import initial_state
from ..signals.resolution import noise_at_each, noise_of
from ..simulation import intervals
from .equations import surroundings

__all__ = ["SETTLING", "SHORTEST", "Run", "excerpt", "gains", "innovations", "runs_of"]

SETTLING = 20
"""Innovations dropped at the start of each run."""

SHORTEST = 10 * SETTLING
"""Numerical: samples of the shortest run, of which a tenth at most is dropped."""
_AROUND = 9  # of them
_APART = 0.5  # of the usual step: samples that are no closer
_CHANCE = 3.0  # times the variance of white noise, that so few of them seldom reach


@dataclass(frozen=True, eq=False)
class Run:
    """A valid contiguous part of a recording as it is, uneven stamps and all.

    Attributes:
        step: time between samples [s], shape ``(n,)``.
        effort: force over each interval [F], shape ``(n,)``.
        position: at the end of each interval [x], shape ``(n,)``.
        start: position and velocity at the beginning [x], [x/s].
        load: relative normal load, one value or ``(n,)``.
        temperature: difference from reference [K], one value or ``(n,)``.
        noise: of the position signal [x].
        effort_noise: of the recorded force at each sample [F]; that of an interval between two samples is another.
        hold: how the force over an interval comes from those at the samples, see :func:`fric.simulation.intervals`.
        late: part of a sample by which a ``linear`` force acts after its stamps, on the curve through its samples; None: it is
            taken as the line through them.
        between: standard deviation of what may have acted between two samples beside what these say [F], shape ``(n,)``;
            nothing where it is known how a force is held.
    """

    step: Array
    effort: Array
    position: Array
    start: tuple[float, float]
    load: Array
    temperature: Array
    noise: float
    effort_noise: float
    hold: str
    late: float | None
    between: Array

    @cached_property
    def sample_time(self) -> float:
        """The usual time between samples [s]."""
        return float(np.median(self.step))

    def part(self, first: int, last: int) -> Run:
        """Intervals ``first`` to ``last`` (exclusive) as a run of their own."""
        position = self.position[first:last]
        begin = self.start
        if first > 0:
            # What follows a part is corrected at every sample: a difference will do for where it begins.
            before = float(self.position[first - 1])
            begin = (before, float((position[0] - before) / self.step[first]))
        load = self.load[first:last] if self.load.shape[0] > 1 else self.load
        temperature = self.temperature[first:last] if self.temperature.shape[0] > 1 else self.temperature
        return replace(
            self,
            step=self.step[first:last],
            effort=self.effort[first:last],
            position=position,
            start=begin,
            load=load,
            temperature=temperature,
            between=self.between[first:last],
        )

    def force_noise(self, random: np.random.Generator) -> Array:
        """Noise as strong as that of the recorded force, over each interval [F], shape ``(n,)``."""
        white = self.effort_noise * random.standard_normal(self.effort.shape[0] + 1)
        return _over_intervals(white, self.step, self.hold, self.late)

    def moved(self, effort: Array, position: Array) -> Run:
        """The same with ``effort`` [F] and ``position`` [x] added to the signals, shape ``(n,)`` each."""
        return replace(self, effort=self.effort + effort, position=self.position + position)


def runs_of(record: Record, late: float | None = None) -> list[Run]:
    """The valid contiguous parts of ``record`` that are long enough to learn from.

    Args:
        record: what was measured.
        late: see :class:`Run`.
    """
    load, temperature = surroundings(record)
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], record.mask, [False]]).astype(np.int8)))
    found = []
    for first, last in zip(bounds[::2].tolist(), bounds[1::2].tolist(), strict=True):
        if last - first < SHORTEST:
            continue
        time, position, effort = (each[first:last] for each in (record.time, record.position, record.effort))
        step = np.diff(time)
        found.append(
            Run(
                step=step,
                effort=np.ascontiguousarray(_over_intervals(effort, step, record.hold, late)),
                position=np.ascontiguousarray(position[1:]),
                start=initial_state(time, position)[:2],
                load=load[first : last - 1] if load.shape[0] > 1 else load,
                temperature=temperature[first : last - 1] if temperature.shape[0] > 1 else temperature,
                noise=noise_of(position, time=time),
                effort_noise=noise_of(effort, time=time),
                hold=record.hold,
                late=late,
                between=_between(effort, time, record.hold),
            )
        )
    return found


def _over_intervals(effort: Array, step: Array, hold: str, late: float | None) -> Array:
    """The constant force of each interval between samples [F], shape ``(n_samples - 1,)`` as ``step`` [s].

    Where nobody says how a force is held and the log is slow, a line through its samples cuts off what a smooth curve has
    between them: a twentieth of a force that swings with eight samples in a cycle.
    """
    if hold != "linear" or late is None:
        return intervals(effort, hold)
    time = np.concatenate([[0.0], np.cumsum(step)])
    usual = float(np.median(step))
    # A cubic through samples next to each other would make much of the noise in them.
    degree = 3 if float(np.min(step)) > _APART * usual else 1
    passed = make_interp_spline(time, effort, degree).antiderivative()(time - late * usual)
    return np.asarray(np.diff(passed) / step, dtype=np.float64)


def _between(effort: Array, time: Array, hold: str) -> Array:
    """What may have acted between two samples beside what these say [F], shape ``(n_samples - 1,)``.

    A controller faster than the log changes its force as roughly between samples as from one to the next. How roughly, high
    differences tell, here and there: of a jump at any time within an interval the mean over it is unsure by 0.29 of the jump,
    and these give 0.12 of it to each of the intervals around; of jitter that was another one at every step of the controller
    the two samples around an interval say nothing.
    """
    if hold != "linear":
        return np.zeros(effort.shape[0] - 1)
    rough = noise_at_each(effort, time) ** 2
    around = np.ones(_AROUND) / _AROUND
    local = np.convolve(np.pad(rough, (effort.shape[0] - rough.shape[0]) // 2, mode="edge"), around, mode="same")
    beyond = np.maximum(local - _CHANCE * noise_of(effort, time=time) ** 2, 0.0)
    return np.sqrt(0.25 * (beyond[:-1] + beyond[1:]))


def excerpt(runs: Sequence[Run], most: int) -> list[Run]:
    """About ``most`` intervals: the beginning, the middle and the end of each run."""
    share = min(1.0, most / sum(run.effort.shape[0] for run in runs))
    parts = []
    for run in runs:
        n = run.effort.shape[0]
        length = int(share * n / 3)
        if length < SHORTEST:
            parts.append(run)
            continue
        parts += [run.part(first, first + length) for first in (0, (n - length) // 2, n - length)]
    return parts


def innovations(model: Model, runs: Sequence[Run], index: float, n_substeps: int) -> Array:
    """Measured minus predicted position [x] at each sample of each run but its first ones.

    Args:
        model: that predicts.
        runs: what was measured.
        index: tracking index.
        n_substeps: steps of the model from one sample to the next.
    """
    loops, values = model.loops, model.values
    plant_values = np.array(model.plant_values)
    alpha, beta = gains(index)
    parts = []
    for run in runs:
        state = np.ascontiguousarray(model.plant.start(plant_values, *run.start), dtype=np.float64)
        found = np.empty(run.effort.shape[0])
        loops.observe(
            values, run.effort, run.position, run.step, n_substeps, run.load, run.temperature, alpha, beta, run.noise,
            state, *model.inner_states(run.start[1]), found,
        )  # fmt: skip
        parts.append(found[SETTLING:])
    # A model that escapes must cost much, not break the solver.
    return np.asarray(np.nan_to_num(np.concatenate(parts), nan=1e3, posinf=1e3, neginf=-1e3), dtype=np.float64)


def gains(index: float) -> tuple[float, float]:
    """Alpha and beta for a tracking index."""
    r = (4.0 + index - math.sqrt(8.0 * index + index * index)) / 4.0
    alpha = 1.0 - r * r
    return alpha, 2.0 * (2.0 - alpha) - 4.0 * math.sqrt(1.0 - alpha)
