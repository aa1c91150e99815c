"""Friction of the motor itself, beside that of the load: tried wherever a model gets a transmission.

While both sides are in touch they rub as one, and only the sum is seen. Where the motor crosses a play alone, or swings against
the load, it is the motor's share that the force shows. A transmission whose friction is all on one side is then a poor
explanation of one with friction on both, and may not be found at all.
Source: the two-mass model of a drive with friction of motor and load.
"""

from __future__ import annotations

import math

from ..model import Model
from .candidates import scales_of
from .costs import NATS_PER_PARAMETER
from .fitting import MOTOR_FRICTION, State, bounds_of, free_names, refit
from .least_squares import Fit
from .track import Track

__all__ = ["better_divided", "moved_to_motor", "undivided", "with_friction_divided"]

_PAIRS = tuple(zip(MOTOR_FRICTION, ("coulomb.force", "viscous.coefficient"), strict=True))  # of motor and load


def undivided(model: Model) -> bool:
    """True where ``model`` has a transmission and no friction of the motor itself, though its plant knows it."""
    return model.has_transmission and all(name in model.names and model.value(name) == 0.0 for name in MOTOR_FRICTION)


def moved_to_motor(model: Model) -> Model:
    """``model`` with half of the load's Coulomb and viscous friction on the motor's side; else the model itself."""
    divided = model
    for mine, of_load in _PAIRS:
        if of_load in model.names and model.value(of_load) > 0.0:
            half = 0.5 * model.value(of_load)
            divided = divided.with_value(mine, half).with_value(of_load, half)
    return divided


def better_divided(track: Track, fit: Fit) -> Fit:
    """``fit``, or one that begins at it with friction of the motor where that is worth its parameters."""
    if not undivided(fit.model):
        return fit
    start = moved_to_motor(fit.model)
    if start is fit.model:
        return fit
    divided = track.fit(start, free_names(start), 4, bounds_of(start, scales_of(track)))
    price = NATS_PER_PARAMETER * (len(divided.names) - len(fit.names))
    left, before = (float(each.residual @ each.residual) for each in (divided, fit))
    return divided if left > 0.0 and left < before * math.exp(-2.0 * price / track.independent) else fit


def with_friction_divided(track: Track, state: State) -> list[tuple[str, State]]:
    """``state`` with friction of the motor, or without it where it has some, everything else fitted anew."""
    model = state.fit.model
    if undivided(model):
        start = moved_to_motor(model)
        return [] if start is model else [("friction of the motor", refit(track, start))]
    if not model.has_transmission or not all(name in model.names for name in MOTOR_FRICTION):
        return []
    return [("no friction of the motor", refit(track, _all_on_load(model)))]


def _all_on_load(model: Model) -> Model:
    for mine, of_load in _PAIRS:
        if of_load in model.names:
            model = model.with_value(of_load, model.value(of_load) + model.value(mine))
        model = model.with_value(mine, 0.0)
    return model
