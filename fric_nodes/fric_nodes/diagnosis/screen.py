"""Which effect would explain what is missing: every candidate tried at first order, judged on blocks that it has not seen.

With r the force that the model lacks and J its derivative by the parameters that are fitted, a candidate's column c is what the
missing force changes by when the candidate is there. The refit and the candidate together are least squares on [J, c]. It is
solved once for each block of the recording with that block left out, and what it leaves of the block that it has not seen is
its score: the sum over blocks of the squares that remain. Only sums of products of columns are needed (a Gram matrix per
block), so that every candidate, and every pair of them, costs a few small systems of equations.

Grids of many values (the period of a ripple, the place of a bump, the age of a contact) are narrowed beforehand by columns that
need no observer: the force that the term adds along the measured motion, through the observer's own filter.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ..model import Model, Term
from ..record import Array
from .candidates import Candidate
from .track import Fit, Track
from .twin import smooth
from .universe import universe_of

__all__ = ["Column", "Gram", "Screening", "Tried", "blocks_of", "columns_of", "motions", "narrowed", "screen"]

_BLOCKS = 10
_KEPT = 2  # trials of a candidate that go from the quick columns to the observer's
_TINY = 1e-10
_PAIRS = 5


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
    """

    def __init__(self, columns: Array, blocks: Array) -> None:
        parts = np.split(columns, blocks[1:])
        self.of_block = np.array([part.T @ part for part in parts])
        self.total = np.sum(self.of_block, axis=0)

    def left(self, target: int, used: Sequence[int]) -> float:
        """Sum of squares of the column ``target`` that the columns ``used``, fitted without each block, leave in it."""
        index = np.array(used, dtype=np.int64)
        if index.size == 0:
            return float(self.total[target, target])
        scale = np.sqrt(np.maximum(np.diag(self.total)[index], 1e-300))
        inside = self.total[np.ix_(index, index)] - self.of_block[:, index[:, None], index[None, :]]
        load = self.total[index, target] - self.of_block[:, index, target]
        normal = inside / np.outer(scale, scale) + _TINY * np.eye(index.size)
        weight = -np.linalg.solve(normal, (load / scale)[..., None])[..., 0] / scale
        held = self.of_block
        linear = np.einsum("bi,bi->b", weight, held[:, index, target])
        square = np.einsum("bi,bij,bj->b", weight, held[:, index[:, None], index[None, :]], weight)
        return float(np.sum(held[:, target, target] + 2.0 * linear + square))

    def solved(self, target: int, used: Sequence[int]) -> Array:
        """Coefficients of the columns ``used`` that leave the least of ``target`` over all blocks."""
        index = np.array(used, dtype=np.int64)
        scale = np.sqrt(np.maximum(np.diag(self.total)[index], 1e-300))
        normal = self.total[np.ix_(index, index)] / np.outer(scale, scale) + _TINY * np.eye(index.size)
        return np.asarray(-np.linalg.solve(normal, self.total[index, target] / scale) / scale)


def blocks_of(track: Track, n: int) -> Array:
    """First rows of about ten blocks of equal length, shape ``(n_blocks,)``."""
    return np.unique(np.linspace(0, n, _BLOCKS + 1).astype(np.int64)[:-1])


@dataclass(frozen=True, eq=False)
class Motion:
    """The measured motion of one run, smoothed: position [x], velocity [x/s] and acceleration [x/s^2], and its step [s]."""

    position: Array
    velocity: Array
    acceleration: Array
    step: float


def motions(track: Track) -> list[Motion]:
    """The smoothed motion of each run, once for all candidates: filtering it costs more than to predict a force along it."""
    found = []
    for run in track.runs:
        step = float(np.median(run.step))
        position = smooth(run.position, step, 4.0 * track.bandwidth)
        velocity = np.gradient(position, step)
        found.append(Motion(position, velocity, np.gradient(velocity, step), step))
    return found


def narrowed(track: Track, fit: Fit, candidate: Candidate, motion: Sequence[Motion]) -> list[Term]:
    """The trials of ``candidate`` that promise most by the force they add along the measured ``motion``."""
    effect = candidate.effect
    if len(candidate.trials) <= _KEPT or effect.neutral is None or effect.command is not None:
        return list(candidate.trials)
    base = _along(track, fit.model, None, motion)
    basis, _ = np.linalg.qr(fit.jacobian / np.maximum(np.linalg.norm(fit.jacobian, axis=0), 1e-300))
    missing = fit.residual - basis @ (basis.T @ fit.residual)
    promise = []
    for trial in candidate.trials:
        columns = np.array(
            [
                track.seen([a - b for a, b in zip(_along(track, fit.model, part, motion), base, strict=True)])
                for part in _parts(trial)
            ]
        ).T
        columns = columns - basis @ (basis.T @ columns)
        size = np.linalg.norm(columns, axis=0)
        if not np.all(np.isfinite(size)) or np.max(size) == 0.0:
            promise.append(0.0)
            continue
        own, _ = np.linalg.qr(columns / np.maximum(size, 1e-300))
        promise.append(float(np.sum((own.T @ missing) ** 2)))
    order = np.argsort(promise)[::-1][:_KEPT]
    return [candidate.trials[k] for k in order if promise[k] > 0.0]


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


