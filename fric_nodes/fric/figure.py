"""A measured number and the goal that it is meant to reach."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Figure"]


@dataclass(frozen=True)
class Figure:
    """One measured number.

    Attributes:
        name: what was measured.
        value: in ``unit``; NaN when it wasn't measured.
        unit: such as ``s`` or ``samples/s``.
        goal: the number it is meant to reach, with ``<=``, ``>=`` or ``==`` in front; empty when there is none.
        low: 10 % of the repetitions lie below; None without repetitions.
        high: and 10 % above.
        skipped: why it wasn't measured; empty when it was.
    """

    name: str
    value: float
    unit: str
    goal: str = ""
    low: float | None = None
    high: float | None = None
    skipped: str = ""

    @property
    def reached(self) -> bool | None:
        """Whether the goal is met; None when there is none, or nothing was measured."""
        if not self.goal or self.skipped:
            return None
        relation, _, limit = self.goal.partition(" ")
        value = float(self.value)
        return {"<=": value <= float(limit), ">=": value >= float(limit), "==": value == float(limit)}[relation]
