"""A faint term: an effect whose force is weak beside the noise, and still clear because of its form.

A ripple or a resonance has a form of its own in time or over the position. It stands out from noise of many times its energy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from ..model import Model
from .adding import extended_by_terms, grown_on
from .candidates import candidates, scales_of
from .fitting import State, bounds_of, free_names, refit, unseen
from .growth import Growth
from .price import BY_CHANCE
from .rival import Rival
from .rivals import rivals_of
from .screen import Screening, Tried, screen
from .track import Track
from .twin import twins

__all__ = ["beyond_chance", "faint_term"]

_FAINT = 0.04  # of the floor, and
_DRAWS = 40.0  # times what one parameter takes off noise: so little may still be seen clearly
_ALIKE = 0.8  # of what the best takes off: another that does tells that the cause can't be told


def faint_term(tracks: Sequence[Track], nominal: Model, tell: Callable[[str], None]) -> Growth | None:
    """``nominal`` grown from the faint term that stands out most; None where no term does, or where several effects do alike.

    Args:
        tracks: the same recordings, followed at several bandwidths.
        nominal: with values that a fit can start from.
        tell: told what comes.
    """
    best: tuple[float, Track, State, Screening] | None = None
    for track in tracks:
        if track.unsure:
            return None
        state = refit(track, nominal)
        found = screen(track, state.fit, candidates(state.fit.model, scales_of(track)), state.chance, in_pairs=False)
        clear = tuple(each for each in found.tried if each.gain > beyond_chance(track, state, (each,)))
        if not clear:
            continue
        surprise = clear[0].gain / state.floor * track.independent
        if best is None or surprise > best[0]:
            best = surprise, track, state, replace(found, tried=clear, laws=())
    if best is None:
        return None
    _, track, state, found = best
    rivals = rivals_of(track, state, found, scales_of(track))
    rivals = [rival for rival in rivals if state.left - rival.left > beyond_chance(track, state, rival.offer)]
    if not rivals:
        return None
    others = [state.left - rival.left for rival in rivals if rival.effect.id != rivals[0].effect.id]
    gain = state.left - rivals[0].left
    if max(others, default=0.0) > _ALIKE * gain:
        return None
    if gain - _of_noise(track, state, rivals[0]) < beyond_chance(track, state, rivals[0].offer):
        return None
    return grown_on(
        [track], extended_by_terms([track], Growth(track, state, state, (), (), 1.0), rivals[0], tell, most=1), tell
    )


def _of_noise(track: Track, state: State, rival: Rival) -> float:
    """What the model of ``rival`` takes off a twin of ``state``, where nothing is missing, both fitted to it [F^2].

    A term that goes with acceleration, or with the force itself, can pass less of the noise on, and seem to explain it.
    """
    (twin,) = twins(track, state.fit.model, 1)
    left = []
    for model in (state.fit.model, rival.fit.model):
        fit = track.fit(model, free_names(model), bounds=bounds_of(model, scales_of(track)), twin=twin)
        left.append(unseen(track, fit, fit.residual))
    return left[0] - left[1]


def beyond_chance(track: Track, state: State, tried: Sequence[Tried]) -> float:
    """An amount [F^2] that no candidate of ``tried`` takes off by chance."""
    by_chance = max(each.by_chance for each in tried)
    return max(state.floor * max(_FAINT, _DRAWS / track.independent), BY_CHANCE * by_chance)
