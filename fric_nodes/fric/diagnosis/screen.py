"""Which effect would explain what is missing: every candidate tried at first order, judged on blocks that it has not seen.

With r the force that the model lacks and J its derivative by the parameters that are fitted, a candidate's column c is what the
missing force changes by when the candidate is there. The refit and the candidate together are least squares on [J, c]. It is
solved once for each block of the recording with that block left out, and what it leaves of the block that it has not seen is
its score: the sum over blocks of the squares that remain. Only sums of products of columns are needed (a Gram matrix per
block), so that every candidate, and every pair of them, costs a few small systems of equations.

Grids of many values (the period of a ripple, the place of a bump, the age of a contact) are narrowed beforehand by columns that
need no observer: the force that the term adds along the measured motion (:mod:`fric.diagnosis.along`). Periods finer than
any grid are taken from the spectrum over position (:mod:`fric.diagnosis.fine`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..model import Model, Term
from ..record import Array, Index
from ..threads import mapped
from .along import Along
from .candidates import Candidate
from .costs import PER_PARAMETER, further_parameters
from .fine import fine_periods
from .least_squares import Fit
from .track import Track

__all__ = [
    "OWN",
    "SEEN",
    "SLOWLY",
    "Column",
    "Gram",
    "Promise",
    "Screening",
    "Tried",
    "blocks_of",
    "columns_of",
    "restraint",
    "screen",
]

_BLOCKS = 10
_KEPT = 2  # trials of a candidate that go from the quick columns to the observer's
_TINY = 1e-10
_VISIBLE = 1e-12  # of what is missing, the least that a trial changes
_PAIRS = 5
OWN = 0.02
"""Numerical, of a column's size: what all other parameters must leave of it, or else it is them by another name.

Friction that levels off with speed is Coulomb and viscous friction but for a tenth of its size, and is seen all the same.
"""
SEEN = 1.5
"""Numerical, times the observer's bandwidth: forces with a higher frequency hardly come through."""
SLOWLY = 0.25
"""Statistical: quantile of the speed that counts as slow motion, where a force over the position has its lowest frequencies."""
_AT_ONCE = 400  # sets of columns whose equations are solved together


@dataclass(frozen=True, eq=False)
class Column:
    """What a term changes in the missing force.

    Attributes:
        term: with the values at which it was tried.
        parts: one array per amplitude in which the force is linear, per unit of it; or one for the whole term, shape ``(n,)``
            each.
        amplitudes: names of those parameters; empty when the whole term is one column.
    """

    term: Term
    parts: tuple[Array, ...]
    amplitudes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Tried:
    """A candidate's best trial.

    Attributes:
        column: of the trial.
        left: sum of squares that remains on unseen blocks [F^2].
        gain: what the candidate takes off it, beside the refit alone [F^2].
        by_chance: the same on twins, where nothing is missing, the largest of them [F^2].
        coefficients: of the column's parts, from all blocks.
        moved: what the parameters of the refit change by meanwhile, in units of their scale.
    """

    column: Column
    left: float
    gain: float
    by_chance: float
    coefficients: Array
    moved: Array


class Gram:
    """Sums of products of columns over blocks of time.

    Args:
        columns: shape ``(n, n_columns)``.
        blocks: first row of each block, ascending, the first 0.
        held: for each column, by what square its coefficient is held back, ``(n_columns,)``; 0: not at all.
    """

    def __init__(self, columns: Array, blocks: Array, held: Array | None = None) -> None:
        self._held = np.zeros(columns.shape[1]) if held is None else held
        parts = np.split(columns, blocks[1:])
        self.of_block = np.array([part.T @ part for part in parts])
        self.total = np.sum(self.of_block, axis=0)

    def left(self, target: int, used: Sequence[int]) -> float:
        """Sum of squares of the column ``target`` that the columns ``used``, fitted without each block, leave in it."""
        return float(self.lefts(target, np.array([used], dtype=np.int64))[0])

    def lefts(self, target: int, used: Index) -> Array:
        """:meth:`left` of many sets of columns of one size, ``used`` of shape ``(n_sets, n_used)``; shape ``(n_sets,)``."""
        held = self.of_block[:, target, target]
        if used.shape[1] == 0:
            return np.full(used.shape[0], self.total[target, target])
        found = np.empty(used.shape[0])
        for first in range(0, used.shape[0], _AT_ONCE):
            index = used[first : first + _AT_ONCE]
            scale = np.sqrt(np.maximum((np.diag(self.total) + self._held)[index], 1e-300))
            # Sets, blocks, rows, columns.
            within = np.moveaxis(self.of_block[:, index[:, :, None], index[:, None, :]], 0, 1)
            with_target = np.moveaxis(self.of_block[:, index, target], 0, 1)
            normal = self.total[index[:, :, None], index[:, None, :]][:, None] - within
            normal /= (scale[:, :, None] * scale[:, None, :])[:, None]
            normal += ((_TINY + self._held[index] / scale**2)[:, :, None] * np.eye(index.shape[1]))[:, None]
            load = (self.total[index, target][:, None] - with_target) / scale[:, None]
            weight = -np.linalg.solve(normal, load[..., None])[..., 0] / scale[:, None]
            own = np.sum(weight * (2.0 * with_target + (within @ weight[..., None])[..., 0]), axis=(1, 2))
            found[first : first + _AT_ONCE] = np.sum(held) + own
        return found

    def solved(self, target: int, used: Sequence[int]) -> Array:
        """Coefficients of the columns ``used`` that leave the least of ``target`` over all blocks."""
        index = np.array(used, dtype=np.int64)
        scale = np.sqrt(np.maximum((np.diag(self.total) + self._held)[index], 1e-300))
        normal = self.total[np.ix_(index, index)] / np.outer(scale, scale) + np.diag(_TINY + self._held[index] / scale**2)
        return np.asarray(-np.linalg.solve(normal, self.total[index, target] / scale) / scale)


