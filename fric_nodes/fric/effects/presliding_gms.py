"""Pre-sliding after the generalised Maxwell-slip model (GMS): sticking and sliding elements side by side.

Equation: F = (1/M) sum_i (K d_i + sigma dd_i/dt); an element that sticks follows the motion, dd_i/dt = v, up to its limit, from
where on it slides: dd_i/dt = sgn(v) (C/g) (D_i - |d_i|), D_i = alpha_i g M/K. Here d_i is the deflection of element i, K/M its
stiffness, alpha_i g the force at which it slides, and g the slip level of the other terms, so that steady sliding gives back
exactly that level.
Source: Lampaert, Al-Bender, Swevers 2003; Lampaert et al. 2005; Amthor et al. 2008, Eqs. 5 to 7 (viscous friction, ``fcn``
there, is the effect ``viscous``). It succeeds the Leuven model (Swevers et al. 2000, Lampaert et al. 2002) of the same group,
which keeps the hysteresis of the same elements on a stack of reversal points and lets one state equation follow it; the
elements need no stack, and their attraction C gives the frictional lag that the Leuven model has from its state equation.

Few parameters for many elements: they share the stiffness evenly, and their limits are chosen so that the first loading runs
along a smooth curve of slope dF/dq = K (1 - xi/xi_p)^n, xi = K q/g, which reaches g at xi_p = n + 1. Element i of M slides from
xi_i = xi_p (1 - (1 - (i - 1/2)/M)^(1/n)) on; alpha_i = xi_i / sum xi.

Three things the papers leave open are settled here, such that no element can deliver energy:

* A sliding element whose level rises is pulled up by its attraction even where the body hardly moves, as printed. Here its
  deflection never grows faster than the body moves: an element that would slide backwards sticks.
* An element bent beyond its limit (the load has fallen, say) slides back to it with the same attraction, also at rest and while
  it is being unloaded.
* Damping acts on deflections only as far as they follow the motion, not on an element that gives way to a falling level.

An element sticks again when the velocity reverses. The step is exact for constant velocity and level: between the instants
where an element begins or ends to slide, its deflection is linear or exponential in time. States: the M deflections, then for
each element whether it slides; the latter counts as true above 1/2.
"""

from __future__ import annotations

import math
from typing import Any

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def fading(r: float) -> tuple[float, float]:
    """exp(-r) and its mean over [0, r]."""
    if r < 1e-3:
        return 1.0 - r * (1.0 - r * (0.5 - r / 6.0)), 1.0 - r * (0.5 - r * (1.0 / 6.0 - r / 24.0))
    e = math.exp(-r)
    return e, (1.0 - e) / r


@kernel
def pulled_up(d: float, limit: float, x: float, r: float) -> tuple[float, float]:
    """A sliding element so far below its limit that at first it can but stretch as the body moves: ``x < r (limit - d)``.

    ``x`` is the displacement and ``r`` the attraction times the step. Deflection after the step, and its mean.
    """
    start = limit - x / r
    if start - d >= x:
        return d + x, d + 0.5 * x
    stick = (start - d) / x
    e, e_mean = fading(r * (1.0 - stick))
    gap = start - limit
    return limit + gap * e, 0.5 * stick * (d + start) + (1.0 - stick) * (limit + gap * e_mean)


@kernel
def unloaded(d: float, limit: float, x: float, r: float) -> tuple[float, float, float]:
    """An element bent against the motion beyond its limit, ``d < -limit``: it slides back until unloading is the faster.

    Deflection then, its mean until then, and the share of the step that it took.
    """
    over = -limit - d
    if over * r <= x:
        return d, d, 0.0
    share = min(math.log(over * r / x) / r, 1.0) if x > 0.0 else 1.0
    e, e_mean = fading(r * share)
    return -limit - over * e, -limit - over * e_mean, share


@kernel
def stuck(d: float, limit: float, x: float, r: float) -> tuple[float, float, float, float]:
    """An element that sticks at first: deflection after the step, its mean, how far it followed, and 1.0 if it slides then."""
    before = 0.0
    used = 0.0
    if d < -limit:
        d, before, used = unloaded(d, limit, x, r)
    left = 1.0 - used
    way = left * x
    room = limit - d
    if way < room:
        return d + way, used * before + left * (d + 0.5 * way), x, 0.0
    stick = room / way if way > 0.0 else 0.0
    return limit, used * before + left * (limit - 0.5 * room * stick), used * x + room, 1.0


