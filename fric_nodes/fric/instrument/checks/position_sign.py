"""Wrong sign of the position: it runs against the reference that it follows, or against the velocity that was recorded with it.

The value is the correlation of the velocities.
"""

from __future__ import annotations

import math

import numpy as np

from ...record import Array
from ..check import Check, Correction, Evidence, Finding, each
from ..view import View, friction_along

__all__ = ["CHECK", "agreement", "turned"]

_SURE = 0.5


def agreement(view: View, other: Array) -> float:
    """Correlation of the velocity with another, recorded or wanted, where either moves; NaN where there is none."""
    a, b = view.velocity[view.usable], other[view.usable]
    size = float(np.sqrt(np.sum(a**2) * np.sum(b**2)))
    return float(np.sum(a * b)) / size if size > 0.0 else math.nan


def turned(view: View) -> tuple[bool | None, str, float]:
    """Whether the position has the wrong sign (None: can't be told), by what, and the correlation."""
    if not view.moves:
        return None, "it does not move", math.nan
    said = "neither a reference nor a velocity was recorded"
    if view.even.reference is not None:
        alike = agreement(view, np.gradient(view.low_pass(view.even.reference), view.h))
        if alike < -_SURE:
            return True, "the reference", alike
        if alike > _SURE:
            return False, "the reference", alike
        said = _undecided("the reference", alike)
    if view.even.velocity is not None:
        alike = agreement(view, view.low_pass(view.even.velocity))
        friction, error, _ = friction_along(view)
        # Position and velocity contradict each other; the force tells which of them is right.
        if alike < -_SURE and friction < -4.0 * error:
            return True, "velocity and force", alike
        if alike > _SURE:
            return False, "the velocity", alike
        said = _undecided("the recorded velocity", alike)
    return None, said, math.nan


def _undecided(by: str, alike: float) -> str:
    """Why ``by`` doesn't tell the sign, which has the correlation ``alike`` with the motion; NaN where it stands still."""
    return (
        f"{by} stands still"
        if math.isnan(alike)
        else f"{by} doesn't clearly move with it or against it (correlation {alike:+.2f})"
    )


def _judge(view: View, evidence: Evidence) -> Finding:
    wrong, by, alike = turned(view)
    if wrong is None:
        return Finding("position_sign", "unknown", by, remedy="record the reference, or the drive's velocity, too")
    if not wrong:
        return Finding("position_sign", "ok", f"the position moves with {by} (correlation {alike:+.2f})", alike, "1")
    detail = f"the position moves against {by} (correlation {alike:+.2f})"
    remedy = "reverse the sign of the position (scale: -1 in the import's mapping)"
    return Finding("position_sign", "fault", detail, alike, "1", remedy=remedy, correction=Correction(position_factor=-1.0))


CHECK = Check("position_sign", "sign of the position", "a reference or a recorded velocity", each(_judge))