def blocks_of(track: Track, n: int) -> Array:
    """First rows of about ten blocks of equal length, shape ``(n_blocks,)``."""
    return np.unique(np.linspace(0, n, _BLOCKS + 1).astype(np.int64)[:-1])


def restraint(track: Track, fit: Fit) -> float:
    """By what square a coefficient of the fit's Jacobian is held back [F^2]: as if it were known beforehand to its own size.

    It changes nothing where the recording tells a parameter, and keeps one that a block alone tells from running away without
    that block, to where no first order holds.
    """
    return float(fit.residual @ fit.residual) / max(track.independent, 10.0)


class Promise:
    """Which trials of a candidate promise most, by the force that they add along the measured motion.

    Beside a transmission the motion of the load isn't known. There what the observer sees to be missing is held against the
    force that a trial would add to the model without the transmission: enough to tell one period or place from another.

    Args:
        along: the motion.
        fit: of the model that lacks something.
    """

    def __init__(self, along: Along, fit: Fit) -> None:
        self._along = along
        behind = not along.can(fit.model)
        self._model = _without_transmission(fit.model) if behind else fit.model
        self._able = along.can(self._model)
        # A low-passed force needs no more rows than these for its projections.
        self._rows = slice(None, None, along.stride)
        if self._able:
            self._base = along.residual(self._model)[self._rows]
        if behind:
            missing, columns = fit.residual[along.moving][self._rows], fit.jacobian[along.moving][self._rows]
        else:
            missing, columns = self._base, along.changes(fit.model, fit.names, fit.scale)[self._rows]
        self._basis, _ = np.linalg.qr(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300))
        self._missing = missing - self._basis @ (self._basis.T @ missing)
        self._periods: dict[tuple[bool, float], list[float]] = {}  # several effects ask for the same

    def narrowed(self, candidate: Candidate) -> list[Term]:
        """The trials of ``candidate`` that promise most."""
        effect = candidate.effect
        if effect.neutral is None or effect.command is not None:
            return list(candidate.trials)
        trials = [*candidate.trials, *self._fine(candidate)]
        if not self._able:
            return trials
        promise = [self._of(trial) for trial in trials]
        order = np.argsort(promise)[::-1][:_KEPT]
        return [trials[k] for k in order if promise[k] > 0.0]

    def _fine(self, candidate: Candidate) -> list[Term]:
        """Trials of periods finer than those of ``candidate``, where what is missing has such."""
        names = [p.name for p in candidate.effect.parameters]
        if "period" not in names or not self._missing.size:
            return []
        at = names.index("period")
        position, velocity = (self._along.seen(name)[self._rows] for name in ("position", "velocity"))
        travel, finest = float(np.ptp(position)), min(trial.values[at] for trial in candidate.trials)
        # Slowly moved over, it comes more slowly, and the observer sees it.
        seen = SEEN * self._along.bandwidth / (2.0 * np.pi * float(np.quantile(np.abs(velocity), SLOWLY)))
        directed, fewest = candidate.effect.level is not None, travel / finest
        if (directed, fewest) not in self._periods:
            missing = self._missing * np.sign(velocity) if directed else self._missing
            self._periods[directed, fewest] = fine_periods(position, missing, fewest, seen * travel)
        periods, given = self._periods[directed, fewest], candidate.trials[0].values
        return [Term(candidate.effect, (*given[:at], period, *given[at + 1 :])) for period in periods]

    def _of(self, trial: Term) -> float:
        """What the trial takes off the sum of squares along the motion [F^2]."""
        columns = np.stack([self._along.residual(self._model, part)[self._rows] - self._base for part in _parts(trial)], axis=1)
        whole = np.linalg.norm(columns, axis=0)
        columns = columns - self._basis @ (self._basis.T @ columns)
        size = np.linalg.norm(columns, axis=0)
        if not np.all(np.isfinite(size)) or np.max(size) <= OWN * np.max(whole):
            return 0.0  # the fit's own parameters do the same
        own, _ = np.linalg.qr(columns / np.maximum(size, 1e-300))
        return float(np.sum((own.T @ self._missing) ** 2))


