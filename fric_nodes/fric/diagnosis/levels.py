"""Friction levels below zero: what can't be along a motion that the machine has made.

A law that adds to a friction level, or takes from it, is a law of friction only where the sum stays above zero: a negative
level would push the body on. Simulations therefore cut it off there, and a fit can make use of that: direction-dependent
friction in a model that has no other friction is friction in one direction and none in the other. Beside a few further terms it
then stands in for Coulomb and viscous friction, without a single value that looks odd.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..model import Model
from .motion import friction_along

if TYPE_CHECKING:
    from .track import Track

__all__ = ["negative_friction"]


def negative_friction(track: Track, model: Model) -> float:
    """Energy of friction levels below zero, as a share of the energy of all levels, while the axis moves; 0 to 1.

    Args:
        track: of the recordings: their measured motion.
        model: whose slip levels are summed up along it, whatever transmission or bristles it has.
    """
    contact = model.with_terms(
        held
        for held in model.terms
        if held.effect.slip is None and held.effect.play is None and held.effect.link is None and held.effect.command is None
    )
    if model.plant.led or not any(held.effect.level is not None for held in contact.terms):
        return 0.0
    below = whole = 0.0
    for k, (run, time, motion) in enumerate(zip(track.runs, track.time, track.motion, strict=True)):
        states = track.inner_states(contact, k, float(motion.velocity[0]))
        level = np.sign(motion.velocity) * friction_along(contact, run, time, motion, states)
        level = np.nan_to_num(level[np.abs(motion.velocity) > track.rest(k)], posinf=0.0, neginf=0.0)
        below += float(np.sum(np.minimum(level, 0.0) ** 2))
        whole += float(level @ level)
    return below / whole if whole > 0.0 else 0.0
