"""A sensor on the other side of a transmission: between the two sides there are deflection and lost motion.

It takes both positions to see it: where a second one was recorded (a signal whose name ends in ``position``), the value is
the range of their difference while the axis moves. From one position and one force a lost motion is no different from
friction that holds.
"""

from __future__ import annotations

import numpy as np

from ..check import Check, Evidence, Finding, each
from ..view import View

__all__ = ["CHECK"]

_WARNING = 0.002  # of the travel


def _judge(view: View, evidence: Evidence) -> Finding:
    others = {name: values for name, values in view.even.extra.items() if name.endswith("position")}
    if not others or not view.moves:
        why = "only one position was recorded: lost motion can't be told from static friction"
        return Finding("sensor_side", "unknown", why, remedy="record the positions of motor and load")
    name, values = min(others.items())
    use = view.usable
    slope, start = np.polyfit(view.even.position[use], values[use], 1)
    off = values[use] - start - slope * view.even.position[use]
    width = float(np.quantile(off, 0.99) - np.quantile(off, 0.01))
    unit = view.record.units.position
    detail = f"'{name}' runs at {slope:.4g} times the position, with {width:.3g} {unit} between the two sides"
    if width < max(_WARNING * abs(slope) * view.travel, 6.0 * view.noise):
        return Finding("sensor_side", "ok", detail, width, unit)
    remedy = "fit force with the motor's position, and the transmission (backlash, compliance) with both"
    return Finding("sensor_side", "warning", detail, width, unit, remedy=remedy)


CHECK = Check("sensor_side", "which side of the transmission is measured", "two positions", each(_judge))
