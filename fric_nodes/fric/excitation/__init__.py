"""The catalogue of excitations: one per file, found by being here.

A new excitation is one new module with a constant ``EXCITATION``, and its test. Nothing has to be registered anywhere else.
"""

from __future__ import annotations

from ..excitation_kind import Excitation
from ..registry import discover

__all__ = ["EXCITATIONS"]

EXCITATIONS: dict[str, Excitation] = {kind.id: kind for kind in discover(__name__, "EXCITATION", Excitation)}
"""Every excitation by its id."""
