"""What a benchmark is: a name, what it measures, and a function that measures it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

__all__ = ["Benchmark", "Figure"]


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


@dataclass(frozen=True, eq=False)
class Benchmark:
    """One benchmark.

    Attributes:
        id: name on the command line.
        title: what is measured, in a few words.
        run: gives its figures.
        long: takes minutes: run only when named, or with all the others when all are asked for.
    """

    id: str
    title: str
    run: Callable[[], list[Figure]]
    long: bool = False
