"""What a model lacks, as a force over time: it is made to follow the measured motion, by impulses that are counted.

Between two samples the model moves under the recorded force; at each sample its velocity gets an impulse from how far it is
behind the measured position, e, and from how that has changed:

    m dv = M (beta e + alpha (e - e_before)) / h,     alpha = 1 - z^2,  beta = (1 - z)^2,  z = exp(-w h)

with M the mass that the model was meant to have. For a mass alone this has a double pole at z. A force f that the model lacks
makes it lag until the impulses give that force: at frequency zero M beta e / h^2 = f, exactly, whatever friction, springs and
masses the model has, since its position is never set. (An alpha-beta filter does set it, and what the jump of the position
saves the model's own friction doesn't show as missing: the more friction a model has the less it seems to lack.) So

    r = M beta e / h^2

is the missing force, low-passed without loss at frequency zero by about two poles at w and late by 2/w. It is defined for
friction that sticks exactly, a body behind a gap and a lagging command, at rest as well as in motion, and needs no derivative
of the measured position. The force that the model would have needed for the motion is u + r.

Bristles are another matter: they may be far stiffer than M w^2, and impulses would ring on them. A model with slip dynamics is
led by the alpha-beta filter itself, whose position is set, and r is reckoned with the model's own mass.
Source: the gains are those of the alpha-beta filter in :mod:`fric.identification.innovations`; the rest is derived here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.ndimage import binary_dilation
from scipy.signal import butter, lfilter, sosfiltfilt

from ..identification.gauss_newton import Solution, minimise
from ..identification.innovations import Run, runs_of
from ..model import Model, Term
from ..plants import PLANTS
from ..record import Array, Index, Record
from ..signals.resolution import noise_of, step_of
from ..simulation import respond, substeps
from ..threads import n_threads
from .universe import universe_of

__all__ = ["Bounds", "Fit", "Motion", "Track", "Twin", "fitted_values", "smooth"]

_SMOOTH = 4.0  # times the bandwidth: of the motion along which a force is needed
_SMOOTH_LED = 2.0  # the same, where a contact is led: less of the encoder's noise
_SMEARED = 3.0  # time constants of that, over which it smears a turn
_NEXT_TO_NOTHING = 1e-12  # [x/s], a speed that only has a sign
_STEP_OF_RATE = 0.2
_MOST_STEPS = 4  # per sample: the step is implicit, and what is faster than the observer changes nothing that it sees
_STEP_OF_OBSERVER = 0.4  # of the observer's time constant: shorter ones it can't tell from this
_UNSURE = 0.2  # of the variance of noise
_SETTLING = 6.0  # time constants of the observer that are dropped at the start of each run
_OVER = 0.3  # [s] after which it doesn't matter where in its gap a body began, how its spring was bent or a command had come
_FORGOTTEN = 3.0  # [s] the same for what friction remembers, and for what rings on the body
_MOST_GAIN = 2.5  # times gain and 2 alpha + beta; at 4 the pursuit of a mass begins to swing
_LIGHTEST = 4.0  # times lighter than the mass whose impulses lead it, a model at most
_NOTHING = np.zeros(1)
_TINY = 1e-9  # of its scale, the least that a positive parameter may be
_SHORTEST = 200  # samples of a run
_FEWEST = 50  # intervals of a past that tells anything
_FIRST = 5  # samples, from which the force at its beginning is taken
_SHAKEN = 0.4  # steps of the encoder that count as its noise
_LARGEST = 1e6  # of the force range; a model that escapes must cost much, not break the solver


@dataclass(frozen=True, eq=False)
class Twin:
    """A recording that a model itself would have left, see :mod:`fric.diagnosis.twin`; per run of the track.

    Attributes:
        efforts: recorded force over each interval [F].
        positions: recorded position at its end [x].
        extras: force that led the model besides, behind its command path [F].
    """

    efforts: tuple[Array, ...]
    positions: tuple[Array, ...]
    extras: tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class Motion:
    """The measured motion of one run, smoothed, in the middle of each interval.

    Attributes:
        position: [x], shape ``(n,)`` as the next two.
        velocity: [x/s].
        acceleration: [x/s^2].
        step: between them [s].
    """

    position: Array
    velocity: Array
    acceleration: Array
    step: float


@dataclass(frozen=True, eq=False)
class Past:
    """What came before a run.

    Attributes:
        run: the intervals before it.
        time: at their ends [s].
        cutoff: at which their motion is smoothed [rad/s].
    """

    run: Run
    time: Array
    cutoff: float

    @cached_property
    def motion(self) -> Motion:
        """The measured motion, smoothed."""
        return _motion(self.run, self.cutoff)

    @cached_property
    def raw_motion(self) -> Motion:
        """The measured motion, as the encoder gives it."""
        return _motion(self.run, math.inf)


def along(
    model: Model,
    run: Run,
    time: Array,
    motion: Motion,
    velocity: Array,
    states: tuple[Array, Array],
    extra: Term | None = None,
) -> Array:
    """The force [F] that ``model``, with the term ``extra``, needs along the positions of ``motion``, shape ``(n,)``.

    It has the ``velocity`` [x/s]; its inner ``states`` are led on in place.
    """
    universe = universe_of(model)
    values = universe.values(model)
    if extra is not None:
        universe.put(values, extra)
    needed, friction = np.empty_like(velocity), np.empty_like(velocity)
    universe.loops.predict(
        values, time - 0.5 * motion.step, motion.position, velocity, motion.acceleration,
        motion.step, run.load, run.temperature, *states, needed, friction,
    )  # fmt: skip
    return needed


@dataclass(frozen=True, eq=False)
class Track:
    """Recordings to follow, and how.

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

    @classmethod
    def of(cls, records: Sequence[Record], bandwidth: float, model: Model, late: float = 0.0) -> Track:
        """Follow ``records`` with ``bandwidth`` [rad/s]; the inertia of ``model`` sets the scale."""
        runs: list[Run] = []
        time: list[Array] = []
        number: list[int] = []
        noise: list[float] = []
        for k, record in enumerate(records):
            found = runs_of(record, late)
            bounds = np.flatnonzero(np.diff(np.concatenate([[False], record.mask, [False]]).astype(np.int8)))
            starts = [int(first) for first, last in zip(bounds[::2], bounds[1::2], strict=True) if last - first >= _SHORTEST]
            for run, first in zip(found, starts, strict=True):
                runs.append(run)
                time.append(record.time[first] + np.cumsum(run.step))
                number.append(k)
                noise.append(max(noise_of(run.position), _SHAKEN * step_of(run.position)))
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

    def parts(self, spans: Sequence[tuple[int, int, int]]) -> Track:
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
            past = Past(run.part(span.start, span.stop), self.time[k][span], _SMOOTH * self.bandwidth)
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
        """First residual of each run."""
        return np.cumsum([0, *(run.effort.shape[0] - self._settling(k) for k, run in enumerate(self.runs))])[:-1]

    @property
    def independent(self) -> float:
        """About how many independent numbers a residual holds: it is low-passed."""
        last = [float(np.sum(run.step[lead:])) for run, lead in zip(self.runs, self.lead, strict=True)]
        return 0.5 * self.bandwidth * sum(last)

    def _settling(self, k: int) -> int:
        """Intervals of run ``k`` that don't count: those that lead to it, or until the observer has settled."""
        return max(self.lead[k], min(self._settled(k), len(self.runs[k].effort) // 3))

    def _settled(self, k: int) -> int:
        """Intervals until the observer has settled in run ``k``."""
        return max(math.ceil(_SETTLING / (self.bandwidth * self.runs[k].sample_time)), 20)

    def _first(self, model: Model, k: int) -> int:
        """Interval of run ``k`` at which ``model`` has to begin, to be where the axis is when it counts."""
        if _remembers(model) or model.plant is PLANTS[model.plant.id].driven:
            return 0
        return max(self.lead[k] - self._settled(k), 0)

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

    def residual(self, model: Model, twin: Twin | None = None) -> Array:
        """The force that ``model`` lacks [F] at the end of each interval, shape ``(n,)``; on a ``twin`` of the recordings."""
        if model.plant.led:
            return self._lacking_at_contact(model, twin)
        # The impulses are those of one mass, whatever mass the model has: a light model must not be led with less force.
        return self._followed(model, self.mass, twin)

    def unpaid(self, model: Model) -> float:
        """By how much less energy ``model`` seems to lack when its position is set instead of pushed; at least 1.

        What a model with bristles seems to lack has to be held against that: its position is set.
        """
        if model.has_slip_dynamics or model.plant.led:
            return 1.0
        pushed, put = self.residual(model), self._followed(model, None)
        return max(float(pushed @ pushed) / max(float(put @ put), 1e-300), 1.0)

    def _followed(self, model: Model, mass: float | None, twin: Twin | None = None) -> Array:
        """The force that ``model`` lacks, pushed by the impulses of ``mass``; where that is None its position is set [F]."""
        universe = universe_of(model)
        values, plant_values = universe.values(model), np.array(model.plant_values)
        inertia = model.total_inertia
        parts = []
        for k, whole in enumerate(self.runs):
            first, n = self._first(model, k), whole.effort.shape[0]
            run = whole.part(first, n) if first else whole
            effort = run.effort if twin is None else twin.efforts[k][first:]
            extra = _NOTHING if twin is None else twin.extras[k][first:]
            position = run.position if twin is None else twin.positions[k][first:]
            alpha, beta = self.gains(whole)
            state = np.append(universe.plant.start(plant_values, *run.start), self.begin(k, first))
            found = np.zeros(n)
            around = run.step, self.n_substeps(model, whole), run.load, run.temperature, alpha, beta
            last = state, *self.inner_states(model, k, run.start[1]), found[first:]
            if mass is None:
                universe.loops.observe(values, effort, position, *around, self.noise[k], *last)
            else:
                gain = min(mass / inertia, _MOST_GAIN / (2.0 * alpha + beta), _LIGHTEST)
                universe.loops.pursue(values, effort, extra, position, *around, gain, self.noise[k], *last)
            with np.errstate(over="ignore"):  # a model that escapes has no number for it
                parts.append((inertia if mass is None else mass) * beta / whole.sample_time**2 * found)
        return self._finite(self.joined(parts))

    def _lacking_at_contact(self, model: Model, twin: Twin | None) -> Array:
        """What a contact lacks whose force is measured [F]: no body has to move by itself, it is led along the motion."""
        found = []
        for k, run in enumerate(self.runs):
            motion, effort = self.led_motion[k], run.effort
            if twin is not None:
                effort = twin.efforts[k]
                motion = _motion(replace(run, position=twin.positions[k]), _SMOOTH_LED * self.bandwidth)
            found.append(self.borne(model, k, motion, effort) - effort)
        return self._finite(self.seen(found))

    def borne(self, model: Model, k: int, motion: Motion, effort: Array) -> Array:
        """The force [F] that the contact of ``model`` gives along ``motion`` of run ``k``, shape ``(n,)``.

        Without bristles it is, at rest and where the direction turns, the measured ``effort`` up to what slides in either one.
        """
        if model.has_slip_dynamics:
            return self._along(model, k, motion, motion.velocity)
        speed = np.abs(motion.velocity)
        turns = np.diff(np.sign(motion.velocity), append=0.0) != 0.0
        # A filter that takes the noise off the motion smears its turns.
        reach = math.ceil(_SMEARED / (_SMOOTH_LED * self.bandwidth * motion.step))
        loose = binary_dilation((speed <= self._rest(k)) | turns, iterations=reach)
        speed = np.maximum(speed, _NEXT_TO_NOTHING)
        ahead, back = (self._along(model, k, motion, np.where(loose, way, motion.velocity)) for way in (speed, -speed))
        return np.clip(effort, np.minimum(ahead, back), np.maximum(ahead, back))

    def _along(self, model: Model, k: int, motion: Motion, velocity: Array) -> Array:
        """The force [F] along the positions of ``motion`` with ``velocity`` [x/s], shape ``(n,)``."""
        states = self.inner_states(model, k, float(motion.velocity[0]))
        return along(model, self.runs[k], self.time[k], motion, velocity, states)

    def _rest(self, k: int) -> float:
        """Speed [x/s] below which the noise of run ``k`` doesn't tell motion from rest."""
        # White noise, differentiated up to the cut: its variance times h/pi times the integral of the frequency squared.
        cut = min(_SMOOTH_LED * self.bandwidth, math.pi / self.runs[k].sample_time)
        return 3.0 * self.noise[k] * math.sqrt(self.runs[k].sample_time * cut**3 / (3.0 * math.pi))

    @cached_property
    def led_motion(self) -> tuple[Motion, ...]:
        """The measured motion of each run, as it leads a contact."""
        return tuple(_motion(run, _SMOOTH_LED * self.bandwidth) for run in self.runs)

    def needed(self, model: Model, extra: Term | None = None) -> Array:
        """As :meth:`residual`, by the force that ``model``, with the term ``extra``, needs along the measured motion [F]."""
        motion = self.raw_motion if model.has_slip_dynamics else self.motion
        found = []
        for k, (run, time, each, given) in enumerate(zip(self.runs, self.time, motion, self._applied(model), strict=True)):
            states = self.inner_states(model, k, float(each.velocity[0]))
            found.append(along(model, run, time, each, each.velocity, states, extra) - given)
        return self._finite(self.seen(found))

    def _finite(self, signal: Array) -> Array:
        """``signal`` without what no solver can use."""
        most = _LARGEST * max(float(np.ptp(run.effort)) for run in self.runs)
        return np.clip(np.nan_to_num(signal, nan=most, posinf=most, neginf=-most), -most, most)

    @cached_property
    def motion(self) -> tuple[Motion, ...]:
        """The measured motion of each run."""
        return tuple(_motion(run, _SMOOTH * self.bandwidth) for run in self.runs)

    @cached_property
    def raw_motion(self) -> tuple[Motion, ...]:
        """The measured motion of each run, as the encoder gives it: a filter would stretch bristles that are stiff."""
        return tuple(_motion(run, math.inf) for run in self.runs)

    def _applied(self, model: Model) -> list[Array]:
        """What comes out of the command path of ``model`` [F], per run; that of the last model is kept."""
        path = tuple((held.effect.key, held.values) for held in model.terms if held.effect.command is not None)
        last = self._paths.get("last")  # taken and put back as one: several threads ask at once
        if last is None or last[0] != path:
            last = path, [respond(model, run.effort, run.sample_time) for run in self.runs]
            self._paths["last"] = last
        return list(last[1])

    @cached_property
    def _paths(self) -> dict[str, Any]:
        return {}

    def inner_states(self, model: Model, k: int, velocity: float) -> tuple[Array, Array]:
        """What ``model`` remembers where run ``k`` begins, with ``velocity`` [x/s]; a measured contact is bent by then."""
        past = self.past[k]
        run = self.runs[k] if past is None else past.run
        force = float(np.median(run.effort[:_FIRST])) if model.plant.led else 0.0
        if past is None or not _remembers(model):
            return universe_of(model).inner_states(model, velocity, force)
        motion = past.raw_motion if model.has_slip_dynamics else past.motion
        states = universe_of(model).inner_states(model, float(motion.velocity[0]), force)
        along(model, past.run, past.time, motion, motion.velocity, states)
        return states

    def begin(self, k: int, first: int = 0) -> float:
        """Time in its recording at which interval ``first`` of run ``k`` begins [s].

        A part must not take a slow drift for a new one.
        """
        return float(self.time[k][first] - self.runs[k].step[first])

    def n_substeps(self, model: Model, run: Run) -> int:
        """Steps of ``model`` per sample, enough for what the observer sees.

        Bristles and contacts may be far faster than that: on the recording ``bags/slide``, with bristles, two steps per sample
        (400 rad/s, 2 ms) instead of sixteen change what is missing by less than a thousandth of the floor.
        """
        most = min(math.ceil(self.bandwidth * run.sample_time / _STEP_OF_OBSERVER), _MOST_STEPS)
        return min(substeps(model, run.sample_time, _STEP_OF_RATE), most)

    def seen(self, of_run: Sequence[Array]) -> Array:
        """A force per interval as the observer would see it, were it missing: filtered, joined, shape ``(n,)``."""
        parts = []
        for run, force in zip(self.runs, of_run, strict=True):
            alpha, beta = self.gains(run)
            parts.append(np.asarray(lfilter([0.0, beta], [1.0, alpha + beta - 2.0, 1.0 - alpha], force), dtype=np.float64))
        return self.joined(parts)

    def scale(self, model: Model, names: Sequence[str]) -> Array:
        """Size of each of the parameters ``names``.

        A parameter near zero gets that of what would matter, or it could never leave; a period that of one cycle more or less
        over the travel.
        """
        values, declared = model.values, [parameter.declaration for parameter in model.parameters()]
        index = [model.names.index(name) for name in names]
        scale = np.array([max(abs(values[k]), self.sizes.get(declared[k].dimension, 0.0)) for k in index])
        for place, k in enumerate(index):
            if declared[k].name == "period":
                scale[place] = min(abs(values[k]), values[k] ** 2 / self.travel)
        scale[scale == 0.0] = 1.0
        return scale

    def fit(
        self,
        model: Model,
        names: Sequence[str],
        max_iterations: int = 12,
        bounds: Bounds | None = None,
        weights: Array | None = None,
        twin: Twin | None = None,
    ) -> Fit:
        """``model`` with the parameters ``names`` such that it lacks the least force, by default everywhere.

        Args:
            model: to begin with.
            names: of the free parameters.
            max_iterations: of the fit.
            bounds: of some of them.
            weights: of the rows of the residual, shape ``(n,)``.
            twin: of the recordings, to be fitted in their place.
        """
        scale = self.scale(model, names)
        found, answer = fitted_values(
            lambda trial: self.residual(trial, twin) * (1.0 if weights is None else weights),
            model,
            names,
            scale,
            bounds or {},
            difference=5e-3,  # smaller ones see single sticks and slips instead of their trend
            point_tolerance=1e-4,
            cost_tolerance=1e-5,
            max_iterations=max_iterations,
            secant=True,
            threads=n_threads(),
        )
        return Fit(found, tuple(names), answer, scale)


def _sizes(runs: Sequence[Run], mass: float) -> dict[str, float]:
    """A twentieth of what the forces and motions of the runs would make a linear parameter."""
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


Bounds = dict[str, tuple[float, float]]


def fitted_values(
    residual: Callable[[Model], Array], model: Model, names: Sequence[str], scale: Array, bounds: Bounds, **how: Any
) -> tuple[Model, Solution]:
    """``model`` with the parameters ``names`` such that the ``residual`` is least, and the solution in units of ``scale``.

    Args:
        residual: of a model [F], shape ``(n,)``.
        model: to begin with.
        names: of the free parameters.
        scale: of each of them.
        bounds: of some of them, beside those that they were declared with.
        how: tolerances and limits of :func:`fric.identification.gauss_newton.minimise`.
    """
    index = np.array([model.names.index(name) for name in names], dtype=np.int64)
    declared = [parameter.declaration for parameter in model.parameters()]
    lower, upper = np.empty(index.shape[0]), np.empty(index.shape[0])
    for k, name in enumerate(names):
        p = declared[index[k]]
        low, high = bounds.get(name, (-np.inf, np.inf))
        lower[k], upper[k] = max(p.lower, low, _TINY * scale[k] if p.positive else -np.inf), min(p.upper, high)
    values = model.values

    def at(point: Array) -> Model:
        trial = values.copy()
        trial[index] = point * scale
        return model.with_values(trial)

    answer = minimise(lambda point: residual(at(point)), values[index] / scale, lower / scale, upper / scale, **how)
    return at(answer.point), answer


def _remembers(model: Model) -> bool:
    """True for a model whose force hangs on what was before."""
    return model.has_slip_dynamics or any(held.effect.n_memory for held in model.terms)


@dataclass(frozen=True, eq=False)
class Fit:
    """A model that has been fitted to a track.

    Attributes:
        model: with its values.
        names: of the parameters that were free.
        solution: residual [F] and Jacobian at the optimum, in units of ``scale``.
        scale: of each free parameter.
    """

    model: Model
    names: tuple[str, ...]
    solution: Solution
    scale: Array

    @property
    def residual(self) -> Array:
        """The force that is missing [F], shape ``(n,)``."""
        return self.solution.residual

    @property
    def jacobian(self) -> Array:
        """Derivative of the residual, shape ``(n, n_free)``, per ``scale`` of each parameter."""
        return self.solution.jacobian


def smooth(signal: Array, step: float, cutoff: float) -> Array:
    """``signal`` without what is faster than ``cutoff`` [rad/s], without phase."""
    edge = cutoff * step / math.pi
    if edge >= 0.9:
        return signal
    result: Array = sosfiltfilt(butter(2, edge, output="sos"), signal)
    return result


def _motion(run: Run, cutoff: float) -> Motion:
    """The measured motion of ``run`` without what is faster than ``cutoff`` [rad/s]."""
    step = run.sample_time
    position = smooth(np.concatenate([[run.start[0]], run.position]), step, cutoff)
    velocity = np.diff(position) / step
    return Motion(0.5 * (position[1:] + position[:-1]), velocity, np.gradient(velocity, step), step)
