"""What only the recordings held back show.

Where those learnt from lack nothing, what the others lack may only be a parameter that the first hardly told: viscous friction
from slow motion, say. Fitted to all of them together the nominal model settles that. What the recordings held back lack all the
same is physics that they alone excite, as where a cable pulls at a place to which no other went. Its law can't be learnt, since
nothing would be left to judge it by; but it is there, and it has a place and a signature.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..model import Model
from ..record import Array, Record
from .candidates import candidates, scales_of
from .component import Signature, signatures
from .fitting import N_TWINS, refit
from .going_with_motion import only_noise
from .growth import NAMELESS
from .screen import Tried, screen
from .track import Track
from .twin import twins

__all__ = ["OnlyThere", "only_there"]


@dataclass(frozen=True, eq=False)
class OnlyThere:
    """What the recordings held back lack, and the others don't.

    Attributes:
        noe: that stays there when the nominal model is fitted to all recordings together [%].
        likely: signature of what is missing.
        best: effect that takes most of it away at first order, or None.
    """

    noe: float
    likely: Signature
    best: Tried | None


def only_there(train: Sequence[Record], validation: Sequence[Record], held: Track, begin: Model) -> OnlyThere | None:
    """What ``validation`` lacks whatever values the nominal model has, or None where it lacks nothing clearly.

    Args:
        train: recordings learnt from, that lack nothing.
        validation: recordings held back.
        held: the latter, followed.
        begin: the nominal model, fitted to ``train``.
    """
    if not _lacks(held, begin):
        return None
    everything = Track.of((*train, *validation), held.bandwidth, begin, held.late)
    state = refit(everything, begin)
    if not _lacks(held, state.fit.model) or only_noise(held, state.fit.model):
        return None
    offered = candidates(state.fit.model, scales_of(everything))
    tried = screen(everything, state.fit, offered, state.chance, in_pairs=False).tried
    left = held.residual(state.fit.model)
    effort = held.joined([run.effort for run in held.runs])
    noe = 100.0 * float(left @ left) / float(np.sum((effort - np.mean(effort)) ** 2))
    return OnlyThere(noe, signatures(everything, state.fit, tried)[0], min(tried, key=lambda each: each.left, default=None))


def _lacks(held: Track, model: Model) -> bool:
    """Whether ``held`` shows clearly that something is missing in ``model``."""
    left = held.residual(model)
    floor = float(np.mean([_energy(held.residual(model, twin)) for twin in twins(held, model, N_TWINS)]))
    return _energy(left) > (1.0 + NAMELESS) * floor


def _energy(residual: Array) -> float:
    return float(residual @ residual)
