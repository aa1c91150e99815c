"""Friction of the motor itself, beside that of the load: tried wherever a model gets a transmission.

While both sides are in touch they rub as one, and only the sum is seen. Where the motor crosses a play alone, or swings against
the load, it is the motor's share that the force shows. A transmission whose friction is all on one side is then a poor
explanation of one with friction on both, and may not be found at all.
Source: the two-mass model of a drive with friction of motor and load.
"""

from __future__ import annotations

from ..model import Model

__all__ = ["MOTOR_FRICTION", "all_on_load", "half_on_motor", "undivided"]

MOTOR_FRICTION = ("motor_coulomb", "motor_viscous")
"""Of a plant with a transmission: the motor's own Coulomb and viscous friction."""

_PAIRS = tuple(zip(MOTOR_FRICTION, ("coulomb.force", "viscous.coefficient"), strict=True))  # of motor and load


def undivided(model: Model) -> bool:
    """True where ``model`` has a transmission and no friction of the motor itself, though its plant knows it."""
    return model.has_transmission and all(name in model.names and model.value(name) == 0.0 for name in MOTOR_FRICTION)


def half_on_motor(model: Model) -> Model | None:
    """``model`` with half of the load's Coulomb and viscous friction on the motor's side.

    None where it has neither, no transmission, or friction of the motor already.
    """
    if not undivided(model):
        return None
    divided = model
    for mine, of_load in _PAIRS:
        if of_load in model.names and model.value(of_load) > 0.0:
            half = 0.5 * model.value(of_load)
            divided = divided.with_value(mine, half).with_value(of_load, half)
    return None if divided is model else divided


def all_on_load(model: Model) -> Model | None:
    """``model`` with the motor's friction on the load's side; None where the motor has none."""
    if not any(name in model.names and model.value(name) > 0.0 for name in MOTOR_FRICTION):
        return None
    for mine, of_load in _PAIRS:
        if of_load in model.names:
            model = model.with_value(of_load, model.value(of_load) + model.value(mine))
        model = model.with_value(mine, 0.0)
    return model
