"""Pre-sliding after Maxwell slip: up to ten springs in parallel, each on a slider of its own.

Equation: F = sum_i k_i d_i, d_i(t + h) = sgn(d_i(t) + dq) min(|d_i(t) + dq|, D_i), D_i = Delta_i g / sum_j k_j Delta_j, with dq
the displacement in the step and g the slip level of the other terms.
Source: Amthor et al. 2008, Eq. 11, after Rizos and Fassois.

Eq. 11 has fixed limits Delta_i, so that steady sliding gives sum_i k_i Delta_i whatever else the model says. Here the limits
scale with the slip level, so that steady sliding gives back that level, and load, temperature or position act on it as on every
other law; where the level equals sum_i k_i Delta_i (write that as the Coulomb force), this is Eq. 11. The stiffnesses don't
scale: a spring whose limit falls is let go, and no energy comes from it. As to the limits, only their proportions count.

An element without stiffness or without limit is not there. The step is exact for any velocity: Eq. 11 holds for its end, and
the mean force follows from each element's deflection being linear until its limit.
"""

from __future__ import annotations

import math
from typing import Any

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]

_ELEMENTS = 10


@kernel
def prepare(
    k: Any, j: int,
    stiffness_1: float, limit_1: float, stiffness_2: float, limit_2: float, stiffness_3: float, limit_3: float,
    stiffness_4: float, limit_4: float, stiffness_5: float, limit_5: float, stiffness_6: float, limit_6: float,
    stiffness_7: float, limit_7: float, stiffness_8: float, limit_8: float, stiffness_9: float, limit_9: float,
    stiffness_10: float, limit_10: float,
) -> None:  # fmt: skip
    """The elements' stiffnesses [F/x], then their limits for a slip level of one [x/F]."""
    given = (
        (stiffness_1, limit_1), (stiffness_2, limit_2), (stiffness_3, limit_3), (stiffness_4, limit_4),
        (stiffness_5, limit_5), (stiffness_6, limit_6), (stiffness_7, limit_7), (stiffness_8, limit_8),
        (stiffness_9, limit_9), (stiffness_10, limit_10),
    )  # fmt: skip
    total = 0.0
    for stiffness, limit in given:
        total += stiffness * limit
    for e in range(_ELEMENTS):
        stiffness, limit = given[e]
        k[j + e] = stiffness
        k[j + _ELEMENTS + e] = limit / total if stiffness > 0.0 else 0.0


@kernel
def slip(
    z: Any, z_next: Any, i: int, v: float, h: float, level: float, k: Any, j: int,
    stiffness_1: float, limit_1: float, stiffness_2: float, limit_2: float, stiffness_3: float, limit_3: float,
    stiffness_4: float, limit_4: float, stiffness_5: float, limit_5: float, stiffness_6: float, limit_6: float,
    stiffness_7: float, limit_7: float, stiffness_8: float, limit_8: float, stiffness_9: float, limit_9: float,
    stiffness_10: float, limit_10: float,
) -> float:  # fmt: skip
    dq = v * h
    mean = 0.0
    for e in range(_ELEMENTS):
        limit = k[j + _ELEMENTS + e] * max(level, 0.0)
        # A limit that has fallen lets go at once.
        d = min(max(z[i + e], -limit), limit)
        end = d + dq
        way = 0.5 * dq
        if abs(end) > limit:
            end = math.copysign(limit, dq)
            room = end - d
            way = room - 0.5 * room * (room / dq)
        z_next[i + e] = end
        mean += k[j + e] * (d + way)
    return mean


def _rate(mass: float, *values: float) -> float:
    """Natural frequency of the body on all springs together [1/s]."""
    return math.sqrt(sum(k for k, limit in zip(values[::2], values[1::2], strict=True) if limit > 0.0) / mass)


def _parameters() -> tuple[Parameter, ...]:
    declared: list[Parameter] = []
    for e in range(1, _ELEMENTS + 1):
        default = None if e == 1 else 0.0
        declared += (
            Parameter(
                f"stiffness_{e}", f"k_{e}", "F/x", f"stiffness of element {e}", lower=0.0, default=default, positive=e == 1
            ),
            Parameter(
                f"limit_{e}", f"Delta_{e}", "x", f"displacement from which element {e} slides, at the level sum k_j Delta_j",
                lower=0.0, default=default, positive=e == 1, shape=True,
            ),
        )  # fmt: skip
    return tuple(declared)


EFFECT = Effect(
    id="presliding",
    law="maxwell_slip",
    place=Place.SLIP_DYNAMICS,
    title="pre-sliding displacement",
    equation="F = sum k_i d_i, d_i(t + h) = sgn(d_i + dq) min(|d_i + dq|, D_i), D_i = Delta_i g / sum k_j Delta_j",
    source="Amthor et al. 2008, Eq. 11",
    parameters=_parameters(),
    slip=slip,
    n_states=_ELEMENTS,
    n_constants=2 * _ELEMENTS,
    prepare=prepare,
    rate=_rate,
    regime="the first micrometres after each reversal and around rest, small loops inside large ones",
    looks_like={
        "compliance": "measure the position on the load side too: a compliant transmission moves the motor, not the load"
    },
)
