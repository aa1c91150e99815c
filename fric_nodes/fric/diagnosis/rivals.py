"""Rivals: the most promising candidates of a screening, fitted in full together with all that is there.

The candidates that :mod:`fric.diagnosis.offered` chooses are fitted roughly. The best of them get more iterations, some also
from other values, and are compared in other forms of the same effect (:mod:`fric.diagnosis.other_forms`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ..model import Model
from ..threads import mapped
from .candidates import Scales
from .costs import NATS_PER_PARAMETER
from .fitting import State, bounds_of, free_names, is_driven, shaken, unseen
from .least_squares import Fit
from .motor_side import half_on_motor
from .offered import offered
from .other_forms import extended, shaped, that_give, with_play
from .price import OF_FLOOR
from .rival import Rival, name_of, rival_of, side_by_side
from .screen import Screening
from .track import Track

__all__ = ["rivals_of"]

_REFINED = 2  # the best, with more iterations,
_ALSO_REFINED = 0.9  # of what the best takes off: the first of another effect that does is refined, too
_SHARES = (0.5, 0.3, 0.7)  # of the mass behind a transmission, from which fits begin
_IN_REACH = 0.6  # of what is to be beaten, a rough fit takes off before it is worth more iterations
_CLOSE = 0.98  # of what the best takes off: so close it may not be the best
_FITTED_OUT = 3  # of such rivals
_FACTORS = (0.25, 0.5, 2.0, 4.0)  # by which values are moved, from which they are fitted again
_AGAIN = 4  # iterations
_SHAPED = 3  # of the best, whose shapes and laws are compared, too
_ROUGH = 0.02  # of what is missing: with more left, the best fits are begun again from around them


def rivals_of(track: Track, state: State, found: Screening, scales: Scales, to_beat: float = math.inf) -> list[Rival]:
    """The most promising candidates, and pairs where these promise far more, fitted in full; the best first.

    Args:
        track: of the recordings.
        state: what they come to.
        found: the screening beside it.
        scales: of the recordings.
        to_beat: what something else leaves in their place [F^2]. Where that is hardly anything, fewer candidates are tried; a
            rival that is far from it after its rough fit gets no further iterations, and no other forms.
    """
    much = state.floor + max(_ROUGH * state.excess, OF_FLOOR * state.floor)
    begun = offered(track, state, found, scales, to_beat > much)
    fits = mapped(lambda beginning: _first_fit(track, state, beginning.model, scales), begun.values())
    fitted = [rival_of(track, state, offer, fit, found) for offer, fit in zip(begun, fits, strict=True)]
    fitted = side_by_side(track, fitted, found.unpaid)
    for k in _worth_refining(state, fitted):
        rival = fitted[k]
        if not _reaches(state, rival, to_beat):
            continue
        bounds = bounds_of(rival.fit.model, scales)
        fit = track.fit(rival.fit.model, rival.fit.names, 8, bounds)
        if to_beat > much and _steps(rival) and unseen(track, fit, fit.residual) > much:
            fit = shaken(track, fit, bounds, (1.0 + OF_FLOOR) * state.floor)
        fitted[k] = rival_of(track, state, rival.offer, fit, found)
        if fitted[k].left > much:
            fitted[k] = extended(track, state, fitted[k], found, scales)
    fitted = with_play(track, state, fitted, found, scales)
    fitted = side_by_side(track, fitted, found.unpaid)
    if to_beat > much and fitted and fitted[0].left > much and _reaches(state, fitted[0], to_beat):
        giving = that_give(track, state, fitted[0], found, scales)
        fitted = side_by_side(track, [*fitted, *giving], found.unpaid) if giving else fitted
    if to_beat > much:
        fitted = side_by_side(track, _fitted_out(track, state, fitted, found, scales), found.unpaid)
    n_shaped = _SHAPED if to_beat > much else 1
    in_shape = [
        shaped(track, state, rival, found, scales) if _reaches(state, rival, to_beat) else rival for rival in fitted[:n_shaped]
    ]
    ranked = side_by_side(track, [*in_shape, *fitted[n_shaped:]], found.unpaid)
    return side_by_side(track, _simpler_from_there(track, state, ranked, found, scales), found.unpaid)


def _reaches(state: State, rival: Rival, to_beat: float) -> bool:
    """Whether ``rival`` takes off enough for more iterations, or another form of it, to beat what leaves ``to_beat`` [F^2]."""
    return state.left - rival.left >= _IN_REACH * (state.left - to_beat)


def _simpler_from_there(track: Track, state: State, ranked: list[Rival], found: Screening, scales: Scales) -> list[Rival]:
    """``ranked``, where those with fewer parameters than the best are fitted again from what that one has found for the others.

    Beside friction that sticks what the model had before has several minima, too. A simpler law that is left in another one
    than the best would lose to it by that alone.
    """
    result = list(ranked)
    for k, rival in enumerate(ranked):
        best = ranked[0].fit.model
        simpler = len(rival.fit.model.names) < len(best.names) and state.left - rival.left > _ALSO_REFINED * (
            state.left - ranked[0].left
        )
        if not simpler:
            continue
        common = {name for name in state.fit.model.names if name in best.names and name in rival.fit.model.names}
        values = [
            best.value(n) if n in common else v for n, v in zip(rival.fit.model.names, rival.fit.model.values, strict=True)
        ]
        start = rival.fit.model.with_values(np.array(values))
        other = rival_of(track, state, rival.offer, track.fit(start, rival.fit.names, 8, bounds_of(start, scales)), found)
        if other.left < rival.left:
            result[k] = replace(other, dear=rival.dear)
    return result


def _fitted_out(track: Track, state: State, fitted: list[Rival], found: Screening, scales: Scales) -> list[Rival]:
    """``fitted``, where those of several effects that explain nearly as much as the best are fitted again from other values.

    The right effect would leave no more than the floor. While none does, the differences between the rivals may only tell how
    far each fit has come.
    """
    floor = (1.0 + OF_FLOOR) * state.floor
    close: dict[str, int] = {}
    for k, rival in enumerate(fitted):
        if len(rival.offer) == 1 and state.left - rival.left > _CLOSE * (state.left - fitted[0].left):
            close.setdefault(rival.effect.id, k)
    if len(close) < 2 or min(rival.left for rival in fitted) < floor:
        return fitted
    result = list(fitted)
    for k in list(close.values())[:_FITTED_OUT]:
        rival = fitted[k]
        bounds = bounds_of(rival.fit.model, scales)
        names, starts = rival.fit.names, _elsewhere(rival, scales)
        again = mapped(partial(track.fit, names=names, max_iterations=_AGAIN, bounds=bounds), starts)
        best = min([rival.fit, *again], key=lambda each: float(each.residual @ each.residual))
        other = rival_of(track, state, rival.offer, track.fit(best.model, best.names, 8, bounds), found)
        if other.left < rival.left:
            result[k] = replace(other, dear=rival.dear)
    return result


def _elsewhere(rival: Rival, scales: Scales) -> list[Model]:
    """Models from which the fit of ``rival`` may come further: one nonlinear parameter of its effect is changed in each.

    Beside friction that sticks, the sum of squares may have several minima, for example over the width of a Stribeck curve.
    """
    model, effect = rival.fit.model, rival.effect
    bounds = bounds_of(model, scales)
    found = []
    for p in effect.parameters:
        if p.linear or p.shape or p.name in effect.amplitudes:
            continue
        name = f"{name_of(model, effect)}.{p.name}"
        low, high = bounds.get(name, (p.lower, math.inf))
        for factor in _FACTORS:
            value = model.value(name) * factor
            if low < value < high:
                found.append(model.with_value(name, value))
    return found


def _worth_refining(state: State, fitted: Sequence[Rival]) -> list[int]:
    """Indices of the rivals in ``fitted`` that get more iterations; ``fitted`` has the best one first."""
    best = list(range(min(_REFINED, len(fitted))))
    effects = {fitted[k].effect.id for k in best}
    for k, rival in enumerate(fitted):
        if rival.effect.id not in effects and state.left - rival.left > _ALSO_REFINED * (state.left - fitted[0].left):
            return [*best, k]
    return best


def _first_fit(track: Track, state: State, model: Model, scales: Scales) -> Fit:
    """``model`` fitted with few iterations, the best of several fits where it has a transmission that ``state`` has not.

    These begin at different shares of the mass behind the transmission: all else depends on that share, and what is left is no
    smooth function of it.
    """
    starts = [model]
    if is_driven(model) and not is_driven(state.fit.model):
        starts = [model.with_value("load_share", share) for share in _SHARES]
    fits = [track.fit(start, free_names(start), 4, bounds_of(start, scales)) for start in starts]
    best = min(fits, key=lambda fit: float(fit.residual @ fit.residual))
    return _divided(track, best, scales) if len(starts) > 1 else best


def _divided(track: Track, fit: Fit, scales: Scales) -> Fit:
    """``fit``, or one that begins at it with friction of the motor where that is worth its parameters."""
    start = half_on_motor(fit.model)
    if start is None:
        return fit
    divided = track.fit(start, free_names(start), 4, bounds_of(start, scales))
    price = NATS_PER_PARAMETER * (len(divided.names) - len(fit.names))
    left, before = (float(each.residual @ each.residual) for each in (divided, fit))
    return divided if left > 0.0 and left < before * math.exp(-2.0 * price / track.independent) else fit


def _steps(rival: Rival) -> bool:
    """True where what is left may jump as a parameter changes: by sticking, a gap or a limit."""
    effects = [each.column.term.effect for each in rival.offer]
    return is_driven(rival.fit.model) or any(not p.linear for effect in effects for p in effect.parameters if not p.shape)
