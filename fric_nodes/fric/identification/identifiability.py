"""What recordings can tell about a structure, found before its fit from the model's sensitivities, never from an effect's name.

At the values of inverse dynamics (a few steps further on where a method predicts positions), each parameter's sensitivity is a
column of J (:mod:`fric.identification.sensitivity`), and the noise is what the model misses there.

- *Unseen*: even if all others were known, the standard error would be half the value or more.
- *Coupled*: the recording determines only a combination. With columns scaled to unit length and J = U D V', the condition
  indices are D_max/D_k; for each above a limit the parameters whose variance comes mostly from it (proportions V_jk^2/D_k^2)
  belong together (Belsley, Kuh, Welsch 1980, section 3.2). Two columns with a correlation of 0.98 reach the limit.
- *Instrument*: an error of an instrument would go unnoticed into the parameters
  (:mod:`fric.identification.instrument_errors`).

For each, excitations of the catalogue are simulated within the travel, speed and force of the recordings
(:mod:`fric.identification.design`), and the one that would help most is named.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..effect import Effect
from ..excitation import EXCITATIONS
from ..model import Model
from ..record import Array, Record
from .conclusion import Fitted, standard_errors
from .design.limits import DesignError, limits_of, rig_of
from .design.proposal import problem_for
from .design.search import Candidate, Problem, explored
from .equations import Equations
from .foreseen import Finding, Foreseen
from .gauss_newton import minimise
from .instrument_errors import instrument_errors
from .methods import inverse_dynamics
from .result import IdentificationError, Options
from .sensitivity import VIEWS, sensitivities

__all__ = ["Finding", "Foreseen", "foresee"]

_UNSEEN = 0.5  # relative standard error with all others known
_INDEX = math.sqrt(1.98 / 0.02)  # condition index of two columns with a correlation of 0.98
_SHARE = 0.5  # of a parameter's variance
_COSTS = 0.02  # relative standard error below which a coupling does no harm
_COARSE = 2e-3  # [s]
_DIFFERENCE = 1e-3  # relative step of derivatives
_NEARER = 8  # steps towards the method's own values


def foresee(structure: Model, records: Sequence[Record], options: Options, predicts: str, experiments: bool = True) -> Foreseen:
    """What ``records`` can tell about ``structure``.

    Args:
        structure: its values are the start.
        records: to be fitted.
        options: of the fit.
        predicts: what the method predicts, a key of :data:`fric.identification.sensitivity.VIEWS`.
        experiments: look for excitations that would help, which takes a few seconds where something is found.

    Raises:
        InputError: nothing can be said, since nothing can be fitted.
    """
    begun = inverse_dynamics.fit_force(structure, records, options)
    fastest = float(np.max(np.abs(begun.found.velocity)))
    try:
        limits = limits_of(records, max(1.1 * fastest, begun.found.rest_velocity))
    except DesignError as error:
        raise IdentificationError(records[0].source, "the joint hardly moves", "record motion to both sides") from error
    rig = rig_of(records)
    # Filter and rows as the fit has chosen them: they needn't be chosen anew for every view of the same recordings.
    chosen = replace(options, cutoff=begun.found.cutoff, decimation=begun.found.decimation)
    reached = _nearer(begun, records, chosen, predicts)
    problem, _ = problem_for(reached, None, records, options, limits, rig, predicts)
    view = VIEWS[predicts](problem.model, list(records), chosen, problem.index)
    use = view.rows()
    columns = sensitivities(view, problem.model, problem.free, problem.size)[use]
    assert problem.known is not None
    alone, together = problem.known.alone, problem.before()
    motion = _motion(begun.found, problem.model.units.position)
    seen = alone < _UNSEEN
    groups, condition = _groups(columns[:, seen])
    found = [_Found("unseen", members, "") for members in _of_one_term(problem.free.names, np.flatnonzero(~seen).tolist())]
    number = np.flatnonzero(seen)
    for group, correlation in groups:
        members = tuple(int(number[k]) for k in group)
        if max(together[k] for k in members) > _COSTS:
            found.append(_Found("coupled", members, correlation))
    trials = []
    if experiments and found:
        # Coarser in time than a fast recording: what is sought is an order of magnitude.
        coarse = replace(problem, rig=replace(problem.rig, period=max(problem.rig.period, _COARSE)))
        trials = explored(coarse, list(EXCITATIONS.values()))
    findings = [_finding(each, problem, together, motion, trials) for each in found]
    findings += instrument_errors(problem, view, columns, use, records, chosen, predicts)
    free = problem.free
    return Foreseen(
        free.names,
        problem.model.values[free.index],
        np.asarray(alone * problem.size),
        np.asarray(together * problem.size),
        condition,
        motion,
        tuple(findings),
    )


def _nearer(begun: Fitted, records: Sequence[Record], options: Options, predicts: str) -> Model:
    """The model some way on towards what the method itself will find: the noise is judged by what it misses there."""
    if predicts == "force":
        return begun.model
    free = begun.free.without({k for k in begun.free.names if k not in standard_errors(begun.free, begun.covariance)})
    free = free.within_reach(begun.model, begun.found)
    values = begun.model.values
    scale = np.abs(values[free.index])
    scale[scale == 0.0] = 1.0
    lower, upper = free.lower / scale, free.upper / scale
    view = VIEWS[predicts](begun.model, list(records), options)

    def at(point: Array) -> Model:
        trial = values.copy()
        trial[free.index] = point * scale
        return begun.model.with_values(trial)

    start = np.clip(values[free.index] / scale, lower, upper)
    answer = minimise(lambda point: view.errors(at(point)), start, lower, upper, difference=_DIFFERENCE, max_iterations=_NEARER)
    return at(answer.point)


@dataclass(frozen=True)
class _Found:
    kind: str
    members: tuple[int, ...]
    remark: str


def _of_one_term(names: Sequence[str], members: Sequence[int]) -> list[tuple[int, ...]]:
    """``members`` by the term that they belong to."""
    terms: dict[str, list[int]] = {}
    for k in members:
        terms.setdefault(names[k].split(".")[0], []).append(k)
    return [tuple(each) for each in terms.values()]


def _groups(columns: Array) -> tuple[list[tuple[tuple[int, ...], str]], float]:
    """Columns that can't be told apart, each group with its correlation, and the largest condition index."""
    n = columns.shape[1]
    size = np.linalg.norm(columns, axis=0)
    if n < 2 or np.any(size == 0.0):
        return [], 1.0
    scaled = columns / size
    _, spread, turned = np.linalg.svd(scaled, full_matrices=False)
    spread = np.maximum(spread, 1e-12 * spread[0])
    index = spread[0] / spread
    variance = turned.T**2 / spread**2
    shares = variance / np.sum(variance, axis=1, keepdims=True)
    close = np.flatnonzero(index > _INDEX)
    groups: list[set[int]] = []
    for k in close.tolist():
        # Several near dependencies share the variance between them: what they have together counts.
        members = {j for j in range(n) if shares[j, k] > _SHARE}
        if len(members) < 2:
            members |= set(np.argsort(np.abs(turned[k]))[::-1][:2].tolist())
        touching = [group for group in groups if group & members]
        groups = [group for group in groups if not group & members] + [members.union(*touching)]
    correlation = scaled.T @ scaled
    found = []
    for group in groups:
        together = sorted(group)
        text = f"correlation {correlation[together[0], together[1]]:+.3f}" if len(together) == 2 else ""
        found.append((tuple(together), text))
    return found, float(index[-1])


