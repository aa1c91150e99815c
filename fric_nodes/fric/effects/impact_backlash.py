"""Backlash with elastic-dissipative impact: a gap that ends at a spring and a damper, so that the sides rebound.

Equation: L = max(k a + c da/dt, 0) with the compression a = |y - q| - b/2 > 0. The stop only pushes: the sides part where its
force vanishes, while it is still compressed, and not where the compression does.

Derivation of the impact, with m the reduced mass m_m m_l/(m_m + m_l) and no other force, w_0 = sqrt(k/m),
zeta = c/(2 sqrt(k m)), s = zeta w_0, w_d = w_0 sqrt(1 - zeta^2): from contact at the closing speed v_0,

    da/dt = v_0 exp(-s t) (cos w_d t - (s/w_d) sin w_d t),
    L/m = -d^2a/dt^2 = v_0 exp(-s t) (2 s cos w_d t + (w_d - s^2/w_d) sin w_d t).

L vanishes at tan(w_d T) = -2 s w_d/(w_d^2 - s^2), that is w_d T = pi - 2 arcsin(zeta) = 2 arccos(zeta). There the bracket of
da/dt is cos(2 arccos zeta) - zeta/sqrt(1 - zeta^2) sin(2 arccos zeta) = -1, so that

    duration     T = 2 arccos(zeta) / w_d           (for zeta > 1: arcosh in place of arccos, and w_0 sqrt(zeta^2 - 1)),
    restitution  r = exp(-s T) = exp(-2 zeta arccos(zeta) / sqrt(1 - zeta^2)),
    impulse      m v_0 (1 + r),    energy lost  m v_0^2 (1 - r^2)/2.

Without damping T is pi/w_0 and r is 1; at zeta = 1 r is exp(-2), and for large zeta it goes as 1/(2 zeta)^2. Were the sides
held together until the compression vanishes, T would be pi/w_d and r = exp(-pi zeta/sqrt(1 - zeta^2)), the formula often
quoted: there the damper pulls at the end, which no two sides of a gap can. The damping and not the restitution is the
parameter, since the masses don't belong to this term; :func:`damping_for` gives the one from the other.
Source: de Marchi 1998 (after de Marchi and Craig 1997), backlash with impact effects; the restitution as in Schwager and
Poeschel 2007, derived anew.
"""

from __future__ import annotations

import math

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.elastic import stops

__all__ = ["EFFECT", "damping_for", "duration", "restitution"]


@kernel
def play(gap: float, stiffness: float, damping: float) -> float:
    return gap


@kernel
def link(e_0: float, e_1: float, h: float, free: float, gap: float, stiffness: float, damping: float) -> float:
    return stops(e_0, e_1, h, free, stiffness, 0.0, damping)


def _rate(mass: float, gap: float, stiffness: float, damping: float) -> float:
    """Of the impact: the sides on the spring, and what the damper does to them."""
    return math.sqrt(stiffness / mass) + 0.5 * damping / mass


def _phase(zeta: float) -> float:
    """arccos(zeta)/sqrt(1 - zeta^2), which goes on smoothly beyond zeta = 1."""
    if abs(zeta - 1.0) < 1e-6:
        return 1.0 - (zeta - 1.0) / 3.0
    if zeta < 1.0:
        return math.acos(zeta) / math.sqrt(1.0 - zeta * zeta)
    return math.acosh(zeta) / math.sqrt(zeta * zeta - 1.0)


def restitution(stiffness: float, damping: float, mass: float) -> float:
    """Rebound speed over closing speed.

    Args:
        stiffness: k [F/x].
        damping: c [F s/x].
        mass: the reduced mass of both sides [F s^2/x].
    """
    zeta = 0.5 * damping / math.sqrt(stiffness * mass)
    return math.exp(-2.0 * zeta * _phase(zeta))


def duration(stiffness: float, damping: float, mass: float) -> float:
    """How long an impact lasts [s]; arguments as of :func:`restitution`."""
    zeta = 0.5 * damping / math.sqrt(stiffness * mass)
    return 2.0 * _phase(zeta) * math.sqrt(mass / stiffness)


def damping_for(wanted: float, stiffness: float, mass: float) -> float:
    """The damping c [F s/x] that gives the restitution ``wanted``, in (0, 1]; arguments else as of :func:`restitution`.

    Raises:
        ValueError: no damping gives it.
    """
    if not 0.0 < wanted <= 1.0:
        raise ValueError(f"restitution is {wanted}, must be greater than 0 and at most 1")
    low, high = 0.0, 1.0 / wanted
    for _ in range(200):  # r falls with zeta, and lies below 1/(2 zeta)
        middle = 0.5 * (low + high)
        if -2.0 * middle * _phase(middle) > math.log(wanted):
            low = middle
        else:
            high = middle
    return (low + high) * math.sqrt(stiffness * mass)


EFFECT = Effect(
    id="impact_backlash",
    law="viscoelastic",
    usual=True,
    place=Place.TRANSMISSION,
    title="backlash with impact",
    equation="L = max(k a + c da/dt, 0) sgn(y - q), a = |y - q| - b/2 > 0",
    source="de Marchi 1998; de Marchi and Craig 1997",
    parameters=(
        Parameter("gap", "b", "x", "free play from stop to stop", lower=0.0),
        Parameter("stiffness", "k", "F/x", "stiffness of the stops", positive=True),
        Parameter("damping", "c", "F s/x", "damping of the stops while they touch", lower=0.0, default=0.0),
    ),
    play=play,
    link=link,
    rate=_rate,
    regime="after every reversal of the force: free motion through the gap, then blows whose rebounds die away",
    looks_like={
        "backlash": "look at the motor after it has crossed the gap: at elastic stops it rings, at rigid ones it doesn't",
        "compliance": "push the resting load gently: a motor crosses a gap without force; against a spring it needs one",
        "ripple": "cross the same place at another distance from the reversal: blows follow the reversal, a ripple the place",
    },
)
