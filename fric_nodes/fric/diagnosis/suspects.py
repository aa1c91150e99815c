"""Which component of a machine changed: first-order columns of all that could have, on what was recorded since the change.

Until the change the model explained the machine, so what it lacks since then is the change itself. Each term of the model with
other values, and each effect that the model doesn't have, is a suspect; what its column leaves of the missing force on blocks
that its size was not fitted to is its score (:mod:`fric.diagnosis.screen`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..identification.gauss_newton import Solution
from ..model import Model, Term
from ..record import Array, Record
from ..threads import mapped
from .along import Along
from .candidates import candidates, place_of, scales_of
from .confidence import MOST_SURE
from .fitting import bounds_of, free_names, with_amplitudes
from .least_squares import Fit
from .locate import locate, moved_back, steady
from .screen import Gram, Promise, blocks_of, columns_of
from .track import Track

__all__ = ["Suspects", "prepare_suspects", "suspects"]

_STEP = 0.02  # of a parameter's value, or of what would matter, for its column
_OFFSET, _BY_RIVAL, _BY_REST = 0.5, 2.2, -3.0  # as for findings of a diagnosis
_REFINED, _REFINING, _NEAR = 5, 10, 4.0  # suspects, iterations, and times what the best leaves
_HARDLY = 0.6  # of the missing energy: when the best suspect leaves more, it is no explanation
_PER_COLUMN = 0.01  # of the missing energy, the price of a suspect's column
_PER_SHAPE = 0.015  # and of each value of it that was chosen from a grid
_SLOW_EFFECTS = frozenset({"time_drift", "temperature"})  # within seconds nothing is told of what takes minutes


@dataclass(frozen=True)
class Suspects:
    """What a change most likely is.

    Attributes:
        effect: that explains it best, or the plant's parameter; ``unknown`` when none does.
        known: True when the model has the effect, with other values.
        component: where it sits.
        runner_up: the next best effect.
        confidence: probability of the effect, 0 to 1.
        component_confidence: probability of the component, 0 to 1.
        share: of the missing energy that the effect explains, 0 to 1.
        regime: where it shows, in words.
        strength: root mean square of the missing force [F].
        duration: of what was looked at [s].
    """

    effect: str
    known: bool
    component: str
    runner_up: str
    confidence: float
    component_confidence: float
    share: float
    regime: str
    strength: float
    duration: float


@dataclass(frozen=True, eq=False)
class _Suspect:
    """An effect, whether the model has it, its component, its columns, and the amplitudes that they are per unit of, if any.

    It is a term that would come, or parameters of the model, by their names, with other values.
    """

    effect: str
    known: bool
    component: str
    columns: tuple[Array, ...]
    amplitudes: tuple[str, ...] | None
    n_shapes: int = 0
    left: float = math.inf
    term: Term | None = None
    names: tuple[str, ...] = ()


def prepare_suspects(model: Model) -> None:
    """Compile what :func:`suspects` needs, so that it answers at once."""
    time = 0.001 * np.arange(400, dtype=np.float64)
    position = 1e-3 * np.sin(20.0 * time)
    suspects(model, Record(time, position, np.sin(20.0 * time), effort_hold="preceding"), 140.0, 0.0)


def suspects(model: Model, record: Record, bandwidth: float, floor: float) -> Suspects:
    """What changed in a machine that was ``model`` before.

    Args:
        model: that explained the machine until the change.
        record: what was recorded since shortly before the change.
        bandwidth: of the observer [rad/s].
        floor: root mean square of what ``model`` lacked before the change [F].
    """
    track = Track.of([record], bandwidth, model)
    missing = track.residual(model)
    n = missing.shape[0]
    fit = Fit(model, (), Solution(np.zeros(0), missing, np.zeros((n, 0)), True, 0, np.zeros(0, dtype=np.bool_)), np.zeros(0))
    scales = scales_of(track)
    found = _present(track, model, missing)
    offered = [candidate for candidate in candidates(model, scales) if candidate.effect.id not in _SLOW_EFFECTS]
    promise = Promise(Along(track), fit)
    trials = [term for candidate in offered for term in promise.narrowed(candidate)]
    for column in columns_of(track, fit, trials):
        effect = column.term.effect
        n_shapes = len(effect.parameters) - len(column.amplitudes)
        amplitudes = column.amplitudes or None
        found.append(_Suspect(effect.id, False, place_of(effect), column.parts, amplitudes, n_shapes, term=column.term))
    energy = float(missing @ missing)
    ranked = _refined(track, model, _ranked(track, missing, found, 0.9 * energy))
    base = min(floor**2 * n, 0.9 * energy)
    parts = [moved_back(part, record.sample_time, bandwidth) for part in track.padded(missing)]
    where = locate(track, [steady(part**2, record.sample_time) for part in parts], scales, model)
    return _verdict(ranked, energy, base, where.regime, math.sqrt(energy / n), record.duration)


def _present(track: Track, model: Model, missing: Array) -> list[_Suspect]:
    """Each term that the model has, with other values, and the plant's own parameters."""
    groups: dict[str, tuple[str, str, list[str]]] = {}
    places = {prefix: held.effect for prefix, held in zip(model.prefixes, model.terms, strict=True)}
    for parameter in model.parameters():
        prefix, dot, _ = parameter.name.partition(".")
        if parameter.declaration.shape:
            continue
        effect = places[prefix] if dot else None
        key = prefix if effect is not None else parameter.name
        entry = (effect.id, place_of(effect)) if effect is not None else (parameter.name, "load")
        groups.setdefault(key, (*entry, []))[2].append(parameter.name)
    names = [name for group in groups.values() for name in group[2]]
    steps, trials = [], []
    for name in names:
        at = model.names.index(name)
        parameter = next(p for p in model.parameters() if p.name == name)
        values = model.values
        step = _STEP * max(abs(float(values[at])), track.sizes.get(parameter.declaration.dimension, 0.0), 1e-12)
        values[at] += step if values[at] + step <= parameter.declaration.upper else -step
        steps.append(float(values[at] - model.values[at]))
        trials.append(model.with_values(values))
    residuals = mapped(track.residual, trials)
    columns = {name: (residual - missing) / step for name, residual, step in zip(names, residuals, steps, strict=True)}
    return [
        _Suspect(effect, True, component, tuple(columns[name] for name in members), (), names=tuple(members))
        for effect, component, members in groups.values()
    ]


