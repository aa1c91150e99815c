"""Backlash: free play between motor and load, with rigid stops at its ends.

Equation: within the play |y - q| < b/2 nothing is passed on; at its end the sides meet in a fully plastic impact, which keeps
their momentum, and go on together with the velocity (m_m v_m + m_l v_l)/(m_m + m_l) until the motor draws back. The impact is
exact (:mod:`fric.engine.transmission`): nothing rebounds, and what it takes of the energy is half the reduced mass times
the square of the closing speed.

In a model that has a ``compliance`` or an ``impact_backlash`` besides, the play is added to theirs, and their spring is what
it ends at.
Source: Tao and Kokotovic 1994, as de Marchi 1998 describes it ("all rigid-body impacts are fully plastic, and momentum is
conserved").
"""

from __future__ import annotations

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def play(gap: float) -> float:
    return gap


EFFECT = Effect(
    id="backlash",
    place=Place.TRANSMISSION,
    title="backlash",
    equation="L = 0 while |y - q| < b/2; y - q = +-b/2 and a common velocity while the sides press on each other",
    source="Tao and Kokotovic 1994; de Marchi 1998",
    parameters=(Parameter("gap", "b", "x", "free play from stop to stop", lower=0.0),),
    play=play,
    regime="after every reversal of the force: the motor crosses the gap alone, with nothing but its own inertia to move",
    looks_like={
        "compliance": "push the resting load gently: a motor crosses a gap without force; against a spring it needs one",
        "impact_backlash": "look at the motor after it has crossed the gap: elastic stops make it ring, rigid ones don't",
        "input_deadzone": "turn the motor by hand: in a gap it is free while the load rests; a dead zone is in the command",
        "presliding": "measure the load's position too: pre-sliding moves the load itself, a gap lets only the motor move",
    },
)
