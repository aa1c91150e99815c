"""The catalogue of plants: one kind per file, found by being here (a constant ``PLANT``)."""

from __future__ import annotations

import copyreg
from typing import Any

from ..plant import Plant
from ..registry import discover

__all__ = ["PLANTS"]

PLANTS: dict[str, Plant] = {plant.id: plant for plant in discover(__name__, "PLANT", Plant)}
"""Every kind of plant by its id."""


def _known(plant: str, driven: bool) -> Plant | None:
    return PLANTS[plant].driven if driven else PLANTS[plant]


def _pickled(plant: Plant) -> tuple[Any, ...]:
    """A plant of the catalogue goes to another process by its name: there is one of each, and its functions are not copied."""
    for driven in (False, True):
        if plant.id in PLANTS and _known(plant.id, driven) is plant:
            return _known, (plant.id, driven)
    return object.__reduce_ex__(plant, 2)  # type: ignore[return-value]


copyreg.pickle(Plant, _pickled)