def _ranked(track: Track, missing: Array, found: list[_Suspect], most: float) -> list[_Suspect]:
    """The best of each effect in each of its forms, with what it leaves on unseen blocks; the best first."""
    columns = np.column_stack([missing, *(part for suspect in found for part in suspect.columns)])
    usable = np.all(np.isfinite(columns), axis=0)
    columns[:, ~usable] = 0.0
    size = np.sqrt(np.sum(columns**2, axis=0))
    columns[:, 1:] /= np.maximum(size[1:], 1e-300)
    gram = Gram(columns, blocks_of(track, columns.shape[0]))
    energy = float(missing @ missing)
    best: dict[tuple[str, str, str], _Suspect] = {}
    at = 1
    for suspect in found:
        used = [k for k in range(at, at + len(suspect.columns)) if size[k] > 1e-6 * size[0]]
        at += len(suspect.columns)
        if not used or (suspect.amplitudes is None and gram.solved(0, used)[0] <= 0.0):
            continue
        left = gram.left(0, used) + energy * (_PER_COLUMN * len(used) + _PER_SHAPE * suspect.n_shapes)
        key = (suspect.effect, suspect.component, "" if suspect.term is None else suspect.term.effect.law)
        if left < most and (key not in best or left < best[key].left):
            best[key] = replace(suspect, left=left)
    return sorted(best.values(), key=lambda each: each.left)


def _refined(track: Track, model: Model, ranked: list[_Suspect]) -> list[_Suspect]:
    """The foremost suspects with values fitted instead of tried, until the best is one of them; the best first.

    What first order promises and no fit keeps explains nothing.
    """
    missing = track.residual(model)
    energy = float(missing @ missing)
    fitted: list[_Suspect] = []
    waiting = list(ranked)
    while waiting and len(fitted) < _REFINED:
        best = min((each.left for each in fitted), default=math.inf)
        if waiting[0].left >= max(best, _NEAR * ranked[0].left):
            break
        each = waiting.pop(0)
        grown = model if each.term is None else model.with_terms((*model.terms, _sized(each, each.term, missing)))
        names = each.names or [name for name in free_names(grown) if name not in model.names]
        fit = track.fit(grown, names, _REFINING, bounds_of(grown, scales_of(track)))
        left = float(fit.residual @ fit.residual) + energy * (_PER_COLUMN * len(each.columns) + _PER_SHAPE * each.n_shapes)
        fitted.append(replace(each, left=left))
    return sorted([*fitted, *waiting], key=lambda each: each.left)


def _sized(suspect: _Suspect, held: Term, missing: Array) -> Term:
    """The suspect's term with the amplitudes that first order asks for: few iterations don't come from a trial's to them."""
    if not suspect.amplitudes or not all(np.all(np.isfinite(part)) for part in suspect.columns):
        return held
    sizes, *_ = np.linalg.lstsq(np.column_stack(suspect.columns), -missing, rcond=1e-9)
    return with_amplitudes(held, suspect.amplitudes, sizes.tolist())


def _verdict(ranked: list[_Suspect], energy: float, base: float, regime: str, strength: float, duration: float) -> Suspects:
    if not ranked or ranked[0].left - base > _HARDLY * (energy - base):
        beside = ranked[0].effect if ranked else ""
        component = ranked[0].component if ranked else ""
        return Suspects("unknown", False, component, beside, 0.5, 0.3, 0.0, regime, strength, duration)
    best = ranked[0]
    rest = max(best.left - base, 0.0) / max(energy - base, 1e-300)
    rival = next((each for each in ranked if each.effect != best.effect), None)
    other = next((each for each in ranked if each.component != best.component), None)

    def probability(of: _Suspect | None) -> float:
        slack = 0.15 * base + _PER_COLUMN * energy
        left = energy if of is None else of.left
        margin = math.log((max(left - base, 0.0) + slack) / (max(best.left - base, 0.0) + slack))
        return round(min(1.0 / (1.0 + math.exp(-(_OFFSET + _BY_RIVAL * margin + _BY_REST * rest))), MOST_SURE), 3)

    return Suspects(
        best.effect, best.known, best.component, "" if rival is None else rival.effect,
        probability(rival), probability(other), min(1.0 - rest, 1.0), regime, strength, duration,
    )  # fmt: skip
