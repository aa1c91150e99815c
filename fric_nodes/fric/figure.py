"""A measured number and the goal that it is meant to reach."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Figure"]


@dataclass(frozen=True)
class Figure:
    """One measured number.

    Attributes:
        name: what was measured.
        value: in ``unit``.
        unit: such as ``s`` or ``samples/s``.
        goal: the number it is meant to reach, with ``<=``, ``>=`` or ``==`` in front; empty when there is none.
    """

    name: str
    value: float
    unit: str
    goal: str = ""

    @property
    def reached(self) -> bool | None:
        """Whether the goal is met; None when there is none."""
        if not self.goal:
            return None
        relation, _, limit = self.goal.partition(" ")
        value = float(self.value)
        return {"<=": value <= float(limit), ">=": value >= float(limit), "==": value == float(limit)}[relation]
