"""Backlash with an impact whose damping grows with the compression: no jump of the force at first contact.

Equation: L = max(k a (1 + lambda da/dt), 0) with the compression a = |y - q| - b/2 > 0. The force begins and ends at zero,
and the sides part where the compression vanishes.

Derivation of the impact, with m the reduced mass and no other force: m v dv/da = -k a (1 + lambda v) for v = da/dt, so that
v dv/(1 + lambda v) = -(k/m) a da. Over the impact the right side integrates to zero; with the closing speed v_0 and the rebound
speed r v_0 the left side gives

    lambda v_0 (1 + r) = ln((1 + lambda v_0)/(1 - lambda r v_0)),

whatever m and k: r falls with the closing speed, as 1 - (2/3) lambda v_0 where that is small. A blow so hard that
lambda v_0 is large rebounds with 1/lambda at most. The spring here is linear; the same r holds for any power of a.
Source: Hunt and Crossley 1975, Eq. for the force with exponent 1; the relation above is derived from it, exactly.
"""

from __future__ import annotations

import math

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.elastic import pushing

__all__ = ["EFFECT", "restitution"]


@kernel
def play(gap: float, stiffness: float, damping: float) -> float:
    return gap


@kernel
def link(e_0: float, e_1: float, h: float, free: float, gap: float, stiffness: float, damping: float) -> float:
    half = 0.5 * free
    gain = damping * (e_1 - e_0) / h
    forward = pushing(e_0 - half, e_1 - half, h, stiffness, 0.0, 0.0) * max(1.0 + gain, 0.0)
    backward = pushing(-e_0 - half, -e_1 - half, h, stiffness, 0.0, 0.0) * max(1.0 - gain, 0.0)
    return forward - backward


def _rate(mass: float, gap: float, stiffness: float, damping: float) -> float:
    """Of the sides on the spring; the damping bends the force, but doesn't make it stiff."""
    return 1.5 * math.sqrt(stiffness / mass)


def restitution(damping: float, speed: float) -> float:
    """Rebound speed over closing speed, for ``damping`` lambda [s/x] and the closing ``speed`` [x/s]."""
    d = damping * abs(speed)
    if d < 1e-3:
        return 1.0 - d * (2.0 / 3.0 - 4.0 / 9.0 * d)
    low, high = 0.0, min(1.0, (1.0 - 1e-15) / d)
    for _ in range(200):
        middle = 0.5 * (low + high)
        if d * (1.0 + middle) > math.log1p(d) - math.log1p(-d * middle):
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


EFFECT = Effect(
    id="impact_backlash",
    law="hunt_crossley",
    place=Place.TRANSMISSION,
    title="backlash with impact, damped with the compression",
    equation="L = max(k a (1 + lambda da/dt), 0) sgn(y - q), a = |y - q| - b/2 > 0",
    source="Hunt and Crossley 1975; de Marchi 1998",
    parameters=(
        Parameter("gap", "b", "x", "free play from stop to stop", lower=0.0),
        Parameter("stiffness", "k", "F/x", "stiffness of the stops", positive=True),
        Parameter("damping", "lambda", "s/x", "share that the force gains per closing speed", lower=0.0, default=0.0),
    ),
    play=play,
    link=link,
    rate=_rate,
    regime="after every reversal of the force: free motion through the gap, then blows; the harder, the less they rebound",
    looks_like={
        "backlash": "look at the motor after it has crossed the gap: at elastic stops it rings, at rigid ones it doesn't",
        "compliance": "push the resting load gently: a motor crosses a gap without force; against a spring it needs one",
    },
)
