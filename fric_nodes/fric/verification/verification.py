"""What a verification is: a name, where its numbers come from, and a function that finds the evidence."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import plotly.graph_objects as go

from ..figure import Figure

__all__ = ["Evidence", "Verification"]


@dataclass(frozen=True, eq=False)
class Evidence:
    """What a verification found.

    Attributes:
        figures: numbers, with the goal that each must reach.
        plots: pictures, each with its caption.
        notes: what else the reader must know, such as a correction to a printed equation.
    """

    figures: Sequence[Figure]
    plots: Sequence[tuple[go.Figure, str]] = ()
    notes: Sequence[str] = ()


@dataclass(frozen=True, eq=False)
class Verification:
    """One verification.

    Attributes:
        id: its name on the command line.
        title: what is verified, as a heading.
        source: paper and equations that it is held against.
        run: finds the evidence.
    """

    id: str
    title: str
    source: str
    run: Callable[[], Evidence]
