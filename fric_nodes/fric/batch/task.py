"""What a verb does with one recording, and which columns its rows have beside those of every verb."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..model import Model
from ..record import Record
from ..registry import discover

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["NORMAL_95", "Task", "estimates", "number", "task_of"]

NORMAL_95 = 1.959963984540054
"""Quantile of the normal distribution: ends of a 95 % interval in standard errors (statistical level)."""


@dataclass(frozen=True)
class Task:
    """The work of one verb.

    Attributes:
        id: the verb.
        columns: names and Arrow types of the columns that its rows have beside the parameters.
        run: recording, model and settings to the values of these columns, and ``parameters`` as of :func:`estimates`.
        report: recording, model and settings to a page; None where there is none.
        has_parameters: its rows hold the model's parameters.
    """

    id: str
    columns: Callable[[], Mapping[str, pa.DataType]] = field(repr=False)
    run: Callable[[Record, Model | None, Mapping[str, Any]], dict[str, Any]] = field(repr=False)
    report: Callable[[Record, Model, Mapping[str, Any]], str] | None = field(default=None, repr=False)
    has_parameters: bool = True


def task_of(verb: str) -> Task:
    """The task of a verb.

    Raises:
        InputError: there is none.
    """
    tasks = {each.id: each for each in discover(f"{__package__}.tasks", "TASK", Task)}
    if verb not in tasks:
        raise InputError("fric batch", f"has no verb '{verb}'", f"use one of {', '.join(tasks)}")
    return tasks[verb]


def estimates(model: Model) -> dict[str, list[float | None]]:
    """Value and ends of the 95 % interval of each parameter; the ends are None where no standard error is known."""
    found: dict[str, list[float | None]] = {}
    for each in model.parameters():
        error = model.standard_errors.get(each.name)
        wide = None if error is None else NORMAL_95 * error
        ends = (None, None) if wide is None else (number(each.value - wide), number(each.value + wide))
        found[each.name] = [number(each.value), *ends]
    return found


def number(value: float | None) -> float | None:
    """A finite number, or None."""
    return None if value is None or not abs(value) < float("inf") else float(value)
