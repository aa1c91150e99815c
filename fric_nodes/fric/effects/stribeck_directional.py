"""Stribeck effect by direction: friction rises more at low speed in one direction of motion than in the other.

Equation: F = (S + D_S sgn(v)) exp(-(|v|/v_S)^delta) sgn(v), on top of the Coulomb level, with S the mean of both directions'
surplus F_S - F_C and D_S half their difference, forward minus backward: S + D_S forward, S - D_S backward. Both directions
have one Stribeck velocity. It is ``stribeck/exponential`` with the low-speed part of ``asymmetry/low_speed``, whose velocity
is the same, in one term. As what depends on direction it comes behind a frictional lag, which doesn't delay it.
Source: Canudas de Wit, Olsson, Astrom, Lischinsky 1995, after Eq. 3 (the level g(v) "need not be symmetrical", by which
direction-dependent behaviour is captured); Szell, Eq. 10, for the exponential.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from .stribeck import EFFECT as SYMMETRIC
from .stribeck import level as stribeck_level

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, force: float, difference: float, velocity: float, exponent: float) -> float:
    return stribeck_level(c, base, force + c.direction * difference, velocity, exponent)


def _rate(mass: float, force: float, difference: float, velocity: float, exponent: float) -> float:
    """As of the Stribeck effect, in the direction in which friction falls more: growth rate of a velocity, over 16 [1/s]."""
    return (force + abs(difference)) / (16.0 * velocity * mass)


EFFECT = Effect(
    id="stribeck",
    law="directional",
    place=Place.SLIP_LEVEL,
    order=20,
    title="Stribeck effect that differs by direction",
    equation="F = (S + D_S sgn(v)) exp(-(|v|/v_S)^delta) sgn(v)",
    source="Canudas de Wit, Olsson, Astrom, Lischinsky 1995, after Eq. 3; Szell, Eq. 10",
    parameters=(
        SYMMETRIC.parameters[0],
        Parameter(
            "difference",
            "D_S",
            "F",
            "half the difference of the surpluses, forward minus backward",
            default=0.0,
            linear=True,
        ),
        *SYMMETRIC.parameters[1:],
    ),
    level=level,
    form_of=SYMMETRIC.law,
    shows_alone=True,
    rate=_rate,
    regime="low speed: more force than at moderate speed, in one direction more than in the other",
    looks_like={
        "coulomb": "ladder of constant velocities: Stribeck friction falls on it, a Coulomb level stays",
        "asymmetry": "slow and fast strokes both ways: plain asymmetry stays at moderate speed, this difference is gone there",
        "accel_hysteresis": "cross low speed speeding up and slowing down: this is the same both ways, in either direction",
        "dwell_time": "repeat reversals with rests of graded length: only dwell time makes break-away depend on the rest",
    },
)
