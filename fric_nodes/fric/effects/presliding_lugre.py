"""Pre-sliding after LuGre: bristles that bend before the contact slides.

Equation: F = sigma_0 z + sigma_1 dz/dt, dz/dt = v - sigma_0 |v| / g(v) z, where g is the slip level of the other terms
(Coulomb, Stribeck, ...), so that steady sliding gives back exactly that level.
Source: Canudas de Wit, Olsson, Astrom, Lischinsky 1995; Amthor et al. 2008, Eqs. 2 to 4 (whose Eq. 4 prints the exponent
without its v_S; the viscous term sigma_2 v is the effect ``viscous``).

The step is exact for constant velocity: with r = sigma_0 |v| h / g and z_s = g sgn(v) / sigma_0,
z(h) = z_s + (z(0) - z_s) exp(-r), and its mean over the step is z_s + (z(0) - z_s) (1 - exp(-r)) / r. It therefore neither
loses stability at high speed, where the bristles are stiff, nor drifts from its bound |z| <= g / sigma_0.

With sigma_0 z^2/2 held by the bristles, what is dissipated is a quadratic form in v and z, which is never negative where
sigma_1 < 4 g/|v|. Beyond that, at high speed, damped bristles can push the body on for a moment after g has fallen.
"""

from __future__ import annotations

import math
from typing import Any

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def slip(z: Any, z_next: Any, i: int, v: float, h: float, level: float, stiffness: float, damping: float) -> float:
    z_0 = z[i]
    if level <= 0.0:
        z_next[i] = 0.0
        return 0.0
    fading = stiffness * abs(v) / level
    r = fading * h
    if r < 0.125:
        # Power series, where the closed forms lose their digits; in pairs, so that the processor can overlap them.
        r2 = r * r
        low = 1.0 / 2.0 - r / 6.0 + r2 * (1.0 / 24.0 - r / 120.0)
        high = 1.0 / 720.0 - r / 5040.0 + r2 * (1.0 / 40320.0 - r / 362880.0 + r2 * (1.0 / 3628800.0 - r / 39916800.0))
        psi = low + r2 * r2 * high
        phi = 1.0 - r * psi
    else:
        phi = (1.0 - (math.exp(-r) if r < 40.0 else 0.0)) / r
        psi = (1.0 - phi) / r
    z_rate = (v - fading * z_0) * phi
    z_next[i] = z_0 + h * z_rate
    return float(stiffness * (z_0 * phi + v * h * psi) + damping * z_rate)


def _rate(mass: float, stiffness: float, damping: float) -> float:
    """Natural frequency of the body on its bristles [1/s]."""
    return math.sqrt(stiffness / mass)


EFFECT = Effect(
    id="presliding",
    law="lugre",
    usual=True,
    place=Place.SLIP_DYNAMICS,
    title="pre-sliding displacement",
    equation="F = sigma_0 z + sigma_1 dz/dt, dz/dt = v - sigma_0 |v| z / g(v)",
    source="Canudas de Wit et al. 1995; Amthor et al. 2008, Eqs. 2-4",
    parameters=(
        Parameter("stiffness", "sigma_0", "F/x", "stiffness of the bristles", positive=True),
        Parameter("damping", "sigma_1", "F s/x", "damping of the bristles", lower=0.0, default=0.0),
    ),
    slip=slip,
    n_states=1,
    rate=_rate,
    regime="the first micrometres after each reversal and around rest",
    looks_like={
        "compliance": "measure the position on the load side too: a compliant transmission moves the motor, not the load"
    },
)
