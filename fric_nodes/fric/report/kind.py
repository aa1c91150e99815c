"""How a result becomes a page: reports import results, results import no reports."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from ..record import Record
from ..registry import discover

__all__ = ["Report", "page_of"]


@dataclass(frozen=True)
class Report:
    """The page of one kind of result.

    Attributes:
        of: type of the result; a page of a more specific type goes before that of its base.
        page: result, recordings fitted, recordings held back, and settings of the fit (or None) to HTML.
    """

    of: type
    page: Callable[[Any, Sequence[Record], Sequence[Record], Any], str] = field(repr=False)


@cache
def _reports() -> dict[type, Report]:
    return {each.of: each for each in discover(__package__ or "fric.report", "REPORT", Report)}


def page_of(result: object, train: Sequence[Record] = (), validation: Sequence[Record] = (), options: object = None) -> str:
    """The report of ``result`` as one HTML page.

    Args:
        result: of an identification, a diagnosis, a comparison, or of a plugin that brings a ``REPORT``.
        train: the recordings that were fitted.
        validation: recordings kept apart; may be empty.
        options: settings of the fit, where the result comes from one.

    Raises:
        TypeError: no report shows a result of this type.
    """
    known = _reports()
    for each in type(result).__mro__:
        if each in known:
            return known[each].page(result, train, validation, options)
    raise TypeError(f"no report shows a {type(result).__name__}")
