"""Fits of whole models to a track: what they leave where they were not fitted, and what their own twins leave."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from ..model import Model, Term
from ..record import Array
from ..threads import mapped
from .along import Along
from .candidates import Scales, closer, fewest_cycles, scales_of, trials_of
from .indifference import dearer
from .least_squares import INFLATION, Bounds, Fit
from .motor_side import MOTOR_FRICTION, half_on_motor
from .screen import Gram, Tried, blocks_of, restraint
from .track import Track
from .twin import twins

__all__ = [
    "NOTHING",
    "N_TWINS",
    "Beginning",
    "State",
    "added",
    "begun",
    "best_track",
    "bounds_of",
    "free_names",
    "is_driven",
    "left_beside",
    "left_by",
    "refit",
    "shaken",
    "unseen",
    "with_amplitudes",
    "with_room",
    "without_place",
    "without_term",
]

NOTHING = 0.35
"""Share of the floor: nothing is missing when less than this is left above it."""
N_TWINS = 3
"""Statistical: twins that a floor is reckoned from."""
_CLEAR = 25.0  # times the floor
_ASTRAY = 4.0  # times the floor of a simpler model
_LIGHTEST = 0.3  # of the mass that a fit began with
_SHAKES = (0.3, 0.1, 0.03)  # by which values are moved, as shares of themselves
_ROUNDS = 2
_HELPED = 0.98  # of what is left: with more left after a round, there is no further one
_DRAWN = 8  # places each time
_AFTER_A_SHAKE = 3  # iterations
_WELL_KNOWN = 0.3
_LOWEST_LIMIT = 0.01  # of the largest recorded force: a command may lie far beyond it
_HIGHEST_LIMIT = 1.1
_MOST_FORCE = 2.0  # of the largest recorded force, a term's


@dataclass(frozen=True, eq=False)
class State:
    """A fitted model and what it leaves.

    Attributes:
        fit: to all blocks.
        left: sum of squares on unseen blocks [F^2], the more where the model minds the effort less.
        of_noise: makes ``floor`` and ``chance``; many a model is judged by what it leaves alone, and never asked for these.
    """

    fit: Fit
    left: float
    of_noise: Callable[[], tuple[float, tuple[Array, ...]]]

    @property
    def floor(self) -> float:
        """What is left on unseen blocks of twins, their mean [F^2]: of noise. It is no more where the effort matters less."""
        return self.of_noise()[0]

    @property
    def chance(self) -> tuple[Array, ...]:
        """Residuals of the twins, shape ``(n,)`` each [F]."""
        return self.of_noise()[1]

    @property
    def excess(self) -> float:
        """What is missing, above the floor [F^2]."""
        return max(self.left - self.floor, 0.0)


def is_driven(model: Model) -> bool:
    """True when the model has two bodies because it has a transmission."""
    return model.has_transmission


def free_names(model: Model) -> tuple[str, ...]:
    """The parameters that a fit moves: all but shapes, the share of the mass behind a transmission, and the motor's friction.

    That is held where there is none: a fit doesn't bring it by itself (:mod:`.motor_side`).
    """
    return tuple(
        p.name
        for p in model.parameters()
        if (not p.declaration.shape or (p.name == "load_share" and is_driven(model)))
        and not (p.name in MOTOR_FRICTION and p.value == 0.0)
    )


def refit(track: Track, model: Model, max_iterations: int = 12) -> State:
    """``model`` fitted to the track, and what it leaves."""
    fit = track.fit(model, free_names(model), max_iterations, bounds_of(model, scales_of(track)))

    @cache
    def of_noise() -> tuple[float, tuple[Array, ...]]:
        chance = tuple(track.residual(fit.model, twin) for twin in twins(track, fit.model, N_TWINS))
        return float(np.mean([unseen(track, fit, each) for each in chance])), chance

    return State(fit, left_by(track, fit), of_noise)


def left_by(track: Track, fit: Fit) -> float:
    """What a fitted model leaves on unseen blocks [F^2], the more where it minds the effort less (:mod:`.indifference`)."""
    return unseen(track, fit, fit.residual) * dearer(track, fit.model)


def left_beside(track: Track, state: State, with_slip: bool) -> float:
    """What ``state`` leaves on unseen blocks [F^2], as it counts beside a model with slip dynamics, or else without.

    A model with slip dynamics has its position set, and seems to lack less for that: so has the other one then.
    """
    return state.left / (track.unpaid(state.fit.model) if with_slip else 1.0)


def unseen(track: Track, fit: Fit, residual: Array, apart: str = "") -> float:
    """Sum of squares of ``residual`` on blocks left out of the fit in turn [F^2].

    The parameters whose names begin with ``apart`` are not fitted; if it is empty, all are.

    It is reckoned at first order, whose fault is what is more than twice what is left where it was fitted. What a bound holds
    stays: else a surplus that comes out at nothing would be credited with what a shortfall would explain.
    """
    used = fit.solution.free
    if apart:
        used = used & np.array([not name.startswith(apart) for name in fit.names])
    columns = np.concatenate([residual[:, None], fit.jacobian[:, used]], axis=1)
    held = np.full(columns.shape[1], restraint(track, fit))
    gram = Gram(columns, blocks_of(track, columns.shape[0]), held)
    return min(gram.left(0, range(1, columns.shape[1])), INFLATION * float(residual @ residual))


@dataclass(frozen=True, eq=False)
class Beginning:
    """A fitted model with candidates, before everything is fitted together.

    Attributes:
        model: at the best values known.
        lacks: sum of squares that it leaves there [F^2].
    """

    model: Model
    lacks: float


def begun(track: Track, fit: Fit, tried: Sequence[Tried], scales: Scales, along: Along) -> Beginning:
    """The fitted model with the candidates where it lacks least.

    At the screening's values for the candidates, at its values for all parameters, with room made for what has passed for
    something else, or, where the motion tells, at values fitted along it; behind a new transmission also with half of the
    friction on the motor's side.
    """
    grown = fit.model.with_terms((*fit.model.terms, *(_start(each) for each in tried)))
    starts = [grown, _moved(grown, fit, tried[0]), *with_room(fit.model, [each.column.term for each in tried])]
    if along.can(grown):
        names = free_names(grown)
        starts.append(along.fitted(grown, names, track.scale(grown, names), bounds_of(grown, scales)))
    shared = [grown, *(fit.model.with_terms((*fit.model.terms, spring)) for spring in _springs(tried, scales))]
    starts += [divided for divided in map(half_on_motor, shared) if divided is not None]
    lacks = mapped(lambda model: float(np.sum(track.residual(model) ** 2)), starts)
    best = int(np.argmin(lacks))
    return Beginning(starts[best], lacks[best])


def _springs(tried: Sequence[Tried], scales: Scales) -> tuple[Term, ...]:
    """Trials of a transmission that is a spring: with the friction on the wrong side, its screening chose the wrong one."""
    effect = tried[0].column.term.effect
    spring = len(tried) == 1 and effect.link is not None and effect.play is None
    return tuple(closer(trials_of(effect, scales))) if spring else ()


def with_room(model: Model, terms: Sequence[Term]) -> list[Model]:
    """``model`` with the new ``terms``, less what has passed for them; nothing, where nothing has or too little is there."""
    taken: dict[str, float] = {}
    for held in terms:
        for p, value in zip(held.effect.parameters, held.values, strict=True):
            if p.name in held.effect.passes_for:
                taken[held.effect.passes_for[p.name]] = value
    if not taken or any(name not in model.names or model.value(name) < value for name, value in taken.items()):
        return []
    whole = model.with_terms((*model.terms, *terms))
    values = whole.values
    for name, value in taken.items():
        values[whole.names.index(name)] -= value
    return [whole.with_values(values)]


def without_term(model: Model, effect_id: str) -> Model:
    """``model`` less its term of the effect ``effect_id``; the mass that hung on the body is part of it again.

    A body without it would be too light, from where a fit to what accelerates it may not come back.
    """
    gone = [held for held in model.terms if held.effect.id == effect_id]
    left = model.with_terms(held for held in model.terms if held.effect.id != effect_id)
    appended = sum(
        value for held in gone for p, value in zip(held.effect.parameters, held.values, strict=True) if p.dimension == "F s^2/x"
    )
    body = next((p for p in left.parameters() if "." not in p.name and p.declaration.dimension == "F s^2/x"), None)
    if body is None or appended == 0.0:
        return left
    whole = body.value + appended
    if is_driven(left) and is_driven(model):  # the body that it hung on is the load
        left = left.with_value("load_share", (left.value("load_share") * body.value + appended) / whole)
    return left.with_value(body.name, whole)


def shaken(track: Track, fit: Fit, bounds: Bounds, floor: float) -> Fit:
    """``fit``, begun again from places around it while that helps and more than ``floor`` [F^2] is left.

    What sticks, or stands in a gap, at one turn more than the machine does is a step in what is left: between such steps a
    descent ends long before the values are found.
    """
    random = np.random.default_rng(1)
    names = fit.model.names
    index = [names.index(name) for name in fit.names]
    low, high = np.full(len(names), -np.inf), np.full(len(names), np.inf)
    for k, p in enumerate(fit.model.parameters()):
        low[k], high[k] = bounds.get(p.name, (p.declaration.lower, p.declaration.upper))
        if p.declaration.positive:
            low[k] = max(low[k], 1e-3 * abs(float(fit.model.values[k])))
    # What a recording tells well anyway must not be drawn far: it would drown what the others do.
    spread = np.array([1.0 if "." in name or name in ("load_share", *MOTOR_FRICTION) else _WELL_KNOWN for name in fit.names])
    best, left = fit, float(fit.residual @ fit.residual)
    for _ in range(_ROUNDS):
        before = left
        for width in _SHAKES:
            if left < floor:
                return best
            drawn = []
            for each in random.standard_normal((_DRAWN, len(index))):
                values = best.model.values
                values[index] *= np.exp(width * spread * each)
                drawn.append(best.model.with_values(np.clip(values, low, high)))
            lacks = mapped(lambda model: float(np.sum(track.residual(model) ** 2)), drawn)
            again = track.fit(drawn[int(np.argmin(lacks))], fit.names, _AFTER_A_SHAKE, bounds)
            now = float(again.residual @ again.residual)
            if now < left:
                best, left = again, now
        if left > _HELPED * before:
            break
    return best


def _moved(grown: Model, fit: Fit, tried: Tried) -> Model:
    """``grown`` with the refit's parameters where the screening would have them, within their bounds."""
    values = grown.values
    declared = {p.name: p.declaration for p in grown.parameters()}
    names = grown.names
    for name, change, scale in zip(fit.names, tried.moved, fit.scale, strict=True):
        if name not in declared:
            continue
        k = names.index(name)
        lowest = 0.1 * abs(float(values[k])) if declared[name].positive else declared[name].lower
        values[k] = float(np.clip(values[k] + change * scale, lowest, declared[name].upper))
    return grown.with_values(values)


