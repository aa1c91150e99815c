"""The catalogue of plants: one kind per file, found by being here (a constant ``PLANT``)."""

from __future__ import annotations

import copyreg
from typing import Any

from ..plant import Plant
from ..registry import discover

__all__ = ["PLANTS"]

PLANTS: dict[str, Plant] = {plant.id: plant for plant in discover(__name__, "PLANT", Plant)}
"""Every kind of plant by its id."""


def _forms(plant: Plant) -> tuple[Plant | None, ...]:
    return plant, plant.driven, plant.behind


def _known(plant: str, form: int) -> Plant | None:
    return _forms(PLANTS[plant])[form]


def _pickled(plant: Plant) -> tuple[Any, ...]:
    """A plant of the catalogue goes to another process by its name: there is one of each, and its functions are not copied."""
    for form, each in enumerate(_forms(PLANTS[plant.id]) if plant.id in PLANTS else ()):
        if each is plant:
            return _known, (plant.id, form)
    return object.__reduce_ex__(plant, 2)  # type: ignore[return-value]


copyreg.pickle(Plant, _pickled)
