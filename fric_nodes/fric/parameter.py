"""The one way to declare a parameter: name, symbol, dimension, bounds, default, documentation.

The same declaration feeds the model file and its JSON schema, the fit (bounds, scale, which parameters are linear), the ROS
messages and the report. Dimensions are written once for linear and for rotary joints: ``F`` stands for the unit of force and
``x`` for the unit of position of the joint at hand, so ``F s/x`` reads N s/m on a slide and N m s/rad on a servo joint.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from .record import Units

__all__ = ["Parameter", "unit_text"]

_WELL_KNOWN = {
    ("F s^2/x", "m", "N"): "kg",
    ("F s^2/x", "rad", "N m"): "kg m^2",
}


def unit_text(dimension: str, units: Units) -> str:
    """The unit of ``dimension`` (such as ``F s/x``) for a joint measured in ``units``, as text."""
    known = _WELL_KNOWN.get((dimension, units.position, units.force))
    if known is not None:
        return known
    return "".join({"F": units.force, "x": units.position}.get(letter, letter) for letter in dimension)


@dataclass(frozen=True)
class Parameter:
    """One parameter of a plant or of an effect.

    Attributes:
        name: key in the model file, lower case.
        symbol: as in the equation.
        dimension: ``F`` (force), ``x`` (position), ``s``, ``K`` and ``1``, combined with ``/``, blanks and ``^``.
        doc: what it is, one sentence.
        lower: smallest value allowed, in SI.
        upper: largest value allowed, in SI.
        default: value taken when a model file leaves it out; None when it must be given.
        linear: True when the force is linear in it, so that least squares finds it without iteration.
        shape: True for a shape parameter (an exponent) that a fit holds at its value unless asked to free it.
        positive: True when zero itself is refused (a mass, a velocity that divides).
        also: of a shape parameter, values besides the default that machines have, for a diagnosis to try.
    """

    name: str
    symbol: str
    dimension: str
    doc: str
    lower: float = -math.inf
    upper: float = math.inf
    default: float | None = None
    linear: bool = False
    positive: bool = False
    shape: bool = False
    also: tuple[float, ...] = ()

    def unit(self, units: Units) -> str:
        """The parameter's unit for a joint measured in ``units``."""
        return unit_text(self.dimension, units)

    def refusal(self, value: float) -> str | None:
        """Why ``value`` can't be used, or None when it can."""
        if not math.isfinite(value):
            return f"is {value}, not a finite number"
        if self.positive and value <= 0:
            return f"is {value:g}, must be greater than 0"
        if not self.lower <= value <= self.upper:
            return f"is {value:g}, must lie in [{self.lower:g}, {self.upper:g}]"
        return None
