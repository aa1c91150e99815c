"""Lubricated linear bearing: stiction, transition, Coulomb friction by normal force, viscous friction.

Equations, as they are used here (v the velocity of the body, F_nb the normal force of its bearings):

    general (13):  v = 0: F = what holds the body, up to C_e + mu |F_nb|
                   v != 0: F = (C_e exp(-|v|/e_1) + mu |F_nb|) sgn(v) + D v
    simple (24):   the same without mu |F_nb|

Two things in the printed Eqs. 13, 18, 19, 22 and 24 can't be meant.

- exp(+|v|/e_1) grows without bound. The text below Eq. 19 says that the transition friction starts from its maximum in the
  stiction region and quickly dips as the body moves, and Figs. 11 and 12 show this: the exponent is negative. C_e is then
  the transition friction at v = 0, and e_1 the speed at which it has fallen to 1/e.
- mu F_nb carries the sign of the suspension force F_s = F_nb tan(theta - dtheta), not that of the velocity. So printed it isn't
  friction: on M_b v' = F_s - F it only makes the suspension weaker by the share mu/tan(theta - dtheta), and wherever
  F_s v < 0, while the body is being slowed down, it drives the body. The text calls it Coulomb friction, "in a direction
  opposite to the relative velocity", and explains the sign change of Eq. 22 by the direction of motion: it is mu |F_nb| sgn(v),
  which never delivers power. The hysteresis over velocity stays, since |F_nb| differs between speeding up and slowing down.

The body breaks away where the suspension force exceeds C_e + mu |F_s|/tan(theta - dtheta), so a break-away force F_S asks for
C_e = F_S (1 - mu/tan(theta)) (:func:`transition_force`); with mu >= tan(theta) the bearing would lock itself.

The functions give the law as a list of terms, for use with any plant that has a normal load; each is an effect of its own in
``effects/``, so that a fit or a diagnosis sees the parts.
Source: A. I. H. Al-Zughaibi, Nonlinear Dynamics 2018, Eqs. 11-24.
"""

from __future__ import annotations

import math

from ..model import ModelError, Term, term

__all__ = ["general", "simple", "transition_force"]


def general(
    friction_coefficient: float, transition: float, curvature: float, viscous: float, nominal_load: float
) -> tuple[Term, ...]:
    """The general form, Eq. 13.

    Args:
        friction_coefficient: mu [1].
        transition: C_e, transition friction at v = 0 [F].
        curvature: e_1 [x/s].
        viscous: D [F s/x].
        nominal_load: the normal force [F] that counts as the load 1, as the plant has it.

    Raises:
        ModelError: a value out of bounds.
    """
    by_load = term("load_dependence", "proportional", force=friction_coefficient * nominal_load)
    return (by_load, *simple(transition, curvature, viscous))


def simple(transition: float, curvature: float, viscous: float) -> tuple[Term, ...]:
    """The simple form without Coulomb friction, Eq. 24; arguments as of :func:`general`.

    Raises:
        ModelError: a value out of bounds.
    """
    return (
        term("stribeck", "exponential", force=transition, velocity=curvature, exponent=1.0),
        term("viscous", coefficient=viscous),
    )


def transition_force(break_away: float, friction_coefficient: float = 0.0, angle: float = 0.5 * math.pi) -> float:
    """C_e [F] with which the body breaks away at the suspension force ``break_away`` [F].

    Args:
        break_away: [F].
        friction_coefficient: mu [1].
        angle: theta, of the strut from the horizontal [rad].

    Raises:
        ModelError: the bearing locks itself, mu >= tan(theta).
    """
    share = friction_coefficient / math.tan(angle)
    if not 0.0 <= share < 1.0:
        problem = f"with friction coefficient {friction_coefficient:g} at {angle:g} rad the bearing locks itself"
        raise ModelError("lubricated bearing", problem, "take a friction coefficient below tan(angle)")
    return break_away * (1.0 - share)
