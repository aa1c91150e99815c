"""What a term costs, and what it has to take off the missing force before it counts as found.

Amounts are sums of squares of the missing force [F^2]: shares of the ``excess``, which is what is missing above the floor, or
of the ``floor``, which is what a twin leaves although its model is right. Each free parameter has a price. A model also pays
for a mass far from the given one, for a transmission with hardly any mass behind it and for friction levels below zero.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..effect import Effect
from ..model import Model
from .costs import PER_PARAMETER, n_free
from .fitting import State, is_driven
from .levels import negative_friction
from .screen import Tried
from .track import Track

__all__ = [
    "BY_CHANCE",
    "FAR_OFF",
    "OF_EXCESS",
    "OF_FLOOR",
    "PER_PARAMETER",
    "earns",
    "implausible",
    "least_gain",
    "mass_off",
    "price_of",
    "strange",
    "worth",
]

FAR_OFF = 0.1  # of what is missing, for a mass twice or half the one that was given
_NEAR = 1.2  # times as large or small as the given one, or less
_LEAST_SHARE = 0.1  # of the mass behind a spring: half of it counts as much as a mass twice the given one
OF_FLOOR = 0.15  # statistical: what a term has to take off, as a share of the floor,
OF_EXCESS = 0.12  # as a share of what is missing, since less is no explanation,
BY_CHANCE = 6.0  # and times what candidates take off twins by chance


def price_of(effect: Effect, excess: float) -> float:
    """What the parameters of ``effect`` cost [F^2]."""
    return PER_PARAMETER * excess * n_free(effect)


def implausible(track: Track, model: Model) -> float:
    """What speaks against ``model`` whatever it explains, as a share of what is missing.

    That is a mass far from all that were given, a transmission with hardly any mass behind it, and friction whose level is
    below zero along the motion that ``track`` holds.
    """
    return strange(track.masses, model) + negative_friction(track, model)


def strange(masses: Sequence[float], model: Model) -> float:
    """What the masses of ``model`` say against it, as a share of what is missing.

    That is a mass far from all ``masses`` [F s^2/x] that were given, and a transmission with hardly any mass behind it: between
    a spring that ends at a body and one that ends at friction, the first micrometres of a contact, no recording decides there.
    """
    share = model.value("load_share") if is_driven(model) else 1.0
    return mass_off(masses, model) + FAR_OFF * max(math.log2(_LEAST_SHARE / share), 0.0) ** 2


def mass_off(masses: Sequence[float], model: Model) -> float:
    """What it speaks against ``model`` to be far from all ``masses`` [F s^2/x] that were given, as a share of what is missing.

    A body that is far too light under a force that is taken away from it lacks little, whatever the machine does. A mass that
    is near speaks against nothing: it was fitted by a model that lacks something.
    """
    appended = sum(p.value for p in model.parameters() if "." in p.name and p.declaration.dimension == "F s^2/x")
    off = min(math.log2((model.total_inertia + appended) / mass) ** 2 for mass in masses)
    near = math.log2(_NEAR) ** 2
    return FAR_OFF * max(off - near, 0.0) / (1.0 - near)


def worth(state: State, tried: Sequence[Tried], of_excess: float = OF_EXCESS) -> bool:
    """True when a screened candidate promises a real gain although nothing much is left."""
    return bool(tried) and earns(state, tried[0].left, tried[:1], of_excess)


def earns(state: State, left: float, tried: Sequence[Tried], of_excess: float = OF_EXCESS) -> bool:
    """True when leaving ``left`` is more than what ``tried`` takes off by chance, and the part ``of_excess`` of it all."""
    return state.left - left > max(
        least_gain(state, max((each.by_chance for each in tried), default=0.0)), of_excess * state.excess
    )


def least_gain(state: State, by_chance: float) -> float:
    """What anything that comes to ``state`` has to take off, however much is missing [F^2].

    Args:
        state: to which it comes.
        by_chance: what it takes off a twin, where nothing is missing [F^2].
    """
    return max(OF_FLOOR * state.floor, BY_CHANCE * by_chance)
