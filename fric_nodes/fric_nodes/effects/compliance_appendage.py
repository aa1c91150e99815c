"""Appendage: a mass that hangs on the moving body by a spring and a damper; several of them are the body's several modes.

Equation: F = m_a dv_a/dt, dv_a/dt = -w^2 r - 2 zeta w dr/dt, dr/dt = v_a - v, with v_a the velocity of the appendage, r how
far it has got ahead of the body, and w = 2 pi f. One term is one mode of vibration of the structure behind the contact;
several add up to de Marchi's summed-mode compliance, with the dynamic mass

    M(s) = m + sum_i m_i (w_i^2 + 2 zeta_i w_i s)/(s^2 + 2 zeta_i w_i s + w_i^2)

between force and acceleration of the body. Well below f the appendage moves along, and the masses add up; f is what it has
while the body is held. De Marchi takes damping in proportion to frequency, which is one zeta for all modes.

Over a step at constant velocity of the body the equation is solved exactly, and the mean force on the body is the momentum
that the appendage takes, m_a (v_a(h) - v_a(0))/h: neither momentum nor energy is lost but in the damper. A run starts with the
appendage undeflected, moving as the body does.
Source: de Marchi 1998, summed-mode compliance, after Rayleigh 1877 and Thomson 1972.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]

# The memory: how far the appendage is ahead of the body [x], and its velocity [x/s].


@kernel
def propagated(r: float, v: float, h: float, w: float, zeta: float) -> tuple[float, float]:
    """Deflection and its rate after ``h`` [s], from ``r`` and ``v``, while the body's velocity stays constant."""
    s = zeta * w
    if zeta < 1.0:
        a = w * math.sqrt(1.0 - zeta * zeta)
        fading = math.exp(-s * h)
        cosine, sine = fading * math.cos(a * h), fading * math.sin(a * h) / a
    else:
        a = w * math.sqrt(zeta * zeta - 1.0)
        slow, fast = math.exp(-(s - a) * h), math.exp(-(s + a) * h)
        cosine = 0.5 * (slow + fast)
        # (slow - fast)/(2 a), also where both are nearly the same
        sine = slow * h if a * h < 1e-8 else -slow * math.expm1(-2.0 * a * h) / (2.0 * a)
    return r * (cosine + s * sine) + v * sine, v * (cosine - s * sine) - w * w * r * sine


@kernel
def force(c: Context, i: int, mass: float, frequency: float, damping: float) -> float:
    w = 2.0 * math.pi * frequency
    r, rate = c.memory[i], c.memory[i + 1] - c.velocity
    if c.step <= 0.0:
        return float(-mass * w * (w * r + 2.0 * damping * rate))
    _, after = propagated(r, rate, c.step, w, damping)
    return float(mass * (after - rate) / c.step)


@kernel
def remember(c: Context, base: float, i: int, mass: float, frequency: float, damping: float) -> None:
    w = 2.0 * math.pi * frequency
    r, rate = propagated(c.memory[i], c.memory[i + 1] - c.velocity, c.step, w, damping)
    c.memory[i] = r
    c.memory[i + 1] = rate + c.velocity


def _rate(moving: float, mass: float, frequency: float, damping: float) -> float:
    """Of body and appendage against each other."""
    return 2.0 * math.pi * frequency * math.sqrt(1.0 + mass / moving) * max(1.0, damping)


EFFECT = Effect(
    id="compliance",
    law="appendage",
    place=Place.TRANSMISSION,
    title="vibrating appendage of the moving body",
    equation="F = m_a dv_a/dt, dv_a/dt = -w^2 r - 2 zeta w dr/dt, dr/dt = v_a - v, w = 2 pi f",
    source="de Marchi 1998, summed-mode compliance; Rayleigh 1877; Thomson 1972",
    parameters=(
        Parameter(
            "mass", "m_a", "F s^2/x", "mass that takes part in the mode, not counted in the plant's", lower=0.0, linear=True
        ),
        Parameter("frequency", "f", "1/s", "natural frequency of the mode while the body is held [Hz]", positive=True),
        Parameter("damping", "zeta", "1", "damping ratio of the mode", lower=0.0, default=0.01),
    ),
    force=force,
    remember=remember,
    n_memory=2,
    velocities=(1,),
    rate=_rate,
    regime="after every quick change of the force: an oscillation that rides on the motion, always at the same frequency",
    looks_like={
        "ripple": "move at two speeds: a ripple's frequency follows the speed, a mode's doesn't",
        "impact_backlash": "excite it at graded amplitudes without reversal: a mode's frequency stays and it never lets go",
    },
    repeatable=True,
)
