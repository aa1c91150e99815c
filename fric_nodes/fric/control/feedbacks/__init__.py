"""The catalogue of feedback controllers: one per file, found by being here (a constant ``CONTROLLER``)."""

from __future__ import annotations

from ...registry import discover
from ..controller import Controller

__all__ = ["CONTROLLERS"]

CONTROLLERS: dict[str, Controller] = {each.id: each for each in discover(__name__, "CONTROLLER", Controller)}
"""Every controller by its id."""
