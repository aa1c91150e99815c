"""What recordings can tell about a structure, found before its fit from the model's sensitivities, never from an effect's name.

At the values of inverse dynamics (a few steps further on where a method predicts positions), each parameter's sensitivity is a
column of J (:mod:`fric_nodes.identification.sensitivity`), and the noise is what the model misses there.

- *Unseen*: even if all others were known, the standard error would be half the value or more.
- *Coupled*: the recording knows a combination only. With columns scaled to unit length and J = U D V', the condition indices
  are D_max/D_k; for each above a limit the parameters whose variance comes mostly from it (proportions V_jk^2/D_k^2) belong
  together (Belsley, Kuh, Welsch 1980, section 3.2). Two columns with a correlation of 0.98 reach the limit.
- *Instrument*: the errors that an instrument can have (a wrong scale of the force, a delay or an offset between force and
  position) are columns too, got by disturbing the recording. Where the parameters' columns span one of them, it goes unnoticed
  into the parameters, and how far is the solution of that least-squares problem.

For each, excitations of the catalogue are simulated within the travel, speed and force of the recordings
(:mod:`fric_nodes.identification.design`), and the one that would help most is named.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.signal import savgol_filter

from ..effect import Effect
from ..excitation import EXCITATIONS
from ..model import Model
from ..record import Array, Mask, Record
from . import inverse_dynamics
from .conclusion import Fitted, standard_errors
from .design.limits import DesignError, limits_of, rig_of
from .design.proposal import problem_for
from .design.search import Candidate, Problem, explored
from .equations import Equations
from .gauss_newton import minimise
from .result import IdentificationError, Options
from .sensitivity import VIEWS, View, sensitivities

__all__ = ["Finding", "Foreseen", "foresee"]

_UNSEEN = 0.5  # relative standard error with all others known
_INDEX = math.sqrt(1.98 / 0.02)  # condition index of two columns with a correlation of 0.98
_SHARE = 0.5  # of a parameter's variance
_COSTS = 0.02  # relative standard error below which a coupling does no harm
_SPANNED = 0.96  # R^2 from which on an instrument's error goes unnoticed: a correlation of 0.98
_ITSELF = 0.995  # correlation of a column with an instrument's error from which on the parameter is that error
_COARSE = 2e-3  # [s]
_DIFFERENCE = 1e-3  # relative step of derivatives
_NEARER = 8  # steps towards the method's own values
_SMOOTH = 0.03  # [s] over which the noise of a force is taken out before its derivative
_DISTINCT = 3e-3  # singular values below, relative to the largest, tell nothing
_HARMLESS = 0.002  # relative change of a parameter


@dataclass(frozen=True)
class Finding:
    """One thing that recordings can't tell.

    Attributes:
        kind: ``unseen``, ``coupled`` or ``instrument``.
        parameters: whom it concerns.
        message: what, why, and what to record instead.
        serious: False for what every recording of this kind leaves open.
        experiment: excitation that would help, ``kind`` and ``settings``; None where none was found.
    """

    kind: str
    parameters: tuple[str, ...]
    message: str
    serious: bool = True
    experiment: Mapping[str, Any] | None = None


@dataclass(frozen=True, eq=False)
class Foreseen:
    """What recordings can tell about a structure; arrays of shape ``(n_parameters,)``.

    Attributes:
        names: of the parameters.
        values: at which the sensitivities were taken.
        alone: standard error expected if all others were known, in SI.
        together: standard error expected, in SI; infinite where nothing is known.
        condition: largest condition index.
        motion: what the recordings hold, one sentence.
        findings: in the order of their weight.
    """

    names: tuple[str, ...]
    values: Array
    alone: Array
    together: Array
    condition: float
    motion: str
    findings: tuple[Finding, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know before a fit."""
        return tuple(finding.message for finding in self.findings if finding.serious)

    def summary(self) -> dict[str, Any]:
        """As JSON."""

        def number(value: float) -> float | None:
            return float(value) if math.isfinite(value) else None

        return {
            "condition": number(self.condition),
            "motion": self.motion,
            "parameters": {
                name: {
                    "at": float(self.values[k]),
                    "std_alone": number(float(self.alone[k])),
                    "std_expected": number(float(self.together[k])),
                }
                for k, name in enumerate(self.names)
            },
            "findings": [
                {
                    "kind": finding.kind,
                    "parameters": list(finding.parameters),
                    "message": finding.message,
                    "serious": finding.serious,
                    "experiment": finding.experiment,
                }
                for finding in self.findings
            ],
        }