def _without_transmission(model: Model) -> Model:
    return model.with_terms(held for held in model.terms if held.effect.play is None and held.effect.link is None)


def _parts(trial: Term) -> list[Term]:
    """One term per linear amplitude, the other amplitudes absent; or the trial itself."""
    linear = [k for k, p in enumerate(trial.effect.parameters) if p.name in trial.effect.amplitudes and _scales(p.name, trial)]
    neutral = trial.effect.neutral
    if not linear or neutral is None:
        return [trial]
    found = []
    for k in linear:
        values = list(trial.values)
        for other in linear:
            if other != k:
                values[other] = neutral[other]
        found.append(Term(trial.effect, tuple(values)))
    return found


def _scales(name: str, trial: Term) -> bool:
    """True when the force grows in proportion to the amplitude ``name``, at least while it is small."""
    parameter = next(p for p in trial.effect.parameters if p.name == name)
    return parameter.linear or parameter.dimension not in ("F", "s")


def columns_of(track: Track, fit: Fit, trials: Sequence[Term]) -> list[Column]:
    """The observer's columns of ``trials``, on all cores."""
    jobs = [(trial, part) for trial in trials for part in _parts(trial)]
    residuals = mapped(lambda job: track.residual(fit.model.with_terms((*fit.model.terms, job[1]))), jobs)
    found: dict[int, list[Array]] = {}
    for (trial, part), residual in zip(jobs, residuals, strict=True):
        change = residual - fit.residual
        names = _linear_names(trial)
        if names:
            which = next(name for name in names if _value(part, name) != 0.0)
            change = change / _value(part, which)
        found.setdefault(id(trial), []).append(change)
    return [Column(trial, tuple(found[id(trial)]), _linear_names(trial)) for trial in trials]


def _linear_names(trial: Term) -> tuple[str, ...]:
    if trial.effect.neutral is None:
        return ()
    return tuple(name for name in trial.effect.amplitudes if _scales(name, trial))


def _value(held: Term, name: str) -> float:
    return held.values[[p.name for p in held.effect.parameters].index(name)]


@dataclass(frozen=True, eq=False)
class Screening:
    """What the screening of all candidates found.

    Attributes:
        alone: sum of squares that the refit leaves on unseen blocks [F^2].
        tried: the best trial of each effect, the best effect first.
        laws: of effects with several laws, the best trial of each law but the one in ``tried``.
        pairs: the best pairs of different effects with what they leave together, the best first.
        unpaid: by which what effects with slip dynamics leave is multiplied, see :meth:`Track.unpaid`.
    """

    alone: float
    tried: tuple[Tried, ...]
    laws: tuple[Tried, ...]
    pairs: tuple[tuple[Tried, Tried, float], ...]
    unpaid: float = 1.0


