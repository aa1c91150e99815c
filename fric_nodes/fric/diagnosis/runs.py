"""Recordings as contiguous runs that an observer follows: which samples count, their noise and the motion of the axis.

A run's first intervals lead to the part that counts: the observer settles in them. Signals of all runs are joined without these
intervals into one array of shape ``(n,)``, the rows of every residual.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from ..identification.innovations import SHORTEST, Run, runs_of
from ..model import Model
from ..record import Array, Index, Record
from ..signals.resolution import noise_of, step_of
from .motion import SMOOTH, Motion, Past, motion_of

__all__ = ["SETTLING", "SMOOTH_LED", "Runs"]

Same = TypeVar("Same", bound="Runs")

SMOOTH_LED = 2.0
"""Numerical, times the observer's bandwidth [rad/s]: cutoff of the motion that leads a contact.

It is lower than ``SMOOTH``, so that less of the encoder's noise comes through.
"""
_UNSURE = 0.2  # of the variance of noise
SETTLING = 6.0
"""Numerical, time constants of the observer that are dropped at the start of each run."""
_OVER = 0.3  # [s] after which it doesn't matter where in its gap a body began, how its spring was bent or a command had come
_FORGOTTEN = 3.0  # [s] the same for what friction remembers, and for what rings on the body
_FEWEST = 50  # intervals of a past that tells anything
_SHAKEN = 0.4  # steps of the encoder that count as its noise


@dataclass(frozen=True, eq=False)
class Runs:
    """Contiguous runs of recordings, and what an observer needs to follow them.

    Attributes:
        runs: contiguous parts of the recordings.
        time: start of each run in its record [s].
        record: number of each run's record.
        bandwidth: w [rad/s].
        mass: by which being behind becomes a force [F s^2/x].
        noise: of the position for each run [x].
        sizes: typical size of a linear parameter by its dimension, for those that are near zero.
        lead: intervals at the beginning of each run that come before the part that counts, so that a model's states are those
            of the axis there.
        past: what came before each run, if it is a part of one: models that remember for longer are led along it.
        late: part of a sample by which the force acts after its stamps, where its hold isn't known.
        given: mass that the axis is said to have [F s^2/x]; None where nothing else is said than ``mass``.
        noticeable: root mean square of the force that the nominal model lacks, and of what noise leaves [F]; None where
            nothing was fitted yet.
    """

    runs: tuple[Run, ...]
    time: tuple[Array, ...]
    record: tuple[int, ...]
    bandwidth: float
    mass: float
    noise: tuple[float, ...]
    sizes: Mapping[str, float]
    lead: tuple[int, ...]
    past: tuple[Past | None, ...]
    late: float = 0.0
    given: float | None = None
    noticeable: tuple[float, float] | None = None

    @classmethod
    def of(cls: type[Same], records: Sequence[Record], bandwidth: float, model: Model, late: float = 0.0) -> Same:
        """Follow ``records`` with ``bandwidth`` [rad/s]; the inertia of ``model`` sets the scale."""
        runs: list[Run] = []
        time: list[Array] = []
        number: list[int] = []
        noise: list[float] = []
        for k, record in enumerate(records):
            found = runs_of(record, late)
            bounds = np.flatnonzero(np.diff(np.concatenate([[False], record.mask, [False]]).astype(np.int8)))
            starts = [int(first) for first, last in zip(bounds[::2], bounds[1::2], strict=True) if last - first >= SHORTEST]
            for run, first in zip(found, starts, strict=True):
                runs.append(run)
                time.append(record.time[first] + np.cumsum(run.step))
                number.append(k)
                noise.append(max(noise_of(run.position, time=time[-1]), _SHAKEN * step_of(run.position)))
        mass = model.total_inertia
        return cls(
            tuple(runs),
            tuple(time),
            tuple(number),
            bandwidth,
            mass,
            tuple(noise),
            _sizes(runs, mass),
            (0,) * len(runs),
            (None,) * len(runs),
            late,
        )

    @property
    def largest_force(self) -> float:
        """The largest force, either way, of the recordings [F]."""
        return max(float(np.max(np.abs(run.effort))) for run in self.runs)

    def parts(self: Same, spans: Sequence[tuple[int, int, int]]) -> Same:
        """The parts of the recordings in ``spans``: run, first and last interval (exclusive) of each."""
        runs, time, leads, pasts = [], [], [], []
        for k, first, last in spans:
            run, h = self.runs[k], self.runs[k].sample_time
            lead = min(first, math.ceil(_OVER / h))
            begin = first - lead
            before = min(begin, math.ceil((_FORGOTTEN - _OVER) / h))
            runs.append(run.part(begin, last))
            time.append(self.time[k][begin:last])
            leads.append(lead)
            span = slice(begin - before, begin)
            past = Past(run.part(span.start, span.stop), self.time[k][span], SMOOTH * self.bandwidth)
            pasts.append(past if before > _FEWEST else None)
        return replace(
            self,
            runs=tuple(runs),
            time=tuple(time),
            record=tuple(self.record[k] for k, _, _ in spans),
            noise=tuple(self.noise[k] for k, _, _ in spans),
            lead=tuple(leads),
            past=tuple(pasts),
        )

    @property
    def masses(self) -> tuple[float, ...]:
        """Masses that the axis may well have: that of the model with which the recordings are followed, and the given one."""
        return (self.mass,) if self.given is None else (self.mass, self.given)

    @cached_property
    def travel(self) -> float:
        """From the lowest to the highest position of all runs [x]."""
        return max(float(np.ptp(np.concatenate([run.position for run in self.runs]))), 1e-300)

    @cached_property
    def unsure(self) -> bool:
        """Whether more than the noise of its samples makes the force between them unsure.

        What stands out then goes with the motion, as friction does: a form that noise can't have says nothing.
        """
        between = sum(float(np.sum(run.between**2)) for run in self.runs)
        noise = sum(float(run.effort_noise**2 * run.effort.shape[0]) for run in self.runs)
        return between > _UNSURE * noise

    @property
    def n_samples(self) -> int:
        """Intervals that count."""
        return sum(run.effort.shape[0] - lead for run, lead in zip(self.runs, self.lead, strict=True))

    @property
    def starts(self) -> Index:
        """Index of the first residual of each run, shape ``(n_runs,)``."""
        return np.cumsum([0, *(run.effort.shape[0] - self._settling(k) for k, run in enumerate(self.runs))])[:-1]

    @property
    def independent(self) -> float:
        """About how many independent numbers a residual holds: it is low-passed."""
        last = [float(np.sum(run.step[lead:])) for run, lead in zip(self.runs, self.lead, strict=True)]
        return 0.5 * self.bandwidth * sum(last)

    def _settling(self, k: int) -> int:
        """Intervals of run ``k`` that don't count: those that lead to it, or until the observer has settled."""
        return max(self.lead[k], min(self.settled(k), len(self.runs[k].effort) // 3))

    def settled(self, k: int) -> int:
        """Intervals until the observer has settled in run ``k``."""
        return max(math.ceil(SETTLING / (self.bandwidth * self.runs[k].sample_time)), 20)

    def joined(self, of_run: Sequence[Array]) -> Array:
        """Signals with one value per interval of each run, without the settling, joined, shape ``(n,)``."""
        return np.concatenate([part[self._settling(k) :] for k, part in enumerate(of_run)])

    def split(self, joined: Array) -> list[Array]:
        """What :meth:`joined` gives, per run."""
        return np.split(joined, self.starts[1:])

    def padded(self, joined: Array) -> list[Array]:
        """What :meth:`joined` gives, per run, with zeros where the observer was settling."""
        parts = []
        for run, part in zip(self.runs, self.split(joined), strict=True):
            parts.append(np.concatenate([np.zeros(run.effort.shape[0] - part.shape[0]), part]))
        return parts

    def gains(self, run: Run) -> tuple[float, float]:
        """Alpha and beta at the run's sample time."""
        z = math.exp(-self.bandwidth * run.sample_time)
        return 1.0 - z * z, (1.0 - z) ** 2

    @cached_property
    def motion(self) -> tuple[Motion, ...]:
        """The measured motion of each run."""
        return tuple(motion_of(run, SMOOTH * self.bandwidth) for run in self.runs)

    @cached_property
    def raw_motion(self) -> tuple[Motion, ...]:
        """The measured motion of each run, as the encoder gives it: a filter would stretch bristles that are stiff."""
        return tuple(motion_of(run, math.inf) for run in self.runs)

    @cached_property
    def led_motion(self) -> tuple[Motion, ...]:
        """The measured motion of each run, as it leads a contact."""
        return tuple(motion_of(run, SMOOTH_LED * self.bandwidth) for run in self.runs)

    def rest(self, k: int) -> float:
        """Speed [x/s] below which the noise of run ``k`` doesn't tell motion from rest."""
        # White noise, differentiated up to the cut: its variance times h/pi times the integral of the frequency squared.
        cut = min(SMOOTH_LED * self.bandwidth, math.pi / self.runs[k].sample_time)
        return 3.0 * self.noise[k] * math.sqrt(self.runs[k].sample_time * cut**3 / (3.0 * math.pi))

    def begin(self, k: int, first: int = 0) -> float:
        """Time in its recording at which interval ``first`` of run ``k`` begins [s].

        A slow drift counts from the beginning of the recording, also in a part of it.
        """
        return float(self.time[k][first] - self.runs[k].step[first])

    def scale(self, model: Model, names: Sequence[str]) -> Array:
        """Unit of each of the parameters ``names`` in a fit, shape ``(n_names,)``, each in its parameter's unit.

        That is the parameter's present size. For a parameter near zero it is the typical size of its dimension, since a step in
        units of zero would leave it there. For a period it is at most the change that makes one cycle more or less over the
        travel.
        """
        values, declared = model.values, [parameter.declaration for parameter in model.parameters()]
        index = [model.names.index(name) for name in names]
        scale = np.array([max(abs(values[k]), self.sizes.get(declared[k].dimension, 0.0)) for k in index])
        for place, k in enumerate(index):
            if declared[k].name == "period":
                scale[place] = min(abs(values[k]), values[k] ** 2 / self.travel)
        scale[scale == 0.0] = 1.0
        return scale


def _sizes(runs: Sequence[Run], mass: float) -> dict[str, float]:
    """Typical size of a linear parameter by its dimension: it makes a twentieth of the force in the runs."""
    if not runs:
        return {}
    force = 0.05 * max(float(np.std(np.concatenate([run.effort for run in runs]))), 1e-12)
    speed = max([1e-12, *(float(np.std(np.diff(run.position) / run.step[1:])) for run in runs)])
    travel = max(float(np.ptp(np.concatenate([run.position for run in runs]))), 1e-12)
    return {
        "F": force,
        "F s/x": force / speed,
        "F s^2/x^2": force / speed**2,
        "F/x": force / travel,
        "F/x^3": force / travel**3,
        "F s^2/x": 0.05 * mass,
        "1": 0.05,
    }
