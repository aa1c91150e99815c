"""The examiner's laws of force and friction, one function each, for the loop of :mod:`fric.diagnosis.prove.truth`.

Everything here is written from the papers once more. Where the concealed law must not be the candidate's own form (``form``
other than 0), the other form is one that the literature uses for the same mechanism: Hess and Soom 1990 and Tustin 1947 for
the fall of friction with speed, a power of the load, an Arrhenius-like change with temperature, a Lorentz curve for a tight
spot, a soft knee for an amplifier. The last form of each is one that fric has no law for: a hyperbolic secant for falls with
the speed, Vogel's viscosity, a spot with a flat top, a root of the load, drag of mixed powers, rest after Kato's root, a
lubricant that thins by a hyperbola.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit
from numba.core.options import DefaultOptions

__all__ = ["compiled", "compiled_loop", "given_force", "level_before_lag", "scaled", "smooth_force", "surplus_of_age"]

Function = TypeVar("Function", bound=Callable[..., Any])
_TWO_PI = 2.0 * math.pi
# Arrays are handed in, so that nothing needs its references counted, which would take longer than the physics.
_OPTIONS: dict[str, Any] = {
    "error_model": "numpy",
    "nogil": True,
    **({"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}),
}


def compiled(function: Function) -> Function:
    """``function`` as part of the loop."""
    return cast(Function, njit(**_OPTIONS, forceinline=True)(function))


def compiled_loop(function: Function) -> Function:
    """``function`` as the loop itself, whose machine code is kept on disk."""
    return cast(Function, njit(**_OPTIONS, cache=True)(function))


@compiled
def level_before_lag(p: Any, v: float, direction: float, rising: float, age: float) -> float:
    """Level [N] of Coulomb, Stribeck, acceleration-dependent and dwell parts, before lag, asymmetry and scalings."""
    speed = abs(v)
    g = p.coulomb
    if p.stribeck > 0.0:
        r = speed / p.stribeck_velocity
        if p.stribeck_form == 0.0:
            g += p.stribeck * math.exp(-r * r)
        elif p.stribeck_form == 1.0:
            g += p.stribeck / (1.0 + r * r)
        elif p.stribeck_form == 2.0:
            g += p.stribeck * math.exp(-r)
        else:
            g += p.stribeck / math.cosh(min(1.3 * r, 300.0))
    if p.acceleration > 0.0 and direction * rising >= 0.0:
        r = speed / p.acceleration_velocity
        if p.acceleration_form == 0.0:
            g += p.acceleration / (1.0 + r * r)
        elif p.acceleration_form == 1.0:
            g += p.acceleration * math.exp(-r * r)
        else:
            g += p.acceleration / math.cosh(min(1.3 * r, 300.0))
    if p.dwell > 0.0:
        g += surplus_of_age(p, age)
    return float(g)


@compiled
def surplus_of_age(p: Any, age: float) -> float:
    """Surplus of static friction [N] of a contact of this age [s]."""
    r = age / p.dwell_time
    if p.dwell_form == 1.0:
        return float(p.dwell * math.log(1.0 + r))
    if p.dwell_form == 2.0:
        return float(p.dwell * (1.0 - math.exp(-r)))
    if p.dwell_form == 3.0:
        return float(p.dwell * r / (1.0 + r))
    return float(p.dwell * (1.0 - math.exp(-math.sqrt(r))))


@compiled
def scaled(p: Any, g: float, q: float, direction: float, t: float, load: float, warmer: float, dirty: float) -> float:
    """The level [N] after asymmetry and everything that scales it, never below zero."""
    g += direction * p.asymmetry
    if p.load != 0.0:
        if p.load_form == 0.0:
            g *= 1.0 + p.load * (load - 1.0)
        elif p.load_form == 1.0:
            g *= load**p.load
        else:
            g *= 1.0 + 2.0 * p.load * (math.sqrt(load) - 1.0)
    if p.temperature != 0.0:
        if p.temperature_form == 0.0:
            g *= 1.0 + p.temperature * warmer
        elif p.temperature_form == 1.0:
            g *= math.exp(p.temperature * warmer)
        else:
            g *= math.exp(p.temperature * warmer / (1.0 + warmer / 90.0))
    if p.spot != 0.0:
        d = (q - p.spot_position) / p.spot_width
        if p.spot_form == 0.0:
            g *= 1.0 + p.spot * math.exp(-0.5 * d * d)
        elif p.spot_form == 1.0:
            g *= 1.0 + p.spot / (1.0 + d * d)
        elif abs(d) < 2.0:
            g *= 1.0 + 0.5 * p.spot * (1.0 + math.cos(math.pi * max(abs(d) - 1.0, 0.0)))
    if p.wave_cosine != 0.0 or p.wave_sine != 0.0:
        phase = _TWO_PI * q / p.wave_period
        g *= 1.0 + p.wave_cosine * math.cos(phase) + p.wave_sine * math.sin(phase)
    if p.drift != 0.0:
        g *= 1.0 + (p.drift * t if p.drift_time == 0.0 else p.drift * (1.0 - math.exp(-t / p.drift_time)))
    g *= 1.0 + p.dirt * dirty
    return max(g, 0.0)


@compiled
def sheared(p: Any, r: float) -> float:
    """Force [N] of a lubricant that thins while it is sheared, at ``r`` times its velocity."""
    if p.shear_form == 0.0:
        return float(p.shear * (1.0 - math.exp(-r)))
    if p.shear_form == 1.0:
        return float(0.5 * p.shear * r ** (2.0 / 3.0))
    return float(p.shear * r / (1.0 + r))


@compiled
def smooth_force(p: Any, q: float, v: float, t: float, warmer: float, thinned: float, pulled: float) -> float:
    """All forces [N] on the body but friction of the contact and drive, positive against positive motion."""
    f = p.bias + (p.viscous + p.temperature_viscous * warmer + p.thixotropy * thinned) * v + p.asymmetry_viscous * abs(v)
    if p.drag > 0.0:
        if p.drag_form == 0.0:
            f += p.drag * v * abs(v)
        elif p.drag_form == 1.0:
            f += p.drag * p.drag_velocity**0.25 * math.copysign(abs(v) ** 1.75, v)
        else:
            f += p.drag * v * abs(v) * (0.4 + 0.6 * abs(v) / p.drag_velocity)
    if p.shear > 0.0:
        f += math.copysign(sheared(p, abs(v) / p.shear_velocity), v)
    if p.ripple_cosine != 0.0 or p.ripple_sine != 0.0:
        phase = _TWO_PI * q / p.ripple_period
        f += p.ripple_cosine * math.cos(phase) + p.ripple_sine * math.sin(phase)
    if p.stiffness != 0.0:
        f += p.stiffness * (q - p.stiffness_position)
    if p.cubic != 0.0:
        d = q - p.cubic_position
        f += p.cubic * d * d * d
    if p.cable != 0.0:
        # The chain is paid out beyond its play and pulls only there; on the way back it lies slack until the play is used up.
        f += p.cable * max(pulled - p.cable_position, 0.0)
    if p.floor != 0.0:
        f += p.floor * math.sin(_TWO_PI * p.floor_frequency * t)
    return float(f)


@compiled
def given_force(p: Any, u: float) -> float:
    """What amplifier and dead zone make of the command ``u`` [N], without memory."""
    if p.limit > 0.0:
        u = max(-p.limit, min(p.limit, u)) if p.limit_form == 0.0 else u / (1.0 + abs(u / p.limit) ** 8) ** 0.125
    if p.dead_zone > 0.0:
        w = p.dead_zone
        if p.dead_zone_form == 0.0:
            u = max(u - w, 0.0) + min(u + w, 0.0)
        else:
            u -= w * math.tanh(u / w)
    return u
