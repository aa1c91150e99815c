"""What a benchmark is: a name, what it measures, and a function that measures it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..figure import Figure

__all__ = ["Benchmark"]


@dataclass(frozen=True, eq=False)
class Benchmark:
    """One benchmark.

    Attributes:
        id: name on the command line.
        title: what is measured, in a few words.
        run: gives its figures.
        long: takes minutes: run only when named, or with all the others when all are asked for.
        sized: gives its figures for a size that the user gives; None where it is fixed.
        size: what ``sized`` counts, the name of the option: ``recordings``, ``hours``, ``cases`` or ``minutes``.
    """

    id: str
    title: str
    run: Callable[[], list[Figure]]
    long: bool = False
    sized: Callable[[int], list[Figure]] | None = None
    size: str = "recordings"
