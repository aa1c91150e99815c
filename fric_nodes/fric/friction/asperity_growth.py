"""How the local friction coefficient of an asperity grows with the time of contact: seven laws, compiled.

Relative to a fresh contact it is mu*(theta), theta the time of contact over its characteristic time, M the parameter
``growth``:

=== ==================== ===================================================== ======================
 #   name                 mu*(theta)                                            Al-Bender et al. 2004
=== ==================== ===================================================== ======================
 0   exponential          1 + (M - 1) (1 - exp(-theta))                         Eq. 1
 1   stretched            1 + (M - 1) (1 - exp(-theta^beta))                    Appendix I, Eq. 34
 2   exponential_power    M (1 - exp(-theta^beta))^gamma                        Eq. 35
 3   hyperbolic           1 + (M - 1) theta / (theta + 1)                       Eq. 36
 4   power                1 + (M - 1) theta^beta                                Eq. 37
 5   root                 M / ((M - 1)/sqrt(theta + 1) + 1)                     Eq. 38
 6   logarithmic          1 + (M - 1) log(1 + theta)                            Eq. 39
=== ==================== ===================================================== ======================

Eqs. 36 and 39 fall with time as printed, while the text says that all functions rise; Eq. 38 has lost its fraction bars in
print. Both are taken as in the effects ``dwell_time``. Law 2 begins at zero: there mu* is relative to M over the growth.

All of them are concave for beta <= 1 and gamma <= 1. Then, at constant speed, an asperity that sticks begins to slip at most
once in a step, and the time can be found by Newton's method from the right without a safeguard.

A contact's age is kept as a clock: exp(-theta) for law 0, which a step leads on by one multiplication, theta for the others.
Source: Al-Bender, Lampaert, Swevers 2004, Eq. 1 and Appendix I, after Gitis and Volpe.

Machine code of what inlines these is kept on disk with :mod:`fric.friction.asperity_loops`, and numba looks at the date
of that file alone: whoever changes an equation here must touch that file too.
"""

from __future__ import annotations

import math

from ..engine.kernel import kernel

__all__ = ["GROWTH_LAWS", "aged", "fresh", "growth_rate", "impulse", "strength"]

GROWTH_LAWS = ("exponential", "stretched", "exponential_power", "hyperbolic", "power", "root", "logarithmic")
"""Names of the laws; their places are the numbers by which the compiled functions know them."""

# Gauss-Legendre nodes and weights on [0, 1], six of them.
_NODES = (0.033765242898424, 0.169395306766868, 0.380690406958402, 0.619309593041598, 0.830604693233132, 0.966234757101576)
_WEIGHTS = (0.085662246189585, 0.180380786524069, 0.233956967286346, 0.233956967286346, 0.180380786524069, 0.085662246189585)


@kernel
def fresh(law: int) -> float:
    """The clock of a contact that begins."""
    return 1.0 if law == 0 else 0.0


@kernel
def aged(law: int, clock: float, r: float) -> float:
    """The clock after ``r`` characteristic times."""
    if law == 0:
        return clock * math.exp(-r)
    return clock + r


@kernel
def strength(law: int, clock: float, growth: float, beta: float, gamma: float) -> float:
    """mu* at this clock."""
    if law == 0:
        return growth - (growth - 1.0) * clock
    if law == 1:
        return growth - (growth - 1.0) * math.exp(-(clock**beta))
    if law == 2:
        return float(growth * (-math.expm1(-(clock**beta))) ** gamma)
    if law == 3:
        return 1.0 + (growth - 1.0) * clock / (clock + 1.0)
    if law == 4:
        return float(1.0 + (growth - 1.0) * clock**beta)
    if law == 5:
        return growth / ((growth - 1.0) / math.sqrt(clock + 1.0) + 1.0)
    return 1.0 + (growth - 1.0) * math.log1p(clock)


@kernel
def growth_rate(law: int, clock: float, growth: float, beta: float, gamma: float) -> float:
    """D mu*/d theta at this clock; infinite for a fresh contact where the law rises like a root."""
    rise = growth - 1.0
    if law == 0:
        return rise * clock
    if law == 1:
        p = clock**beta
        return rise * math.exp(-p) * beta * p / clock if clock > 0.0 else (rise if beta == 1.0 else math.inf)
    if law == 2:
        if clock <= 0.0:
            return growth if beta * gamma == 1.0 else math.inf
        p = clock**beta
        return float(growth * gamma * (-math.expm1(-p)) ** (gamma - 1.0) * math.exp(-p) * beta * p / clock)
    if law == 3:
        return rise / ((clock + 1.0) * (clock + 1.0))
    if law == 4:
        return rise * beta * clock**beta / clock if clock > 0.0 else (rise if beta == 1.0 else math.inf)
    if law == 5:
        s = math.sqrt(clock + 1.0)
        return growth * rise / (2.0 * s * (rise + s) * (rise + s))
    return rise / (1.0 + clock)


@kernel
def _by_quadrature(law: int, clock: float, r: float, growth: float, beta: float, gamma: float) -> float:
    # In a variable in which the law rises from a fresh contact as a fourth power, and time smoothly too; in four pieces.
    power = 4.0 / beta if law == 1 else 4.0 / (beta * gamma)
    low = clock ** (1.0 / power)
    width = 0.25 * ((clock + r) ** (1.0 / power) - low)
    total = 0.0
    for piece in range(4):
        for m in range(6):
            s = low + width * (piece + _NODES[m])
            total += _WEIGHTS[m] * power * s ** (power - 1.0) * strength(law, s**power, growth, beta, gamma)
    return float(width * total)


@kernel
def impulse(law: int, clock: float, r: float, growth: float, beta: float, gamma: float) -> float:
    """Integral of mu* over the next ``r`` characteristic times: closed for laws 0 and 3 to 6, quadrature for the others."""
    rise = growth - 1.0
    if law == 0:
        return growth * r + rise * clock * math.expm1(-r)
    if law == 3:
        return r + rise * (r - math.log1p(r / (clock + 1.0)))
    if law == 4:
        if clock == 0.0:
            return float(r + rise * r ** (beta + 1.0) / (beta + 1.0))
        # Written so that a short time after a long one keeps its digits.
        x = r / clock
        return float(r + rise * clock ** (beta + 1.0) * math.expm1((beta + 1.0) * math.log1p(x)) / (beta + 1.0))
    if law == 5:
        s = math.sqrt(clock + 1.0)
        d = r / (math.sqrt(clock + r + 1.0) + s)
        return growth * (r - 2.0 * rise * d + 2.0 * rise * rise * math.log1p(d / (rise + s)))
    if law == 6:
        end = clock + r
        return r + rise * ((end + 1.0) * math.log1p(end) - (clock + 1.0) * math.log1p(clock) - r)
    return _by_quadrature(law, clock, r, growth, beta, gamma)