def screen(
    track: Track, fit: Fit, found: Sequence[Candidate], twin_residuals: Sequence[Array], in_pairs: bool = True
) -> Screening:
    """Every candidate at first order, alone and, where that is wanted, in pairs, on blocks that it has not seen."""
    quick = Promise(Along(track), fit)
    trials = [trial for kept in mapped(quick.narrowed, found) for trial in kept]
    columns = columns_of(track, fit, trials)
    n_free = len(fit.names)
    stacked = [fit.residual[:, None], *(each[:, None] for each in twin_residuals), fit.jacobian]
    first = 1 + len(twin_residuals) + n_free
    places = []
    wholes: list[int] = []  # what is missing with the whole term there, where nothing makes the term weaker
    for column in columns:
        places.append(list(range(first, first + len(column.parts))))
        stacked += [part[:, None] for part in column.parts]
        first += len(column.parts)
        wholes.append(first if column.term.effect.neutral is None else 0)
        if column.term.effect.neutral is None:
            stacked.append((fit.residual + column.parts[0])[:, None])
            first += 1
    everything = np.concatenate(stacked, axis=1)
    held = np.zeros(everything.shape[1])
    held[1 + len(twin_residuals) : 1 + len(twin_residuals) + n_free] = restraint(track, fit)
    gram = Gram(everything, blocks_of(track, everything.shape[0]), held)
    refit = list(range(1 + len(twin_residuals), 1 + len(twin_residuals) + n_free))
    alone = gram.left(0, refit)
    chance_alone = [gram.left(1 + k, refit) for k in range(len(twin_residuals))]
    missing = max(alone - float(np.mean(chance_alone)), 0.0) if chance_alone else alone
    unpaid = track.unpaid(fit.model) if any(column.term.effect.slip is not None for column in columns) else 1.0
    able: list[tuple[Tried, list[int]]] = []
    promise: dict[int, float] = {}
    for column, place, whole in zip(columns, places, wholes, strict=True):
        # Of the trial, not of its unit, which may be millions of newtons per cubic metre.
        units = [_value(column.term, name) for name in column.amplitudes] or [1.0]
        if not all(gram.total[k, k] * unit**2 > _VISIBLE * gram.total[0, 0] for k, unit in zip(place, units, strict=True)):
            continue
        solved = gram.solved(0, refit + place)
        if not column.amplitudes and solved[n_free] <= 0.0:
            continue  # the opposite of the effect, which there isn't
        left = gram.left(0, refit + place) * (unpaid if column.term.effect.slip is not None else 1.0)
        by_chance = max((base - gram.left(1 + k, refit + place) for k, base in enumerate(chance_alone)), default=0.0)
        able.append((Tried(column, left, alone - left, by_chance, solved[n_free:], solved[:n_free]), place))
        # A structure can't be there by a part: its values are judged by what it leaves as it is.
        promise[id(column)] = gram.left(whole, refit) * unpaid if whole else left
        # In doubt it is the simpler law.
        promise[id(column)] += further_parameters(column.term.effect) * PER_PARAMETER * missing
    best: dict[str, Tried] = {}
    laws: dict[str, Tried] = {}
    for tried, _ in sorted(able, key=lambda each: promise[id(each[0].column)]):
        effect = tried.column.term.effect
        name = effect.id if effect.neutral is not None else effect.key
        if best.setdefault(name, tried).column.term.effect is not effect:
            laws.setdefault(effect.key, tried)
    ranked, others = (tuple(sorted(each.values(), key=lambda one: one.left)) for each in (best, laws))
    return Screening(alone, ranked, others, _pairs(gram, refit, able, unpaid) if in_pairs else (), unpaid)


def _pairs(
    gram: Gram, refit: list[int], able: Sequence[tuple[Tried, list[int]]], unpaid: float
) -> tuple[tuple[Tried, Tried, float], ...]:
    """The best pairs of trials of different effects, one pair for each two effects."""
    couples: dict[int, list[tuple[Tried, Tried]]] = {}  # by the number of their columns
    used: dict[int, list[list[int]]] = {}
    for k, (one, place) in enumerate(able):
        for other, beside in able[k + 1 :]:
            if one.column.term.effect.id != other.column.term.effect.id and not _exclude(one, other):
                couples.setdefault(len(place) + len(beside), []).append((one, other))
                used.setdefault(len(place) + len(beside), []).append(refit + place + beside)
    all_of_them: list[tuple[float, Tried, Tried, list[int]]] = []
    for size, held in couples.items():
        left = gram.lefts(0, np.array(used[size], dtype=np.int64))
        slips = [any(each.column.term.effect.slip is not None for each in couple) for couple in held]
        left = left * np.where(slips, unpaid, 1.0)
        all_of_them += [(float(each), *couple, index) for each, couple, index in zip(left, held, used[size], strict=True)]
    best: dict[tuple[str, str], tuple[Tried, Tried, float]] = {}
    n_free = len(refit)
    for left_there, one, other, index in sorted(all_of_them, key=lambda each: each[0]):
        names = (one.column.term.effect.id, other.column.term.effect.id)
        if names in best:
            continue
        solved = gram.solved(0, index)
        cut = n_free + len(one.column.parts)
        first = replace(one, coefficients=solved[n_free:cut], moved=solved[:n_free])
        second = replace(other, coefficients=solved[cut:], moved=solved[:n_free])
        # A whole term that would have to be subtracted is the opposite of an effect, which there isn't.
        if all(each.column.amplitudes or each.coefficients[0] > 0.0 for each in (first, second)):
            best[names] = (first, second, left_there)
            if len(best) == _PAIRS:
                break
    return tuple(best.values())


def _exclude(one: Tried, other: Tried) -> bool:
    """True when both can't be in one model."""
    first, second = one.column.term.effect, other.column.term.effect
    return first.slip is not None and second.slip is not None
