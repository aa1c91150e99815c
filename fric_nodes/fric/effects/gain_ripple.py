"""Gain ripple: an actuator that gives more force at some places than at others, again and again along the travel.

Equation: f = (1 + A cos(2 pi q / L) + B sin(2 pi q / L)) u, with u the force by the nominal gain. What the motor adds to it is
F = -(A cos + B sin) u, a force on the body; over a step the wave has the mean that a force ripple has. Behind a transmission it
is laid on the force that this passes on, over the position of the load.
Source: torque constant of a brushless motor over its angle, one term per harmonic (torque ripple that is proportional to the
current, in contrast to cogging, which is there without one).
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from .ripple import force as wave

__all__ = ["EFFECT"]


@kernel
def force(c: Context, cosine: float, sine: float, period: float) -> float:
    return -c.push * wave(c, cosine, sine, period)


EFFECT = Effect(
    id="gain_ripple",
    place=Place.COMMAND_PATH,
    title="gain of the drive that repeats over position",
    equation="f = (1 + A cos(2 pi q / L) + B sin(2 pi q / L)) u",
    source="torque ripple in proportion to the current; one harmonic per term",
    parameters=(
        Parameter("cosine", "A", "1", "relative amplitude of the cosine over position", lower=-0.9, upper=0.9, default=0.0),
        Parameter("sine", "B", "1", "relative amplitude of the sine over position", lower=-0.9, upper=0.9, default=0.0),
        Parameter("period", "L", "x", "distance after which the gain repeats", positive=True),
    ),
    force=force,
    absent={"cosine": 0.0, "sine": 0.0},
    uses_push=True,
    regime="large forces, while accelerating too: the same share of the force is missing at the same place",
    looks_like={
        "ripple": "hold the axis against different loads: a ripple stays, what comes from the gain grows with the force",
        "position_dependence": "accelerate hard: friction over position stays, what comes from the gain grows with the force",
    },
    repeatable=True,
)
