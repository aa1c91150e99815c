"""A simulated recording against the real one."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..diagnosis.compare import Comparison
from ..diagnosis.compare import compare as _compare
from ..files import write_text
from ..identification.screen import screened
from ..report.kind import page_of
from ..threads import linear_algebra_in_one
from .reading import records_of

if TYPE_CHECKING:
    from .reading import Source

__all__ = ["Compared", "compare"]


@dataclass(frozen=True, eq=False)
class Compared:
    """Two recordings, aligned in time.

    Attributes:
        result: how they differ, and where.
    """

    result: Comparison

    def summary(self) -> str:
        """By how much they differ, where, and by how much their clocks do."""
        found = self.result
        clocks = [
            f"offset of the clocks: {found.clocks.offset_in_words}",
            f"ratio of the clocks: {found.clocks.ratio_in_words}",
        ]
        return "\n".join([found.sentence, *clocks, *(f"- {note}" for note in found.notes)])

    def to_dict(self) -> dict[str, Any]:
        """The contents of report.json (``fric-comparison/1``)."""
        return dict(self.result.report())

    def report(self, path: str | Path | None = None) -> str:
        """The report as one HTML page, written to ``path`` where one is given."""
        page = page_of(self.result)
        if path is not None:
            write_text(Path(path), page)
        return page

    def files(self) -> dict[str, str]:
        """Contents of report.html and report.json, by name."""
        return {"report.html": self.report(), "report.json": json.dumps(self.to_dict(), indent=2) + "\n"}

    def save(self, folder: str | Path) -> list[Path]:
        """Write :meth:`files` into ``folder``, and return their paths."""
        texts = {Path(folder) / name: text for name, text in self.files().items()}
        for path, text in texts.items():
            write_text(path, text)
        return list(texts)


@linear_algebra_in_one()
def compare(simulated: Source, real: Source) -> Compared:
    """Align two recordings of one joint in time, and say by how much and where they differ.

    Args:
        simulated: record, path or table of the simulation; see :func:`fric.read`.
        real: of the machine.

    Raises:
        CompareError: they have no motion in common, or differ in their units.
    """
    first, second = (screened(each) for each in (*records_of(simulated), *records_of(real)))
    return Compared(_compare(first, second))
