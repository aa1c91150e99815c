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
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.ndimage import binary_dilation
from scipy.signal import lfilter

from ..identification.innovations import Run
from ..model import Model, Term
from ..record import Array
from ..simulation import respond, substeps
from ..threads import n_threads
from .least_squares import Bounds, Fit, fitted_values
from .motion import Motion, along, motion_of
from .runs import SMOOTH_LED, Runs

__all__ = ["STEP_OF_RATE", "Track", "Twin"]

_SMEARED = 3.0  # time constants of that, over which it smears a turn
_NEXT_TO_NOTHING = 1e-12  # [x/s], a speed that only has a sign
STEP_OF_RATE = 0.2
"""Numerical: the longest step of a simulation, times the fastest rate of the model."""
_MOST_STEPS = 4  # per sample: the step is implicit, and what is faster than the observer changes nothing that it sees
_STEP_OF_OBSERVER = 0.4  # of the observer's time constant: shorter ones it can't tell from this
_MOST_GAIN = 2.5  # times gain and 2 alpha + beta; at 4 the pursuit of a mass begins to swing
_LIGHTEST = 4.0  # times lighter than the mass whose impulses lead it, a model at most
_NOTHING = np.zeros(1)
_FIRST = 5  # samples, from which the force at its beginning is taken
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
class Track(Runs):
    """Runs that models follow by the impulses described above, and what each model lacks in them.

    Its attributes are those of :class:`fric.diagnosis.runs.Runs`.
    """

    def _first(self, model: Model, k: int) -> int:
        """Interval of run ``k`` at which ``model`` has to begin, to be where the axis is when it counts."""
        if _remembers(model) or model.has_transmission:
            return 0
        return max(self.lead[k] - self.settled(k), 0)

    def residual(self, model: Model, twin: Twin | None = None) -> Array:
        """The force that ``model`` lacks [F] at the end of each interval, shape ``(n,)``; on a ``twin`` of the recordings."""
        if model.plant.led:
            return self._lacking_at_contact(model, twin)
        # The impulses are those of one mass, whatever mass the model has: a light model must not be led with less force.
        return self._followed(model, self.mass, twin)

    def with_effort(self, added: float) -> Twin:
        """The recordings themselves, with ``added`` to their effort [F]."""
        return Twin(
            tuple(run.effort + added for run in self.runs),
            tuple(run.position for run in self.runs),
            tuple(np.zeros_like(run.effort) for run in self.runs),
        )

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
        loops, linked, plant_values = model.linked_loops, model.linked, np.array(model.plant_values)
        inertia = model.total_inertia
        parts = []
        with np.errstate(over="ignore"):  # a model that escapes has no number for it
            for k, whole in enumerate(self.runs):
                first, n = self._first(model, k), whole.effort.shape[0]
                run = whole.part(first, n) if first else whole
                effort = run.effort if twin is None else twin.efforts[k][first:]
                extra = _NOTHING if twin is None else twin.extras[k][first:]
                position = run.position if twin is None else twin.positions[k][first:]
                alpha, beta = self.gains(whole)
                state = np.append(model.plant.start(plant_values, *run.start), self.begin(k, first))
                found = np.zeros(n)
                around = run.step, self.n_substeps(model, whole), run.load, run.temperature, alpha, beta
                last = state, *self.inner_states(model, k, run.start[1]), found[first:]
                if mass is None:
                    loops.observe(linked, effort, position, *around, self.noise[k], *last)
                else:
                    gain = min(mass / inertia, _MOST_GAIN / (2.0 * alpha + beta), _LIGHTEST)
                    loops.pursue(linked, effort, extra, position, *around, gain, self.noise[k], *last)
                parts.append((inertia if mass is None else mass) * beta / whole.sample_time**2 * found)
        return self._finite(self.joined(parts))

    def _lacking_at_contact(self, model: Model, twin: Twin | None) -> Array:
        """What a contact lacks whose force is measured [F]: no body has to move by itself, it is led along the motion."""
        found = []
        for k, run in enumerate(self.runs):
            motion, effort = self.led_motion[k], run.effort
            if twin is not None:
                effort = twin.efforts[k]
                motion = motion_of(replace(run, position=twin.positions[k]), SMOOTH_LED * self.bandwidth)
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
        reach = math.ceil(_SMEARED / (SMOOTH_LED * self.bandwidth * motion.step))
        loose = binary_dilation((speed <= self.rest(k)) | turns, iterations=reach)
        speed = np.maximum(speed, _NEXT_TO_NOTHING)
        ahead, back = (self._along(model, k, motion, np.where(loose, way, motion.velocity)) for way in (speed, -speed))
        return np.clip(effort, np.minimum(ahead, back), np.maximum(ahead, back))

    def _along(self, model: Model, k: int, motion: Motion, velocity: Array) -> Array:
        """The force [F] along the positions of ``motion`` with ``velocity`` [x/s], shape ``(n,)``."""
        states = self.inner_states(model, k, float(motion.velocity[0]))
        return along(model, self.runs[k], self.time[k], motion, velocity, states)

    def needed(self, model: Model, extra: Term | None = None) -> Array:
        """As :meth:`residual`, by the force that ``model``, with the term ``extra``, needs along the measured motion [F]."""
        given_by_path = self._applied(model)
        if extra is not None:
            model = model.with_terms((*model.terms, extra))
        motion = self.raw_motion if model.has_slip_dynamics else self.motion
        found = []
        for k, (run, time, each, given) in enumerate(zip(self.runs, self.time, motion, given_by_path, strict=True)):
            states = self.inner_states(model, k, float(each.velocity[0]))
            found.append(along(model, run, time, each, each.velocity, states) - given)
        return self._finite(self.seen(found))

    def _finite(self, signal: Array) -> Array:
        """``signal`` without what no solver can use."""
        most = self._most
        if not np.all(np.isfinite(signal)):
            signal = np.nan_to_num(signal, nan=most, posinf=most, neginf=-most)
        return np.clip(signal, -most, most)

    @cached_property
    def _most(self) -> float:
        """The largest force [F] that a model may seem to lack."""
        return _LARGEST * max(float(np.ptp(run.effort)) for run in self.runs)

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
            return model.inner_states(velocity, force)
        motion = past.raw_motion if model.has_slip_dynamics else past.motion
        states = model.inner_states(float(motion.velocity[0]), force)
        along(model, past.run, past.time, motion, motion.velocity, states)
        return states

    def n_substeps(self, model: Model, run: Run) -> int:
        """Steps of ``model`` per sample, enough for what the observer sees.

        Bristles and contacts may be far faster than that: on the recording ``bags/slide``, with bristles, two steps per sample
        (400 rad/s, 2 ms) instead of sixteen change what is missing by less than a thousandth of the floor.
        """
        most = min(math.ceil(self.bandwidth * run.sample_time / _STEP_OF_OBSERVER), _MOST_STEPS)
        return min(substeps(model, run.sample_time, STEP_OF_RATE), most)

    def seen(self, of_run: Sequence[Array]) -> Array:
        """The residual that a missing force per interval would give [F]: low-passed and joined, shape ``(n,)``."""
        parts = []
        for run, force in zip(self.runs, of_run, strict=True):
            alpha, beta = self.gains(run)
            parts.append(np.asarray(lfilter([0.0, beta], [1.0, alpha + beta - 2.0, 1.0 - alpha], force), dtype=np.float64))
        return self.joined(parts)

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


def _remembers(model: Model) -> bool:
    """True for a model whose force hangs on what was before."""
    return model.has_slip_dynamics or any(held.effect.n_memory for held in model.terms)