def with_amplitudes(held: Term, names: Sequence[str], sizes: Sequence[float]) -> Term:
    """A term with the parameters ``names`` at ``sizes``, as far as their bounds allow."""
    wanted = dict(zip(names, sizes, strict=True))
    values = (
        float(np.clip(wanted[p.name], p.lower, p.upper)) if p.name in wanted else value
        for p, value in zip(held.effect.parameters, held.values, strict=True)
    )
    return Term(held.effect, tuple(values))


def _start(tried: Tried) -> Term:
    held = tried.column.term
    if tried.column.amplitudes:
        return with_amplitudes(held, tried.column.amplitudes, tried.coefficients.tolist())
    values = list(held.values)
    if held.effect.neutral is not None:
        for k, p in enumerate(held.effect.parameters):
            if p.name in held.effect.amplitudes and p.dimension in ("s",):
                values[k] *= float(np.clip(tried.coefficients[0], 0.3, 3.0))
    return Term(held.effect, tuple(values))


def bounds_of(model: Model, scales: Scales) -> Bounds:
    """Where nonlinear parameters make sense on this recording."""
    ranges = {
        "x/s": (0.3 * scales.slow, 2.0 * scales.speed),
        "s": (0.02 * scales.step, 2.0 * scales.duration),
        "1/s": (2.0, 0.5 / scales.step),
    }
    scale_of = {  # of parameters that aren't the strength of an effect: shorter ones can't be told from none
        "x": (2.0 * scales.grain, 2.0 * scales.travel),
        "s": (2.0 * scales.step, 2.0 * scales.duration),
    }
    found: Bounds = {}
    for prefix, held in zip(model.prefixes, model.terms, strict=True):
        for p, value in zip(held.effect.parameters, held.values, strict=True):
            if p.dimension == "F" and p.linear and not p.shape:
                # A surplus at speeds that the recording doesn't hold could grow for ever.
                found[f"{prefix}.{p.name}"] = (-_MOST_FORCE * scales.most, _MOST_FORCE * scales.most)
            if p.linear or p.shape:
                continue
            if p.dimension == "F" and p.positive:
                # A limit beyond all forces limits nothing: a knee below it would be another law of the gain.
                found[f"{prefix}.{p.name}"] = (_LOWEST_LIMIT * scales.most, max(_HIGHEST_LIMIT * scales.most, value))
            elif p.dimension == "F" and held.effect.command is not None:
                # What swallows more than the largest force recorded lets nothing pass that could move the axis.
                found[f"{prefix}.{p.name}"] = (p.lower, max(scales.most, value))
            strength = p.name in held.effect.amplitudes or held.effect.play is not None
            places = p.dimension == "x" and not p.positive
            around = ranges if strength or places else ranges | scale_of
            if p.name == "period":
                found[f"{prefix}.{p.name}"] = (
                    min(2.0 * scales.grain, value),
                    max(scales.travel / fewest_cycles(held.effect), value),
                )
            elif p.dimension in around:
                low, high = around[p.dimension]
                found[f"{prefix}.{p.name}"] = (min(low, value), max(high, value))
    for held_by_plant in model.parameters():
        if "." not in held_by_plant.name and held_by_plant.declaration.dimension == "F s^2/x":
            # Nothing moves a body without mass under no force: a model of nothing lacks little, too.
            found[held_by_plant.name] = (_LIGHTEST * scales.mass, scales.mass / _LIGHTEST)
    if is_driven(model):
        found["load_share"] = (0.05, 0.95)
    return found


