"""Drives that a hardware bridge talks to: one protocol per file, with a constant ``DRIVE``; no ROS in here."""

from __future__ import annotations

from ..registry import discover
from .drive import Drive, DriveError, DriveKind, JointReading

__all__ = ["DRIVES", "Drive", "DriveError", "DriveKind", "JointReading"]

DRIVES: dict[str, DriveKind] = {kind.id: kind for kind in discover(__name__, "DRIVE", DriveKind)}
"""Every drive protocol by its id."""
