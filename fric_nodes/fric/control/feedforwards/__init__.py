"""The catalogue of feedforwards: one per file, found by being here (a constant ``FEEDFORWARD``)."""

from __future__ import annotations

from ...registry import discover
from ..feedforward_kind import FeedforwardKind

__all__ = ["FEEDFORWARDS"]

FEEDFORWARDS: dict[str, FeedforwardKind] = {each.id: each for each in discover(__name__, "FEEDFORWARD", FeedforwardKind)}
"""Every feedforward by its id."""
