"""How numbers are written in reports."""

from __future__ import annotations

import numpy as np

__all__ = ["significant"]


def significant(value: float, digits: int = 4) -> str:
    """``value`` with so many significant digits, without an exponent where it reads well."""
    if not np.isfinite(value):
        return "not known"
    if value == 0.0 or 1e-3 <= abs(value) < 1e6:
        return f"{value:#.{digits}g}".rstrip(".") if abs(value) < 10**digits else f"{value:.0f}"
    return f"{value:.{digits - 1}e}"
