"""Bias: a constant force, whatever the motion (gravity on a tilted axis, an amplifier's offset, a cable's pull).

Equation: F = b, positive when it opposes positive motion.
Source: the offset of every published axis model, such as EMPS (Janot, Gautier, Brunot 2019).
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def force(c: Context, force: float) -> float:
    return force


EFFECT = Effect(
    id="bias",
    place=Place.FORCE,
    title="constant bias force",
    equation="F = b",
    source="Janot, Gautier, Brunot 2019 (EMPS), offset",
    parameters=(Parameter("force", "b", "F", "constant force against positive motion", linear=True),),
    force=force,
    regime="everywhere, the same in both directions and at rest",
    looks_like={"asymmetry": "push the resting body from both sides: a bias shifts both break-away forces the same way"},
)
