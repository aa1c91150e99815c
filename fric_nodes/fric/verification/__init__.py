"""Verifications that a user can run with ``fric verify``: one file each, with a constant ``VERIFICATION``.

Each holds the physics up against something that doesn't come from this package: a figure of the paper, a closed form, a
conservation law, or an integration by another method.
"""

from __future__ import annotations

from ..registry import discover
from .verification import Verification

__all__ = ["VERIFICATIONS"]

VERIFICATIONS: dict[str, Verification] = {found.id: found for found in discover(__name__, "VERIFICATION", Verification)}
"""Every verification by its id."""
