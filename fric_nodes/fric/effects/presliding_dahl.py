"""Pre-sliding after Dahl: a spring that softens towards the slip level.

Equation: dF/dq = sigma |y|^n sgn(y), y = 1 - F sgn(v)/g, where g is the slip level of the other terms, so that steady sliding
gives back exactly that level.
Source: Dahl 1968; Amthor et al. 2008, Eq. 1, where n is called alpha and y^n is printed without |y| and sgn(y), which make the
law hold for any n and for a force above a level that has fallen.

The step is exact for constant velocity and level. With r = sigma |v| t / g the law reads dy/dr = -|y|^n sgn(y); with |y_0| = a,
rho = r a^(n-1) and y = y_0 w it becomes dw/drho = -w^n, so

    w = (1 + (n - 1) rho)^(-1/(n-1)) = exp(-L),  L = log(1 + (n - 1) rho)/(n - 1)  (n = 1: L = rho),

and w = 0 from rho = 1/(1 - n) on where n < 1: the level is reached after a finite way. The mean of w over the step is
(1 - exp(-(2 - n) L))/((2 - n) rho) (n = 2: L/rho). Deflection F/sigma is the state.
"""

from __future__ import annotations

import math
from typing import Any

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]

_LARGEST = 1e300  # keeps rho finite, where all that is left of y is far below rounding


@kernel
def faded(x: float, rate: float) -> float:
    """(1 - exp(-rate x)) / rate, also at rate 0."""
    product = rate * x
    if abs(product) < 1e-300:
        return x
    return x * (-math.expm1(-product) / product)


@kernel
def progress(rho: float, e: float) -> tuple[float, float]:
    """How much of y is gone after ``rho``, 1 - w, and the mean of that on the way, for an exponent n = 1 + ``e``."""
    x = e * rho
    if x <= -1.0:
        return 1.0, 1.0 - 1.0 / ((1.0 - e) * rho)
    length = rho * (math.log1p(x) / x) if abs(x) > 1e-300 else rho
    gone = -math.expm1(-length)
    if rho * max(1.0, abs(e)) < 0.05:
        # The power series of w, where the closed form of the mean loses its digits.
        coefficient = -rho
        mean = 0.5 * rho
        for k in range(1, 16):
            coefficient *= -rho * (1.0 + k * e) / (k + 1)
            mean -= coefficient / (k + 2)
            if abs(coefficient) <= 1e-18 * rho:
                break
        return gone, mean
    return gone, 1.0 - faded(length, 1.0 - e) / rho


@kernel
def slip(z: Any, z_next: Any, i: int, v: float, h: float, level: float, stiffness: float, exponent: float) -> float:
    z_0 = z[i]
    if level <= 0.0:
        z_next[i] = 0.0
        return 0.0
    r = stiffness * abs(v) * h / level
    length = level / stiffness if v >= 0.0 else -level / stiffness
    y = 1.0 - z_0 / length
    if r == 0.0 or y == 0.0:
        z_next[i] = z_0
        return float(stiffness * z_0)
    e = exponent - 1.0
    rho = r if e == 0.0 else min(r * abs(y) ** e, _LARGEST)
    gone, gone_mean = progress(rho, e)
    z_next[i] = z_0 + length * y * gone
    return float(stiffness * (z_0 + length * y * gone_mean))


def _rate(mass: float, stiffness: float, exponent: float) -> float:
    """Natural frequency of the body on a spring as stiff as the law is between the start and a reversal [1/s]."""
    return math.sqrt(stiffness * max(1.0, 2.0 ** (exponent - 1.0)) / mass)


EFFECT = Effect(
    id="presliding",
    law="dahl",
    place=Place.SLIP_DYNAMICS,
    title="pre-sliding displacement",
    equation="dF/dq = sigma |1 - F sgn(v)/g|^n sgn(1 - F sgn(v)/g)",
    source="Dahl 1968; Amthor et al. 2008, Eq. 1",
    parameters=(
        Parameter("stiffness", "sigma", "F/x", "stiffness with which motion begins", positive=True),
        Parameter(
            "exponent", "n", "1", "shape: below 1 brittle, above 1 ductile", lower=0.0, upper=10.0, default=1.0, shape=True
        ),
    ),
    slip=slip,
    n_states=1,
    rate=_rate,
    regime="the first micrometres after each reversal and around rest",
    looks_like={
        "compliance": "measure the position on the load side too: a compliant transmission moves the motor, not the load"
    },
)
