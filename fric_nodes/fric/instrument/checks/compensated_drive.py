"""A drive that compensates friction by itself: the effort recorded is what the controller asked for, friction left out.

The value is the friction seen in the effort, over the model's at the same speed. Inertia shows as it should, friction
doesn't. That needs a model, unless the drive overcompensates: then the axis seems to give energy although its inertia is
right.
"""

from __future__ import annotations

import math

from ..check import Check, Evidence, Finding, Verdict, each
from ..view import View, friction_along
from .position_sign import turned

__all__ = ["CHECK"]

_FAULT = 0.3
_WARNING = 0.5
_SURE = 4.0
_SAME_MASS = 1.8


def _judge(view: View, evidence: Evidence) -> Finding:
    friction, error, speed = friction_along(view) if view.moves else (math.nan, math.nan, math.nan)
    if not math.isfinite(friction):
        return Finding("compensated_drive", "unknown", "too little sliding motion")
    mass, mass_error = view.balance.value("mass"), view.balance.error("mass")
    if turned(view)[0] is True:
        return Finding("compensated_drive", "unknown", "the position has the wrong sign")
    if not mass > _SURE * mass_error:
        return Finding("compensated_drive", "unknown", "the force shows no inertia, so that friction can't be compared with it")
    remedy = "switch the drive's own friction compensation off, or record the motor current"
    if friction < -_SURE * error and abs(friction) <= view.balance.residual:
        detail = (
            f"the balance leaves {view.balance.residual:.3g} {view.record.units.force} unexplained, more than friction would be"
        )
        return Finding("compensated_drive", "unknown", detail, friction, view.record.units.force)
    if friction < -_SURE * error:
        detail = f"the inertia is right, but friction is negative ({friction:.3g}): the drive overcompensates friction"
        return Finding("compensated_drive", "fault", detail, friction, view.record.units.force, remedy=remedy)
    expected = evidence.friction(speed)
    if not expected > 0.0:
        return Finding("compensated_drive", "unknown", "how much friction to expect is not known without a model")
    share = friction / expected
    interval = ((friction - 1.96 * error) / expected, (friction + 1.96 * error) / expected)
    # What the drive adds late or early looks like inertia too, so that the mass is as unsure as its error says.
    margin = _SURE * mass_error
    if mass + margin < evidence.inertia / _SAME_MASS or mass - margin > evidence.inertia * _SAME_MASS:
        return Finding(
            "compensated_drive",
            "unknown",
            "the inertia differs from the model's, too; see the check 'units'",
            share,
            "1",
            interval,
        )
    verdict: Verdict = "fault" if interval[1] < _FAULT else "warning" if interval[1] < _WARNING else "ok"
    detail = f"the effort shows {100 * share:.0f} % of the model's friction"
    return Finding("compensated_drive", verdict, detail, share, "1", interval, "" if verdict == "ok" else remedy)


CHECK = Check("compensated_drive", "friction compensated by the drive", "a model, and accelerations", each(_judge))
