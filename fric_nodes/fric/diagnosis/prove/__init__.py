"""The examination of the diagnosis: plants with concealed physics, sealed keys, and a score."""

from __future__ import annotations

from .cases import KINDS, VARIANTS, Case, Order, draw, plan

__all__ = ["KINDS", "VARIANTS", "Case", "Order", "draw", "plan"]
