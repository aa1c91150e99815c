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
from typing import Any

from ..effect import Context, Effect, Place
from ..engine.kernel import hidden, kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]

# The memory begins with how far the appendage is ahead of the body [x], and its velocity [x/s]. Then comes what the waves of
# the last step were for (the step [s], the mode's frequency [rad/s], its damping ratio) and these waves, which cost more than
# the rest of a step.


@kernel
def waves(h: float, w: float, zeta: float) -> tuple[float, float]:
    """The damped cosine, and the damped sine over its frequency [s], after ``h`` [s]."""
    s = zeta * w
    if zeta < 1.0:
        a = w * math.sqrt(1.0 - zeta * zeta)
        fading = math.exp(-s * h)
        return fading * math.cos(a * h), fading * math.sin(a * h) / a
    a = w * math.sqrt(zeta * zeta - 1.0)
    slow, fast = math.exp(-(s - a) * h), math.exp(-(s + a) * h)
    # (slow - fast)/(2 a), also where both are nearly the same
    return 0.5 * (slow + fast), slow * h if a * h < 1e-8 else -slow * math.expm1(-2.0 * a * h) / (2.0 * a)


@kernel
def known_waves(memory: Any, i: int, h: float, w: float, zeta: float) -> tuple[float, float]:
    """As :func:`waves`, but those of the last step where they are for the same."""
    if memory[i + 2] == h and memory[i + 3] == w and memory[i + 4] == zeta:
        return float(memory[i + 5]), float(memory[i + 6])
    return waves(hidden(h), w, zeta)


@kernel
def force(c: Context, i: int, mass: float, frequency: float, damping: float) -> float:
    w = 2.0 * math.pi * frequency
    r, rate = c.memory[i], c.memory[i + 1] - c.velocity
    if c.step <= 0.0:
        return float(-mass * w * (w * r + 2.0 * damping * rate))
    cosine, sine = known_waves(c.memory, i, c.step, w, damping)
    after = rate * (cosine - damping * w * sine) - w * w * r * sine
    return float(mass * (after - rate) / c.step)


@kernel
def remember(c: Context, base: float, i: int, mass: float, frequency: float, damping: float) -> None:
    w = 2.0 * math.pi * frequency
    s = damping * w
    r, rate = c.memory[i], c.memory[i + 1] - c.velocity
    cosine, sine = known_waves(c.memory, i, c.step, w, damping)
    c.memory[i] = r * (cosine + s * sine) + rate * sine
    c.memory[i + 1] = rate * (cosine - s * sine) - w * w * r * sine + c.velocity
    c.memory[i + 2], c.memory[i + 3], c.memory[i + 4] = c.step, w, damping
    c.memory[i + 5], c.memory[i + 6] = cosine, sine


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
    n_memory=7,
    velocities=(1,),
    rate=_rate,
    regime="after every quick change of the force: an oscillation that rides on the motion, always at the same frequency",
    looks_like={
        "ripple": "move at two speeds: a ripple's frequency follows the speed, a mode's doesn't",
        "impact_backlash": "excite it at graded amplitudes without reversal: a mode's frequency stays and it never lets go",
    },
    repeatable=True,
)