def foresee(
    structure: Model,
    records: Sequence[Record],
    options: Options,
    predicts: str,
    experiments: bool = True,
) -> Foreseen:
    """What ``records`` can tell about ``structure``.

    Args:
        structure: its values are the start.
        records: to be fitted.
        options: of the fit.
        predicts: what the method predicts, a key of :data:`fric_nodes.identification.sensitivity.VIEWS`.
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
    reached = _nearer(begun, records, options, predicts)
    problem, _ = problem_for(reached, None, records, options, limits, rig, predicts)
    view = VIEWS[predicts](problem.model, list(records), options, problem.index)
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
    findings += _instrument(problem, view, columns, use, records, options, predicts)
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
        where = f" (where to see it: {effect.regime})" if effect is not None and effect.regime else ""
        said = f"{joined} hardly show{'s' if len(names) == 1 else ''} in what was recorded{where}"
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
        return "; no excitation within the travel, speed and force of these recordings would change that", None
    part = best.parts[0]
    settings = ", ".join(f"{name} {value:.3g}" for name, value in part.values.items())
    text = (
        f"; {part.duration:.3g} s of {part.kind.title} ({part.kind.id}: {settings}) would bring "
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


@dataclass(frozen=True)
class _Fault:
    """An error that an instrument may have.

    Attributes:
        title: in a sentence.
        unit: how much of it is spoken of, in a sentence.
        amount: the same, as the argument of ``disturb``.
        disturb: a recording with so much of it.
        remedy: what would show it.
        serious: False for what no recording shows, which is worth a note.
    """

    title: str
    unit: str
    amount: float
    disturb: Callable[[Record, float], Record]
    remedy: str
    serious: bool = True


def _delayed(record: Record, amount: float) -> Record:
    """``record`` with its effort later by ``amount`` [s], but for its noise, which a derivative would only make louder."""
    width = max(round(_SMOOTH / record.sample_time) // 2 * 2 + 1, 5)
    if width > record.n_samples:
        return record
    smooth = savgol_filter(record.effort, width, 2)
    return replace(record, effort=record.effort + np.interp(record.time - amount, record.time, smooth) - smooth)


def _faults(records: Sequence[Record]) -> list[_Fault]:
    units = records[0].units
    largest = max(float(np.max(np.abs(record.effort))) for record in records)
    step = records[0].sample_time
    return [
        _Fault(
            "the scale of the force (a motor constant, a gain)",
            "1 %",
            0.01,
            lambda record, amount: replace(record, effort=record.effort * (1.0 + amount)),
            "weigh the moving part and hold its mass (--hold mass), or hang a known weight on it",
            # It goes into everything in every recording; where the force has no unit of force, it is known to be there.
            serious=units.force not in ("N", "N m"),
        ),
        _Fault(
            "a delay between force and position",
            f"{1e3 * step:.3g} ms",
            step,
            _delayed,
            "record quick motion at several frequencies: only a delay turns the phase in proportion to the frequency",
        ),
        _Fault(
            "an offset of the force",
            f"{0.01 * largest:.2g} {units.force}",
            0.01 * largest,
            lambda record, amount: replace(record, effort=record.effort + amount),
            "record motion in both directions, and the force at rest with the drive off",
        ),
    ]


def _column(
    fault: _Fault, problem: Problem, records: Sequence[Record], options: Options, predicts: str, n_rows: int
) -> Array | None:
    """What the fault changes in the errors, per its amount, shape ``(n_rows,)``; None when it changes which rows there are."""
    part = 0.1
    sides = []
    for sign in (part, -part):
        disturbed = [fault.disturb(record, sign * fault.amount) for record in records]
        sides.append(VIEWS[predicts](problem.model, disturbed, options, problem.index).errors(problem.model))
        if sides[-1].shape[0] != n_rows:
            return None
    return np.asarray((sides[0] - sides[1]) / (2.0 * part))


def _is_itself(
    alike: float, k: int, fault: _Fault, problem: Problem, records: Sequence[Record], options: Options, predicts: str
) -> bool:
    """True when parameter ``k`` is this very fault: when it looks like it in the mirrored motion as well."""
    mirrored = [replace(record, position=-record.position, effort=-record.effort, reference=None) for record in records]
    view = VIEWS[predicts](problem.model, mirrored, options, problem.index)
    changed = _column(fault, problem, mirrored, options, predicts, view.rows().shape[0])
    if changed is None:
        return False
    use = view.rows()
    own = sensitivities(view, problem.model, problem.free, problem.size)[use, k]
    across = float(own @ changed[use])
    return across * math.copysign(1.0, alike) > _ITSELF * float(np.linalg.norm(own) * np.linalg.norm(changed[use]))


def _instrument(
    problem: Problem, view: View, columns: Array, use: Mask, records: Sequence[Record], options: Options, predicts: str
) -> list[Finding]:
    """Errors of the instruments that the parameters would take up unnoticed."""
    found = []
    size = np.linalg.norm(columns, axis=0)
    shown = np.flatnonzero(size > 1e-9 * np.max(size, initial=0.0))
    scaled = columns[:, shown] / size[shown]
    names = [problem.free.names[k] for k in shown.tolist()]
    for fault in _faults(records):
        column = _column(fault, problem, records, options, predicts, use.shape[0])
        if column is None or not np.any(column[use]):
            continue
        column = column[use]
        alike = scaled.T @ column / float(np.linalg.norm(column))
        k = int(np.argmax(np.abs(alike)))
        if abs(alike[k]) > _ITSELF and _is_itself(float(alike[k]), int(shown[k]), fault, problem, records, options, predicts):
            continue
        # In units of the parameters' sizes: of all changes that do, the smallest.
        change = np.linalg.lstsq(columns[:, shown], column, rcond=_DISTINCT)[0]
        left = column - columns[:, shown] @ change
        most = float(np.max(np.abs(change)))
        if float(left @ left) > (1.0 - _SPANNED) * float(column @ column) or most < _HARMLESS:
            continue
        moved = [k for k in np.argsort(np.abs(change))[::-1].tolist() if abs(change[k]) > 0.3 * most]
        changes = ", ".join(f"{names[k]} by {100.0 * change[k]:+.2g} %" for k in moved)
        message = f"{fault.title} can't be seen here: {fault.unit} of it would change {changes}. To see it, {fault.remedy}"
        found.append(Finding("instrument", tuple(names[k] for k in moved), message, fault.serious))
    return found
