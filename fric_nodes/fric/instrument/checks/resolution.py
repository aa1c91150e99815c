"""Steps of position and effort: how many of them the motion, and the force, span.

The value is the number of position steps in a typical stroke (the upper quartile), or of effort steps in the effort's usual
range while it moves, whichever is worse off.
"""

from __future__ import annotations

import math

import numpy as np

from ..check import Check, Evidence, Finding, Verdict, each
from ..view import View

__all__ = ["CHECK"]

_POSITION = (40.0, 150.0)  # fault below the first, warning below the second
_FEWEST = 40  # samples in motion
_EFFORT = (16.0, 40.0)


def _verdict(count: float, limits: tuple[float, float]) -> Verdict:
    return "fault" if count < limits[0] else "warning" if count < limits[1] else "ok"


def _judge(view: View, evidence: Evidence) -> Finding:
    if view.travel == 0.0:
        return Finding("resolution", "unknown", "the position never changes")
    if not view.moves:
        return Finding("resolution", "unknown", "it does not move")
    strokes = view.strokes
    stroke = float(np.quantile(strokes, 0.75)) if strokes.size else view.travel
    position = stroke / view.resolution if view.resolution else math.inf
    # At rest, held, a force hardly changes, and need not.
    moving = np.interp(view.record.time, np.arange(view.n) * view.h, view.moving) > 0.5
    low, high = np.quantile(view.record.effort[moving] if np.sum(moving) > _FEWEST else view.record.effort, (0.02, 0.98))
    effort = float(high - low) / view.effort_resolution if view.effort_resolution else math.inf
    levels = np.unique(view.record.effort).size
    if levels <= 5:
        effort = math.inf  # a force switched between a few levels is not a coarse one
    units = view.record.units
    worst: Verdict = "ok"
    parts, remedies = [], []
    for name, count, step, unit, limits in (
        ("position", position, view.resolution, units.position, _POSITION),
        ("effort", effort, view.effort_resolution, units.force, _EFFORT),
    ):
        verdict = _verdict(count, limits)
        if step:
            parts.append(f"step of the {name} {step:.3g} {unit}; its usual range is {count:.3g} steps")
        if verdict != "ok":
            remedies.append(f"a finer {name} signal or more {'travel' if name == 'position' else 'force'}")
            worst = verdict if worst != "fault" else worst
    least = min(position / _POSITION[0], effort / _EFFORT[0])
    value = position if least == position / _POSITION[0] else effort
    detail = "; ".join(parts) or "no steps show in position or effort"
    remedy = f"record with {' and '.join(remedies)}" if remedies else ""
    return Finding("resolution", worst, detail, value if math.isfinite(value) else math.nan, "1", remedy=remedy)


CHECK = Check("resolution", "steps of position and effort", "motion", each(_judge))