def _percent(value: float) -> str:
    return f"{100.0 * value:.2g} %" if value < 0.995 else "all of the value" if value < 2.0 else "more than the value"


def _finding(found: _Found, problem: Problem, together: Array, motion: str, trials: Sequence[Candidate]) -> Finding:
    """The sentence for something unseen or coupled."""
    names = tuple(problem.free.names[k] for k in found.members)
    joined = ", ".join(names[:-1]) + f" and {names[-1]}" if len(names) > 1 else names[0]
    if found.kind == "unseen":
        effect = _effect(problem.model, names[0])
        where = f" (where it shows: {effect.regime})" if effect is not None and effect.regime else ""
        said = f"{joined} {'is' if len(names) == 1 else 'are'} hardly excited in these recordings{where}"
    else:
        errors = " and ".join(_percent(float(together[k])) for k in found.members)
        remark = f" ({found.remark})" if found.remark else ""
        said = f"{joined} can't be told apart{remark}: standard errors of {errors} are to be expected{_known(problem, names)}"
    helpful, experiment = _helpful(found.members, problem, together, trials)
    return Finding(found.kind, names, f"{said}. {motion}{helpful}", True, experiment)


def _effect(model: Model, name: str) -> Effect | None:
    for prefix, held in zip(model.prefixes, model.terms, strict=True):
        if name.startswith(f"{prefix}."):
            return held.effect
    return None


def _known(problem: Problem, names: Sequence[str]) -> str:
    """What the catalogue says on telling the effects behind ``names`` apart."""
    effects = [effect for name in names if (effect := _effect(problem.model, name)) is not None]
    for one in effects:
        for other in effects:
            if other.id in one.looks_like:
                return f"; to separate them, {one.looks_like[other.id]}"
    return ""


def _helpful(
    members: Sequence[int], problem: Problem, together: Array, trials: Sequence[Candidate]
) -> tuple[str, Mapping[str, Any] | None]:
    """What would help: the excitation after which the worst of ``members`` is known best."""

    def worst(candidate: Candidate) -> float:
        return float(np.max(problem.together(candidate.worth).total_errors[list(members)]))

    best = min(trials, key=worst, default=None)
    if best is None or worst(best) > min(0.7 * max(float(together[k]) for k in members), _UNSEEN):
        return "; no excitation within the travel, speed and force of these recordings would improve that", None
    part = best.parts[0]
    settings = ", ".join(f"{name} {value:.3g}" for name, value in part.values.items())
    text = (
        f"; {part.duration:.3g} s of {part.kind.title} ({part.kind.id}: {settings}) would reduce the error of "
        f"{'it' if len(members) == 1 else 'them'} to {_percent(worst(best))}"
    )
    return text, {"kind": part.kind.id, "settings": dict(part.values)}


def _motion(found: Equations, unit: str) -> str:
    """What the recordings hold, in one sentence without its full stop."""
    velocity = found.velocity[found.sliding]
    if velocity.size == 0:
        return "The joint hardly moves"
    low, high = np.quantile(np.abs(velocity), [0.05, 0.95])
    reversals = sum(
        int(np.sum(np.diff(np.sign(part[part != 0.0])) != 0)) for part in np.split(found.velocity, found.starts[1:])
    )
    ahead = float(np.mean(velocity > 0.0))
    one_way = ", nearly always in one direction" if not 0.05 < ahead < 0.95 else ""
    speeds = f"at {low:.2g} to {high:.2g} {unit}/s" if high > 1.5 * low else f"always at about {high:.2g} {unit}/s"
    return f"The joint moves {speeds}{one_way}, with {reversals} reversal{'' if reversals == 1 else 's'}"
