"""The missing force of a recording as a sum over the components of the machine, with the evidence for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks

from ...model import Model, Term
from ...record import Array
from ...threads import mapped
from ..along import REST
from ..along import Along as Quick
from ..candidates import candidates, place_of, scales_of
from ..fitting import State
from ..motion import along
from ..screen import OWN, SEEN, SLOWLY, Column, Promise, columns_of
from ..track import Track
from .components import BY_ID, COMB, COMPONENTS, OTHER_OF, OTHERS, Along, Component, Ranges, comb_cycles
from .evidence import Grouped, Weighed

__all__ = [
    "ALIKE",
    "PRESENT",
    "Additive",
    "Presence",
    "additive",
    "functions_of",
    "independent_share",
    "independent_values",
]

PRESENT = 0.5
"""Probability from which on something is more likely missing in a component than not."""

ALIKE = 0.5
"""Statistical, share of a law's energy that a component's function explains: from this on, the law belongs to the component."""

_THIN = 1.0  # times 1/w, from row to row: what an observer sees is smooth over about two of these
_ROUNDS = 15  # iterations from the sizes that hold with all components
_PRIOR = 0.1  # probability, before the recording is seen, that something is missing in a component
_STRONGEST = 3  # periods that are tried
_FINER = 8  # numerical: points of a spectrum from one whole number of cycles to the next


@dataclass(frozen=True, eq=False)
class Presence:
    """What is missing in one component.

    Attributes:
        component: where.
        nats: evidence for its function beside all others', dependence of the rows counted.
        probability: that something is missing there.
        rms: root mean square of what its function explains [F].
        share: of the missing force's energy that comes back when it is left out and all others are refitted [1].
    """

    component: Component
    nats: float
    probability: float
    rms: float
    share: float


@dataclass(frozen=True, eq=False)
class Law:
    """A law of the vocabulary that the model could get.

    Attributes:
        column: the law with the values at which it was tried.
        parts: its columns at the rows, each with a root mean square of one, shape ``(n, k)``.
        sizes: root mean square that each had [F], shape ``(k,)``.
        place: id of its component.
    """

    column: Column
    parts: Array
    sizes: Array
    place: str


@dataclass(frozen=True, eq=False)
class Additive:
    """A missing force, taken apart.

    Attributes:
        presences: of every component, the largest evidence first.
        missing: root mean square of the missing force [F].
        left: of what no component's function explains [F].
        floor: of what noise alone leaves [F].
        n_rows: equations.
        dependence: independent rows over rows [1].
        grouped: the equations.
        weighed: with all components.
        rows: of the track's residual that they are.
        groups: columns of each component at these rows, by its id.
        laws: of the vocabulary, each with its component.
        withouts: the same without each component, by its id.
    """

    presences: tuple[Presence, ...]
    missing: float
    left: float
    floor: float
    n_rows: int
    dependence: float
    grouped: Grouped
    weighed: Weighed
    rows: slice
    groups: dict[str, Array]
    laws: tuple[Law, ...]
    withouts: dict[str, Weighed]


def additive(track: Track, state: State) -> Additive:
    """Take apart what the fitted model of ``state`` lacks on ``track``."""
    groups, rows, ranges = functions_of(track, state.fit.model)
    laws = _laws(track, state, rows, _strongest_periods(state, rows, groups, ranges))
    places = _places(state, rows, groups, laws)
    for k, place in places.items():
        if place in OTHERS:
            groups[place] = np.concatenate([groups.get(place, np.zeros((laws[k][1].shape[0], 0))), _unit(laws[k][1])], axis=1)
    grouped = Grouped(state.fit.residual[rows], state.fit.jacobian[rows], groups)
    whole = grouped.weighed(grouped.names)
    start = dict(zip(whole.groups, whole.sizes, strict=True))
    noise = float(np.log(whole.noise / grouped.size))
    left = grouped.residual(whole)
    dependence = independent_share(left)
    energy, total = float(np.mean(left**2)), grouped.size**2
    found, withouts = [], {}
    for name in grouped.names:
        without = grouped.weighed([each for each in grouped.names if each != name], start, noise, _ROUNDS)
        withouts[name] = without
        nats = dependence * (whole.log_evidence - without.log_evidence)
        back = max(float(np.mean(grouped.residual(without) ** 2)) - energy, 0.0)
        rms = float(np.sqrt(np.mean(grouped.part(name, whole) ** 2)))
        found.append(Presence(BY_ID[name], nats, _probability(nats), rms, min(back / max(total, 1e-300), 1.0)))
    found.sort(key=lambda each: -each.nats)
    floor = float(np.sqrt(state.floor / state.fit.residual.shape[0]))
    held = [
        Law(column, _unit(parts), np.sqrt(np.mean(parts**2, axis=0)), places[k])
        for k, (column, parts) in enumerate(laws)
        if places.get(k)
    ]
    return Additive(
        tuple(found), float(np.sqrt(total)), float(np.sqrt(energy)), floor, grouped.n, dependence, grouped, whole, rows, groups,
        tuple(held), withouts,
    )  # fmt: skip


def functions_of(
    track: Track, model: Model, components: Sequence[Component] = COMPONENTS
) -> tuple[dict[str, Array], slice, Ranges]:
    """The functions of ``components`` as the observer sees them, by their ids, at which rows of the residual, and their ranges.

    Args:
        track: the recordings.
        model: that gives the force along the motion. It must not have what is to be told from these functions: one of a force
            that has a ripple repeats over position, too.
        components: whose functions.
    """
    signals = _signals(track, model)
    ranges = _ranges(track, signals)
    stride = max(round(_THIN / (track.bandwidth * min(run.sample_time for run in track.runs))), 1)
    rows = slice(stride // 2, None, stride)
    groups = {}
    for component in components:
        per_run = [component.columns(each, ranges) for each in signals]
        seen = np.stack([track.seen([part[:, k] for part in per_run]) for k in range(per_run[0].shape[1])], axis=1)[rows]
        if float(np.max(np.abs(seen))) > 0.0:
            groups[component.id] = seen
    return groups, rows, ranges


def _laws(track: Track, state: State, rows: slice, periods: Sequence[float]) -> list[tuple[Column, Array]]:
    """Every law that the model could get, at the values that promise most, with its columns at the rows."""
    found = candidates(state.fit.model, scales_of(track))
    quick = Promise(Quick(track), state.fit)
    trials = [trial for kept in mapped(quick.narrowed, found) for trial in kept]
    trials += [trial for each in found for trial in _with_periods(each.trials[0], periods)]
    held = [(column, np.stack(column.parts, axis=1)[rows]) for column in columns_of(track, state.fit, trials)]
    return [(column, parts) for column, parts in held if np.all(np.isfinite(parts)) and np.all(np.any(parts != 0.0, axis=0))]


def _with_periods(first: Term, periods: Sequence[float]) -> list[Term]:
    """``first`` with other periods, where it is a force that repeats over position."""
    names = [p.name for p in first.effect.parameters]
    if "period" not in names or first.effect.level is not None:
        return []
    at = names.index("period")
    return [Term(first.effect, (*first.values[:at], period, *first.values[at + 1 :])) for period in periods]


def _places(state: State, rows: slice, groups: dict[str, Array], laws: Sequence[tuple[Column, Array]]) -> dict[int, str]:
    """The component of each law: the one whose function does most of it, or else its own part of the machine."""
    named = {f"law {k}": _unit(parts) for k, (_, parts) in enumerate(laws)}
    grouped = Grouped(state.fit.residual[rows], state.fit.jacobian[rows], {**groups, **named})
    places = {}
    for k, (column, _) in enumerate(laws):
        if grouped.own(f"law {k}") < OWN**2:
            continue  # the fitted parameters do the same
        likeness = {each: grouped.likeness(f"law {k}", each) for each in groups}
        best = max(likeness, key=lambda each: likeness[each])
        places[k] = best if likeness[best] >= ALIKE else OTHER_OF[place_of(column.term.effect)]
    return places


def _unit(columns: Array) -> Array:
    return np.asarray(columns / np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-300), dtype=np.float64)


def _strongest_periods(state: State, rows: slice, groups: dict[str, Array], ranges: Ranges) -> list[float]:
    """The periods with the largest amplitudes of the function that repeats over position, where all functions are there [x]."""
    grouped = Grouped(state.fit.residual[rows], state.fit.jacobian[rows], groups)
    cycles = comb_cycles(ranges)
    if COMB not in groups or groups[COMB].shape[1] != 2 * cycles.shape[0]:
        return []
    cosine, sine = np.split(grouped.amounts(COMB, grouped.weighed(grouped.names, rounds=_ROUNDS)), 2)
    return [(ranges.high - ranges.low) / each for each in lines_of(cycles, cosine, sine)]


def lines_of(cycles: Array, cosine: Array, sine: Array) -> list[float]:
    """Cycles over the travel, whole or not, at which the sum of ``cosine`` and ``sine`` over ``cycles`` is strongest.

    A line between two whole numbers of cycles is seen as several of them: it stands where the spectrum of their sum, which is
    known between them too, is largest.
    """
    n = 4 * int(cycles[-1])
    place = np.arange(n) / n
    angle = 2.0 * np.pi * place[:, None] * cycles
    power = np.abs(np.fft.rfft(np.cos(angle) @ cosine + np.sin(angle) @ sine, _FINER * n))[: _FINER * (int(cycles[-1]) + 1)]
    peaks, _ = find_peaks(power, distance=_FINER)
    strongest = sorted(peaks.tolist(), key=lambda peak: -power[peak])[:_STRONGEST]
    return [peak / _FINER for peak in strongest if peak >= _FINER]


def _probability(nats: float) -> float:
    """By Bayes' rule from the evidence."""
    odds = np.log(_PRIOR / (1.0 - _PRIOR)) + nats
    return float(1.0 / (1.0 + np.exp(-np.clip(odds, -50.0, 50.0))))


