"""When a search has to end: after a time that was asked for, wherever it is then.

What is begun is brought to an end; no further effect, exchange or beginning is tried. Without a time that was asked for a
search ends by itself, and comes to the same each time.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from ..errors import InputError

__all__ = ["is_over", "refuse_no_time", "within"]

_ends: ContextVar[float] = ContextVar("ends", default=math.inf)


def refuse_no_time(seconds: float | None) -> None:
    """Refuse what no search can end after; None is no bound.

    Raises:
        InputError: no time at all.
    """
    if seconds is not None and not seconds > 0.0:
        raise InputError("--at-most", f"{seconds:g} s is no time", "give the seconds that the search may take, such as 60")


@contextmanager
def within(seconds: float | None) -> Iterator[None]:
    """Searches of this thread end after ``seconds`` [s] from now; None: by themselves.

    Raises:
        InputError: no time at all.
    """
    refuse_no_time(seconds)
    before = _ends.set(math.inf if seconds is None else time.monotonic() + seconds)
    try:
        yield
    finally:
        _ends.reset(before)


def is_over() -> bool:
    """True from when a search has to end."""
    return time.monotonic() > _ends.get()