@kernel
def prepare(k: Any, j: int, stiffness: float, attraction: float, exponent: float, elements: float, damping: float) -> None:
    """The elements' limits for a slip level of one [x/F]."""
    m = int(elements + 0.5)
    total = 0.0
    for n in range(m):
        k[j + n] = 1.0 - (1.0 - (n + 0.5) / m) ** (1.0 / exponent)
        total += k[j + n]
    for n in range(m):
        k[j + n] *= m / (total * stiffness)


@kernel
def slip(
    z: Any, z_next: Any, i: int, v: float, h: float, level: float, k: Any, j: int,
    stiffness: float, attraction: float, exponent: float, elements: float, damping: float,
) -> float:  # fmt: skip
    m = int(elements + 0.5)
    if level <= 0.0:
        for n in range(2 * m):
            z_next[i + n] = 0.0
        return 0.0
    s = 1.0 if v >= 0.0 else -1.0
    x = abs(v) * h
    r = attraction * h / level
    e, e_mean = fading(r)  # of what slides towards its limit; here, not when first needed, so that elements don't wait for it
    bent = 0.0
    followed = 0.0
    for n in range(m):
        d = s * z[i + n]
        limit = k[j + n] * level
        gap = d - limit
        if gap > 0.0 or (d > 0.0 and z[i + m + n] > 0.5):
            on = 1.0
            if gap == 0.0:
                end, mean = d, d
            elif x >= -r * gap:
                end, mean = limit + gap * e, limit + gap * e_mean
            else:
                end, mean = pulled_up(d, limit, x, r)
            followed += max(end - d, 0.0)
        elif x < -gap and d >= -limit:
            end, mean, on = d + x, d + 0.5 * x, 0.0
            followed += x
        else:
            end, mean, way, on = stuck(d, limit, x, r)
            followed += way
        z_next[i + n] = s * end
        z_next[i + m + n] = on
        bent += mean
    if v == 0.0:
        for n in range(m):  # at rest neither direction counts
            z_next[i + m + n] = z[i + m + n]
    share = followed / x if x > 0.0 else 0.0
    return (s * stiffness * bent + damping * v * share) / m


def _elements(stiffness: float, attraction: float, exponent: float, elements: float, damping: float) -> int:
    return int(elements + 0.5)


def _states(stiffness: float, attraction: float, exponent: float, elements: float, damping: float) -> int:
    return 2 * int(elements + 0.5)


def _rate(mass: float, stiffness: float, attraction: float, exponent: float, elements: float, damping: float) -> float:
    """Natural frequency of the body on its elements [1/s]."""
    return math.sqrt(stiffness / mass)


EFFECT = Effect(
    id="presliding",
    law="gms",
    place=Place.SLIP_DYNAMICS,
    title="pre-sliding displacement",
    equation="F = (1/M) sum (K d_i + sigma dd_i/dt), dd_i/dt = v, sliding: dd_i/dt = sgn(v) (C/g) (D_i - |d_i|)",
    source="Lampaert et al. 2005; Amthor et al. 2008, Eqs. 5-7",
    parameters=(
        Parameter("stiffness", "K", "F/x", "stiffness of all elements together, with which motion begins", positive=True),
        Parameter(
            "attraction", "C", "F/s", "how fast sliding elements follow the slip level: with the rate C/g", positive=True
        ),
        Parameter(
            "exponent",
            "n",
            "1",
            "shape of the first loading: its slope falls as (1 - xi/(n + 1))^n",
            lower=0.1,
            upper=10.0,
            default=2.0,
            shape=True,
            also=(4.0,),
        ),
        Parameter("elements", "M", "1", "number of elements, a whole number", lower=1.0, upper=32.0, default=10.0, shape=True),
        Parameter("damping", "sigma", "F s/x", "damping while all elements stick", lower=0.0, default=0.0),
    ),
    slip=slip,
    n_states=_states,
    n_constants=_elements,
    prepare=prepare,
    rate=_rate,
    regime="the first micrometres after each reversal and around rest, small loops inside large ones, and lag while sliding",
    looks_like={
        "compliance": "measure the position on the load side too: a compliant transmission moves the motor, not the load",
        "frictional_lag": "reverse within the first micrometres: lag alone has no elastic loops there",
    },
)
