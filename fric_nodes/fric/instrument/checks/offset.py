"""Constant force: an offset of the force sensor, or gravity; the recording can't tell which.

The value is the constant part of the force balance while sliding in both directions.
"""

from __future__ import annotations

import numpy as np

from ..check import Check, Correction, Evidence, Finding, each
from ..view import View, friction_along

__all__ = ["CHECK"]

_WARNING = 0.3  # of the friction along the motion
_SPRING = 0.2


def _judge(view: View, evidence: Evidence) -> Finding:
    v = view.velocity[view.sliding] if view.moves else np.zeros(0)
    if not np.any(v > 0.0) or not np.any(v < 0.0) or not np.all(np.isfinite(view.balance.values)):
        return Finding("offset", "unknown", "it takes sliding in both directions", remedy="record both directions")
    unit = view.record.units.force
    value, error = view.balance.value("bias"), view.balance.error("bias")
    interval = (value - 1.96 * error, value + 1.96 * error)
    expected = 0.0
    if evidence.model is not None:
        expected = sum(p.value for p in evidence.model.parameters() if p.name == "bias.force")
    friction = abs(friction_along(view)[0])
    excess = value - expected
    spring, spring_error = view.balance.part("stiffness"), view.balance.error("stiffness")
    if abs(view.balance.value("stiffness")) > 4.0 * spring_error and spring > _SPRING * friction:
        return Finding(
            "offset", "unknown", "a spring acts: without its relaxed position no offset can be determined", value, unit
        )
    if abs(excess) < _WARNING * friction or abs(excess) < 4.0 * error:
        detail = f"constant force of {value:.3g} {unit}, small beside friction" + _of_weight(view)
        return Finding("offset", "ok", detail, value, unit, interval)
    detail = f"a constant force of {value:.3g} {unit} beside a friction of {friction:.3g} {unit}"
    detail += ": gravity, or an offset of the sensor" + _of_weight(view)
    remedy = "zero the force signal with the axis unloaded, or keep a 'bias' term in the model"
    return Finding("offset", "warning", detail, value, unit, interval, remedy, correction=Correction(effort_offset=-excess))


def _of_weight(view: View) -> str:
    """What there is to say of an arm's weight."""
    largest = float(np.max(np.abs(view.weight)))
    if largest == 0.0:
        return ""
    return (
        f"; beside it a force goes with the angle as an arm's weight does, {largest:.3g} {view.record.units.force} at most: a "
        "model of this joint needs it (the plant 'pendulum', or the effect 'ripple' with its period held at one turn)"
    )


CHECK = Check("offset", "offset of the force", "sliding in both directions", each(_judge))