def best_track(
    tracks: Sequence[Track],
    model: Model,
    max_iterations: int = 12,
    floors: Mapping[float, float] | None = None,
    otherwise: Track | None = None,
) -> tuple[Track, State]:
    """The fastest observer to which what ``model`` lacks stands out clearly, or the one to which it does most.

    Args:
        tracks: the same recordings, followed at several bandwidths.
        model: with values that a fit can start from.
        max_iterations: of each fit.
        floors: of a simpler model, of bandwidths [F^2]. A slow observer lets a model go its own way: where its twins, which
            differ by noise alone, stick and slip far apart, it can't judge the model.
        otherwise: the one of ``tracks`` to stay with, where nothing is missing to any.
    """
    best: tuple[float, Track, State] | None = None
    stay: State | None = None
    for track in sorted(tracks, key=lambda each: -each.bandwidth):
        state = refit(track, model, max_iterations=max_iterations)
        quality = state.excess / max(state.floor, 1e-300)
        astray = floors is not None and state.floor > _ASTRAY * floors[track.bandwidth]
        if best is None or (quality > best[0] and not astray):
            best = (quality, track, state)
        if quality > _CLEAR:
            return track, state
        if track is otherwise:
            stay = state
    assert best is not None
    if otherwise is not None and stay is not None and best[0] < NOTHING:
        return otherwise, stay
    return best[1], best[2]


def without_place(model: Model, place: int) -> Model:
    """``model`` less its term number ``place``; of several of one effect the others stay."""
    effect = model.terms[place].effect.id
    if sum(held.effect.id == effect for held in model.terms) == 1:
        return without_term(model, effect)
    return model.with_terms(held for k, held in enumerate(model.terms) if k != place)


def added(before: Model, after: Model) -> list[int]:
    """Places of the terms of ``after`` that ``before`` has not, or not so many of."""
    had = Counter(held.effect.key for held in before.terms)
    places = []
    for k, held in enumerate(after.terms):
        had[held.effect.key] -= 1
        if had[held.effect.key] < 0:
            places.append(k)
    return places
