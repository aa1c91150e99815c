"""The catalogue of plants: one kind per file, found by being here (a constant ``PLANT``)."""

from __future__ import annotations

from ..plant import Plant
from ..registry import discover

__all__ = ["PLANTS"]

PLANTS: dict[str, Plant] = {plant.id: plant for plant in discover(__name__, "PLANT", Plant)}
"""Every kind of plant by its id."""
