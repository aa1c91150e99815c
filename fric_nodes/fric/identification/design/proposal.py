"""From a fit, or a structure with values, to the next experiment: the problem set up, solved, compared and written down."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from ...control.feedbacks.pid import PidGains
from ...excitation import EXCITATIONS
from ...excitation_kind import Excitation
from ...model import Model
from ...record import Array, Record
from ..free_parameters import FreeParameters
from ..result import Identification, Options
from ..sensitivity import VIEWS, of_recordings, typical_sizes
from .limits import DesignError, Limits, Rig
from .search import Candidate, Problem, Trial, best_of_each, search
from .trial import DELAY, OVERHEAD, PAUSE, SEED, Choice, gains_for, simulated

__all__ = ["Proposal", "problem_for", "propose"]

_FLOOR = 0.1  # of the largest parameter of the same dimension: an error is related to no less
_LEAST = 0.01  # of what a linear parameter would be if it took all the force: an error is related to no less
_ASSUMED = 0.2  # of a typical force: what a term that a fit found to be next to nothing is taken to have
_GENERIC = "multisine"  # what a proposal is compared with


@dataclass(frozen=True, eq=False)
class Proposal:
    """The next experiment.

    Attributes:
        trial: how it was found.
        generic: a random-phase multisine that uses the same limits to the full; None when none keeps them.
        notes: what else to know.
    """

    trial: Trial
    generic: Candidate | None
    notes: tuple[str, ...]

    @property
    def problem(self) -> Problem:
        """What was sought."""
        return self.trial.problem

    @property
    def before(self) -> Array:
        """Standard errors so far, in SI, shape ``(n_free,)``; infinite where nothing is known."""
        return np.asarray(self.problem.before() * self.problem.size)

    def after(self, candidate: Candidate) -> Array:
        """Errors expected with the recording of ``candidate`` added, in SI, shape ``(n_free,)``."""
        return np.asarray(self.problem.together(candidate.worth).total_errors * self.problem.size)

    @property
    def parts(self) -> tuple[Choice, ...]:
        """The excitations proposed, in order."""
        return self.trial.best.parts

    def parameters_file(self, joint: str) -> str:
        """The ROS parameter file that makes the excitation node play it."""
        kinds = {part.kind.id: {name: float(value) for name, value in part.values.items()} for part in self.parts}
        settings: dict[str, Any] = {
            "joint": joint,
            "period": float(f"{self.problem.rig.period:.6g}"),
            "seed": SEED,
            "start_delay": DELAY,
            "pause": PAUSE,
            "output": self.parts[0].output,
            "kinds": list(kinds),
            **kinds,
        }
        head = f"# Proposed by fric identify --design. Ends after {self.trial.motion.time[-1]:.1f} s.\n"
        text = StringIO()
        YAML().dump({"/**": {"ros__parameters": settings}}, text)
        return head + text.getvalue()

    def summary(self) -> dict[str, Any]:
        """What ``design.json`` holds."""
        problem, trial = self.problem, self.trial
        model, limits = problem.model, problem.limits
        before, after = self.before, self.after(trial.best)
        generic = None if self.generic is None else self.after(self.generic)

        def number(value: float) -> float | None:
            return float(value) if math.isfinite(value) else None

        def worst(candidate: Candidate) -> float:
            errors = problem.together(candidate.worth).total_errors
            return float(np.max(errors if problem.reachable is None else errors[problem.reachable]))

        return {
            "format": "fric-design/1",
            "joint": model.joint,
            "limits": {
                "position": list(limits.position),
                "speed": limits.speed,
                "force": list(limits.force),
                "duration": limits.duration,
            },
            "excitation": [{"kind": part.kind.id, "settings": dict(part.values)} for part in self.parts],
            "output": self.parts[0].output,
            "controller": {k: float(v) for k, v in vars(problem.gains).items()},
            "worst_relative_error": {
                "before": number(float(np.max(problem.before()))),
                "after": worst(trial.best),
                "after_generic_multisine": None if self.generic is None else worst(self.generic),
                "over_parameter_uncertainty": trial.robust,
            },
            "parameters": {
                name: {
                    "value": float(model.values[problem.free.index[k]]),
                    "std_before": number(before[k]),
                    "std_after": number(after[k]),
                    "std_after_generic_multisine": None if generic is None else number(generic[k]),
                    "related_to": float(problem.size[k]),
                    "unit": model.unit(name),
                }
                for k, name in enumerate(problem.free.names)
            },
            "ranking": [
                {
                    "excitation": [{"kind": part.kind.id, "settings": dict(part.values)} for part in each.parts],
                    "worst_relative_error": worst(each),
                }
                for each in best_of_each(trial.ranking)[:20]
            ],
            "refused_for": dict(trial.refused),
            "simulations": trial.evaluated,
            "notes": list(self.notes),
        }


def _with_something_of_each(model: Model, free: FreeParameters, force: float) -> tuple[Model, list[str]]:
    """The model where terms of which a fit found next to nothing have something, so that their shape can be designed for."""
    values = model.values
    notes = []
    declared = list(model.parameters())
    for held in {name.split(".")[0] for name in free.only(False).names if "." in name}:
        own = [k for k in free.index.tolist() if declared[k].name.startswith(f"{held}.") and declared[k].declaration.linear]
        for k in own:
            if declared[k].declaration.dimension == "F" and abs(values[k]) < 0.05 * force:
                values[k] = _ASSUMED * force
                unit = declared[k].declaration.unit(model.units)
                notes.append(f"{declared[k].name} is nearly zero so far and assumed to be {values[k]:.3g} {unit} here")
    return model.with_values(values), notes


def problem_for(
    model: Model,
    first: Identification | None,
    records: Sequence[Record],
    options: Options,
    limits: Limits,
    rig: Rig,
    predicts: str,
) -> tuple[Problem, list[str]]:
    """What is sought after a first fit, or with a model's values alone, and what had to be assumed.

    Args:
        model: structure and values.
        first: the fit that they come from, or None.
        records: what it was fitted to; may be empty.
        options: of the fit to come.
        limits: of the recording to come.
        rig: its instruments.
        predicts: what the method of the fit predicts, a key of :data:`fric.identification.sensitivity.VIEWS`.
    """
    free = FreeParameters.of(model, options)
    levels = [abs(p.value) for p in model.parameters() if p.declaration.dimension == "F"]
    model, notes = _with_something_of_each(model, free, max(levels, default=0.1 * limits.push))
    typical = typical_sizes(model, free, limits.push, limits.speed, limits.way, rig.period)
    dimensions = [parameter.declaration.dimension for parameter in model.parameters()]
    kinds = np.array([dimensions[int(k)] for k in free.index])
    # A mass of nothing, which a fit finds where something else passes for it, can't be moved.
    weightless = (kinds == "F s^2/x") & (model.values[free.index] < _LEAST * typical)
    if np.any(weightless):
        changed = model.values
        changed[free.index[weightless]] = _LEAST * typical[weightless]
        model = model.with_values(changed)
    values = np.abs(model.values[free.index])
    size = np.array(
        [max(value, _FLOOR * float(np.max(values[kinds == kind]))) for value, kind in zip(values, kinds, strict=True)]
    )
    size = np.maximum(size, np.where(free.linear | (size == 0.0), _LEAST * typical, 0.0))
    errors = np.array([model.standard_errors.get(name, 0.0) for name in free.names])
    known, index = None, 0.0
    if records:
        view = VIEWS[predicts](model, list(records), options)
        covariance = first.covariance if first is not None and first.fitted == free.names else None
        known, index = of_recordings(view, model, free, size, covariance), view.index
        errors = np.where(errors > 0.0, errors, np.minimum(known.errors, 0.3) * size)
    gains = gains_for(model, rig.period)
    return Problem(model, free, errors, known, size, limits, rig, gains, options, predicts, index), notes


def propose(
    problem: Problem,
    kinds: Mapping[str, Excitation] = EXCITATIONS,
    n_each: int = 6,
    n_refining: int = 70,
    notes: Sequence[str] = (),
    progress: Callable[[str], None] = lambda text: None,
) -> Proposal:
    """The experiment that most reduces the worst relative error.

    Args:
        problem: see :func:`problem_for`.
        kinds: excitations to choose from.
        n_each: settings of each that are looked at first, per length.
        n_refining: evaluations that refine each of the best.
        notes: what had to be assumed.
        progress: is told what is going on.

    Raises:
        DesignError: no excitation keeps the limits.
    """
    trial = search(problem, list(kinds.values()), n_each, n_refining, progress)
    if trial is None:
        remedy = "widen them, or check that the model's values fit the machine"
        raise DesignError("--design", "no excitation within the limits makes any parameter show", remedy)
    remarks = list(notes)
    if trial.problem.reachable is not None:
        blind = [name for name, seen in zip(problem.free.names, trial.problem.reachable, strict=True) if not seen]
        if blind:
            remarks.append(f"no excitation within these limits shows {', '.join(blind)}: hold them, or widen the limits")
    return Proposal(trial, _generic(trial.problem), tuple(remarks))


def _generic(problem: Problem) -> Candidate | None:
    """The usual multisine within the limits: default settings, as large and as fast as allowed."""
    kind = EXCITATIONS[_GENERIC]
    values = {parameter.name: float(parameter.default or 0.0) for parameter in kind.parameters}
    size = 0.96
    for _ in range(12):
        way, speed = size * problem.limits.way, size * problem.limits.speed
        wanted = values | {"duration": problem.limits.duration - OVERHEAD, "amplitude": way, "speed": speed}
        choice = Choice.of(kind, wanted)
        motion = simulated(problem.model, (choice,), problem.rig, problem.limits, problem.gains)
        if not motion.trouble(problem.limits):
            worth = problem.worth(problem.model, motion)
            return None if worth is None else Candidate((choice,), worth, problem.cost(worth))
        size *= 0.85
    return None


def gains_text(gains: PidGains) -> str:
    """Gains as the parameters of the PID node."""
    named = {"kp": gains.proportional, "ki": gains.integral, "kd": gains.derivative, "filter_time": gains.filter_time}
    return ", ".join(f"{name}: {value:.4g}" for name, value in named.items())
