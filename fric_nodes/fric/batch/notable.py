"""The full reports of those recordings that are to be looked at first."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from ..errors import InputError
from .fleet.look import Fleet
from .job import Job, read_joint
from .recordings import here

__all__ = ["reports_of"]


def reports_of(fleet: Fleet, job: Job, most: int) -> tuple[Mapping[str, str], Mapping[str, str], Sequence[str]]:
    """Pages on the newest recordings of the axes that come first.

    Args:
        fleet: all axes.
        job: what was asked of each recording.
        most: number of pages.

    Returns:
        Pages by the name of their file; these names by axis; and what could not be done, a line each.
    """
    make = job.task.report
    pages: dict[str, str] = {}
    names: dict[str, str] = {}
    failed: list[str] = []
    if make is None or job.parsed_model is None:
        return pages, names, failed
    axes = [axis for axis in dict.fromkeys(item.axis for item in fleet.items) if axis in fleet.latest.index]
    for axis in axes[:most]:
        row = fleet.latest.loc[axis]
        name = f"{len(pages) + 1:02d}_{re.sub(r'[^A-Za-z0-9.-]+', '_', axis)}.html"
        try:
            with here(str(row["path"])) as place:
                page = make(read_joint(place, job, str(row["joint"])), job.parsed_model, job.settings)
        except InputError as error:  # it was readable when it was worked on
            failed.append(f"no report of {axis}: {' '.join(str(error).split())}")
            continue
        pages[name], names[axis] = page, name
    return pages, names, failed
