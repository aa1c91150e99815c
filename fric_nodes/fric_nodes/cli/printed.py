"""Printing for people: tables fit the terminal, and keep one line per row where the output goes to a file or a pipe."""

from __future__ import annotations

import sys
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

__all__ = ["console", "plain_table"]

_ONE_LINE = 10_000  # columns; wider than any row, so that nothing is wrapped or cut (numerical limit, no layout)


def console() -> Console:
    """Standard output for tables and sentences, without markup and colours of numbers."""
    from rich.console import Console

    return Console(highlight=False, markup=False, width=None if sys.stdout.isatty() else _ONE_LINE)


def plain_table(columns: Sequence[str], numbers: Collection[str] = ()) -> Table:
    """A table without lines. Columns of text break where the terminal is narrow; numbers stay on one line.

    Args:
        columns: their headings.
        numbers: headings of the columns that hold numbers.
    """
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    for name in columns:
        if name in numbers:
            table.add_column(name, justify="right", no_wrap=True)
        else:
            table.add_column(name, overflow="fold")
    return table