def independent_share(residual: Array) -> float:
    """Independent rows over rows: one over one plus twice the sum of the autocorrelations until they first are not positive."""
    centred = residual - np.mean(residual)
    power = max(float(centred @ centred), 1e-300)  # of a recording without any noise nothing may be left
    total = 1.0
    for lag in range(1, min(residual.shape[0] // 4, 200)):
        rho = float(centred[lag:] @ centred[:-lag]) / power
        if rho <= 0.0:
            break
        total += 2.0 * rho
    return 1.0 / total


def independent_values(track: Track, residual: Array) -> float:
    """About how many independent values a ``residual`` of the track holds, shape ``(n,)``.

    What an observer sees is smooth over its time constant: the correlation is reckoned from rows that far apart.
    """
    apart = max(round(1.0 / (track.bandwidth * min(run.sample_time for run in track.runs))), 1)
    return independent_share(residual[::apart]) * float(residual.shape[0]) / apart


def _signals(track: Track, model: Model) -> list[Along]:
    fast = max(float(np.quantile(np.abs(np.concatenate([each.velocity for each in track.motion])), 0.98)), 1e-300)
    rest = max(REST * fast, 4.0 * max(track.noise) * track.bandwidth)
    found = []
    for k, (run, time, motion) in enumerate(zip(track.runs, track.time, track.motion, strict=True)):
        n = motion.velocity.shape[0]
        sign = np.where(np.abs(motion.velocity) > rest, np.sign(motion.velocity), 0.0)
        states = track.inner_states(model, k, float(motion.velocity[0]))
        force = along(model, run, time, motion, motion.velocity, states)
        load, temperature = (
            np.broadcast_to(each, (n,)) if each.shape[0] in (1, n) else each[:n] for each in (run.load, run.temperature)
        )
        found.append(
            Along(
                time - 0.5 * motion.step, motion.position, motion.velocity, motion.acceleration, sign,
                _way(motion.position, sign), force, motion.step, load, temperature,
            )
        )  # fmt: skip
    return found


def _way(position: Array, sign: Array) -> Array:
    """Way since the direction last changed [x], shape ``(n,)``."""
    moved = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(position)))])
    begun, last = 0.0, 0.0
    way = np.empty_like(moved)
    for k, (s, m) in enumerate(zip(sign.tolist(), moved.tolist(), strict=True)):
        if s not in (0.0, last):
            begun, last = m, s
        way[k] = m - begun
    return way


def _ranges(track: Track, signals: Sequence[Along]) -> Ranges:
    scales = scales_of(track)
    position, velocity = (np.concatenate([getattr(each, name) for each in signals]) for name in ("position", "velocity"))
    slowly = (
        float(np.quantile(np.abs(velocity[np.abs(velocity) > scales.slow]), SLOWLY))
        if np.any(np.abs(velocity) > scales.slow)
        else scales.slow
    )
    return Ranges(
        float(np.min(position)),
        float(np.max(position)),
        float(np.quantile(np.abs(velocity), 0.999)),
        min(float(each.time[0]) for each in signals),
        max(float(each.time[-1]) for each in signals),
        max(2.0 * np.pi * slowly / (SEEN * track.bandwidth), 4.0 * scales.grain),
        scales.grain,
    )
