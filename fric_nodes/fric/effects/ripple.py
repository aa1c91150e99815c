"""Ripple: a force that repeats along the travel, whatever the direction (cogging of a motor, pitch of a screw, gear mesh).

Equation: F = A cos(2 pi q / L) + B sin(2 pi q / L). It comes from a potential, so what it takes on one half of the period
it gives back on the other. Over a step at constant velocity, which takes the phase from p - d to p + d, its mean is the
value at p times sin(d)/d exactly; with it the energy balance closes whatever the step.
Source: cogging force of a permanent-magnet motor as a Fourier series; one term per harmonic.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def force(c: Context, cosine: float, sine: float, period: float) -> float:
    wave = 2.0 * math.pi / period
    phase = wave * c.position
    reach = 0.5 * wave * c.velocity * c.step
    r = reach * reach
    mean = 1.0 - r * (1.0 / 6.0 - r * (1.0 / 120.0 - r / 5040.0)) if r < 0.01 else math.sin(reach) / reach
    return (cosine * math.cos(phase) + sine * math.sin(phase)) * mean


EFFECT = Effect(
    id="ripple",
    place=Place.FORCE,
    title="force ripple",
    equation="F = A cos(2 pi q / L) + B sin(2 pi q / L)",
    source="cogging force as a Fourier series, one harmonic per term",
    parameters=(
        Parameter("cosine", "A", "F", "amplitude of the cosine over position", default=0.0, linear=True),
        Parameter("sine", "B", "F", "amplitude of the sine over position", default=0.0, linear=True),
        Parameter("period", "L", "x", "distance after which the force repeats", positive=True),
    ),
    force=force,
    regime="everywhere, at rest too: the force repeats along the travel, the same in both directions",
    looks_like={
        "position_dependence": "compare the two directions at one place: a ripple is the same in both, friction changes sign",
        "stiffness": "travel over more than one period: a spring's force doesn't come back",
    },
    repeatable=True,
)
