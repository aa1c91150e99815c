"""Pre-sliding after the elasto-plastic model: bristles that bend without slipping before they break away.

Equation: F = sigma_0 z + sigma_1 dz/dt, dz/dt = v (1 - alpha(z, v) z / z_ss), z_ss = g sgn(v) / sigma_0, where g is the slip
level of the other terms, and with z_ba = beta |z_ss|

    alpha = 0                                                      where z and v have opposite signs or |z| <= z_ba,
    alpha = (1 + sin(pi (|z| - (z_ba + |z_ss|)/2) / (|z_ss| - z_ba)))/2    in between,
    alpha = 1                                                      from |z| = |z_ss| on.

Below z_ba the displacement is purely elastic, so that a load that stays below beta g moves the body to and fro but never on.
As for LuGre, no energy is delivered while sigma_1 < 4 g/|v|.
Source: Dupont, Hayward, Armstrong, Altpeter 2002 (the viscous term sigma_2 v is the effect ``viscous``).

At constant velocity the law depends on the displacement alone. With c = |z/z_ss| and r = |v| t / |z_ss| it reads
dc/dr = 1 - alpha c. Where alpha = 0 the step is z + v h, to the last bit; where alpha = 1 it is an exponential. In between,
with eps = 1 - c and theta = pi eps / (1 - beta), alpha = cos^2(theta/2), so

    deps/dr = -(eps + (1 - eps) sin^2(theta/2)),

which no subtraction spoils as eps goes to zero. It is integrated by classic Runge-Kutta steps in each of which eps falls by
some per cent, until theta is so small that sin^2(theta/2) is theta^2/4; from there on, with k = pi^2 / (4 (1 - beta)^2),
eps = 1/((1/eps_0 + k) exp(r) - k).
"""

from __future__ import annotations

import math
from typing import Any

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]

_SHARE = 0.04  # by which eps falls in one Runge-Kutta step at most
_SMALL = 1e-3  # theta from which sin(theta/2) is theta/2


@kernel
def falling(eps: float, scale: float) -> float:
    """-deps/dr on the ramp; ``scale`` is theta/2 per eps."""
    sine = math.sin(scale * eps)
    return eps + (1.0 - eps) * sine * sine


@kernel
def ramp(eps: float, r: float, scale: float) -> tuple[float, float]:
    """Lead ``eps`` over ``r``: how much it falls, and the integral of its fall over r."""
    fallen = 0.0
    area = 0.0
    for _ in range(1000):
        if 2.0 * scale * eps <= _SMALL:
            break
        f_1 = falling(eps, scale)
        step = min(_SHARE * eps / f_1, r)
        f_2 = falling(eps - 0.5 * step * f_1, scale)
        f_3 = falling(eps - 0.5 * step * f_2, scale)
        f_4 = falling(eps - step * f_3, scale)
        # The integral takes the same Runge-Kutta step.
        area += step * (fallen + step * (f_1 + f_2 + f_3) / 6.0)
        fall = step * (f_1 + 2.0 * (f_2 + f_3) + f_4) / 6.0
        fallen += fall
        eps -= fall
        r -= step
        if r <= 0.0:
            return fallen, area
    k = scale * scale
    # The closed form's fall, and its integral; that of eps itself is log(1 + k eps_0 (1 - exp(-r))) / k.
    gone = -math.expm1(-r)
    fall = eps * gone * (1.0 + k * eps) / (1.0 + k * eps * gone)
    return fallen + fall, area + fallen * r + (eps * r - math.log1p(k * eps * gone) / k)


@kernel
def slip(
    z: Any, z_next: Any, i: int, v: float, h: float, level: float, stiffness: float, damping: float, breakaway: float
) -> float:
    z_0 = z[i]
    if level <= 0.0:
        z_next[i] = 0.0
        return 0.0
    length = level / stiffness
    elastic = breakaway * length
    dq = v * h
    end = z_0 + dq
    # Bent against the motion or not up to z_ba, even at the end of the step.
    if (dq >= 0.0 and end <= elastic) or (dq <= 0.0 and -end <= elastic):
        z_next[i] = end
        return float(stiffness * (z_0 + 0.5 * dq) + damping * v)
    s = 1.0 if dq > 0.0 else -1.0
    x = abs(dq)
    bent = s * z_0
    # First elastically up to z_ba: the part ``free`` of the step, in which bent grows by ``way``.
    way = max(elastic - bent, 0.0)
    free = way / x
    r = (x - way) / length
    eps = 1.0 - max(bent, elastic) / length
    if eps > 0.0:
        fall, area = ramp(eps, r, 0.5 * math.pi / (1.0 - breakaway))
    else:
        # Beyond z_ss, since the level has fallen: alpha = 1.
        gone = -math.expm1(-r)
        fall = eps * gone
        area = eps * (r - gone)
    rise = way + length * fall
    z_next[i] = z_0 + s * rise
    mean = way * (1.0 - 0.5 * free) + length * area * (length / x)
    return float(stiffness * (z_0 + s * mean) + damping * v * (rise / x))


def _rate(mass: float, stiffness: float, damping: float, breakaway: float) -> float:
    """Natural frequency of the body on its bristles [1/s]."""
    return math.sqrt(stiffness / mass)


EFFECT = Effect(
    id="presliding",
    law="elasto_plastic",
    place=Place.SLIP_DYNAMICS,
    title="pre-sliding displacement",
    equation="F = sigma_0 z + sigma_1 dz/dt, dz/dt = v (1 - alpha(z, v) sigma_0 z sgn(v) / g)",
    source="Dupont, Hayward, Armstrong, Altpeter 2002",
    parameters=(
        Parameter("stiffness", "sigma_0", "F/x", "stiffness of the bristles", positive=True),
        Parameter("damping", "sigma_1", "F s/x", "damping of the bristles", lower=0.0, default=0.0),
        Parameter(
            "breakaway",
            "beta",
            "1",
            "share of the slip level up to which displacement is purely elastic",
            lower=0.01,
            upper=0.99,
            default=0.7,
            shape=True,
        ),
    ),
    slip=slip,
    n_states=1,
    rate=_rate,
    regime="the first micrometres after each reversal and around rest, without drift under a small oscillating load",
    looks_like={
        "compliance": "measure the position on the load side too: a compliant transmission moves the motor, not the load"
    },
)