def _along(track: Track, model: Model, extra: Term | None, motion: Sequence[Motion]) -> list[Array]:
    """The force that ``model``, with ``extra``, needs along the measured motion [F], per run."""
    universe = universe_of(model)
    values = universe.values(model)
    if extra is not None:
        universe.put(values, extra)
    found = []
    for run, time, each in zip(track.runs, track.time, motion, strict=True):
        effort, friction = np.empty_like(time), np.empty_like(time)
        universe.loops.predict(
            values, time, each.position, each.velocity, each.acceleration, each.step, run.load, run.temperature,
            *universe.inner_states(model), effort, friction,
        )  # fmt: skip
        found.append(effort)
    return found


def columns_of(track: Track, fit: Fit, trials: Sequence[Term]) -> list[Column]:
    """The observer's columns of ``trials``, on all cores."""
    jobs = [(trial, part) for trial in trials for part in _parts(trial)]
    with ThreadPoolExecutor(2) as pool:
        residuals = list(pool.map(lambda job: track.residual(fit.model.with_terms((*fit.model.terms, job[1]))), jobs))
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
        pairs: the best pairs of different effects with what they leave together, the best first.
    """

    alone: float
    tried: tuple[Tried, ...]
    pairs: tuple[tuple[Tried, Tried, float], ...]


def screen(track: Track, fit: Fit, found: Sequence[Candidate], twin_residuals: Sequence[Array]) -> Screening:
    """Every candidate at first order, alone and in pairs, on blocks that it has not seen."""
    motion = motions(track)
    trials = [trial for candidate in found for trial in narrowed(track, fit, candidate, motion)]
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
    gram = Gram(everything, blocks_of(track, everything.shape[0]))
    refit = list(range(1 + len(twin_residuals), 1 + len(twin_residuals) + n_free))
    alone = gram.left(0, refit)
    chance_alone = [gram.left(1 + k, refit) for k in range(len(twin_residuals))]
    able: list[tuple[Tried, list[int]]] = []
    promise: dict[int, float] = {}
    for column, place, whole in zip(columns, places, wholes, strict=True):
        if not all(gram.total[k, k] > 1e-12 * gram.total[0, 0] for k in place):
            continue
        solved = gram.solved(0, refit + place)
        if not column.amplitudes and solved[n_free] <= 0.0:
            continue  # the opposite of the effect, which there isn't
        left = gram.left(0, refit + place)
        by_chance = max((base - gram.left(1 + k, refit + place) for k, base in enumerate(chance_alone)), default=0.0)
        able.append((Tried(column, left, alone - left, by_chance, solved[n_free:], solved[:n_free]), place))
        # A structure can't be there by a part: its values are judged by what it leaves as it is.
        promise[id(column)] = gram.left(whole, refit) if whole else left
    best: dict[str, Tried] = {}
    for tried, _ in able:
        effect = tried.column.term.effect
        name = effect.id if effect.neutral is not None else effect.key
        if name not in best or promise[id(tried.column)] < promise[id(best[name].column)]:
            best[name] = tried
    return Screening(alone, tuple(sorted(best.values(), key=lambda each: each.left)), _pairs(gram, refit, able))


def _pairs(gram: Gram, refit: list[int], able: Sequence[tuple[Tried, list[int]]]) -> tuple[tuple[Tried, Tried, float], ...]:
    """The best pairs of trials of different effects, one pair for each two effects."""
    best: dict[tuple[str, str], tuple[Tried, Tried, float]] = {}
    n_free = len(refit)
    for k, (one, place) in enumerate(able):
        for other, beside in able[k + 1 :]:
            names = (one.column.term.effect.id, other.column.term.effect.id)
            if names[0] == names[1] or _exclude(one, other):
                continue
            left = gram.left(0, refit + place + beside)
            if names not in best or left < best[names][2]:
                solved = gram.solved(0, refit + place + beside)
                first = Tried(
                    one.column, one.left, one.gain, one.by_chance, solved[n_free : n_free + len(place)], solved[:n_free]
                )
                rest = solved[n_free + len(place) :]
                second = Tried(other.column, other.left, other.gain, other.by_chance, rest, solved[:n_free])
                if (not one.column.amplitudes and first.coefficients[0] <= 0.0) or (
                    not other.column.amplitudes and rest[0] <= 0.0
                ):
                    continue
                best[names] = (first, second, left)
    return tuple(sorted(best.values(), key=lambda each: each[2])[:_PAIRS])


def _exclude(one: Tried, other: Tried) -> bool:
    """True when both can't be in one model."""
    first, second = one.column.term.effect, other.column.term.effect
    return first.slip is not None and second.slip is not None
