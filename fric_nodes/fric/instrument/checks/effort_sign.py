"""Wrong sign of the force: along its motion the axis would give energy instead of taking it.

The value is the friction along the motion: what is left of the effort in the direction of motion without what inertia, a
spring and a constant force take. Friction can't be negative; with a negative force signal it is, and so is the mass.
"""

from __future__ import annotations

import math

from ..check import Check, Correction, Evidence, Finding, each
from ..view import View, friction_along
from .position_sign import turned

__all__ = ["CHECK"]

_SURE = 4.0  # standard errors; statistical
_ORDER = 10.0  # times the rms of what is unexplained; physical: a misfit of the terms makes no force ten times its own size


def _judge(view: View, evidence: Evidence) -> Finding:
    unit = view.record.units.force
    friction, error, _ = friction_along(view) if view.moves else (math.nan, math.nan, math.nan)
    if not math.isfinite(friction) or float(abs(view.force).max()) == 0.0:
        return Finding("effort_sign", "unknown", "too little sliding motion under force", remedy="record motion")
    wrong_position = turned(view)[0] is True
    side = -1.0 if wrong_position else 1.0
    mass, mass_error = side * view.balance.value("mass"), view.balance.error("mass")
    friction *= side
    interval = (friction - 1.96 * error, friction + 1.96 * error)
    # Samples too far apart for the force make a balance of their own: inertia has to say the same, or friction has to stand
    # out of what nothing explains by an order of magnitude.
    stands_out = mass < -_SURE * mass_error or abs(friction) > _ORDER * view.balance.residual
    if friction < -_SURE * error and not mass > _SURE * mass_error and not stands_out:
        detail = f"the balance leaves {view.balance.residual:.3g} {unit} unexplained, too much to determine the sign"
        return Finding(
            "effort_sign", "unknown", detail, friction, unit, interval, "record at a higher rate, or smoother motion"
        )
    if friction < -_SURE * error and not mass > _SURE * mass_error:
        also = " and negative inertia" if mass < -_SURE * mass_error else ""
        detail = (
            f"the effort would mean negative friction ({friction:.3g} {unit}){also}: the sign of effort or position is wrong"
        )
        if view.even.reference is not None and not wrong_position:
            detail = f"the effort would mean negative friction ({friction:.3g} {unit}){also}: its sign is wrong"
        remedy = "reverse the sign of the effort (scale: -1 in the import's mapping), after a check of the positive direction"
        return Finding(
            "effort_sign", "fault", detail, friction, unit, interval, remedy, correction=Correction(effort_factor=-1.0)
        )
    if friction < -_SURE * error:
        detail = "positive inertia with negative friction: not a matter of sign, see 'compensated_drive'"
        return Finding("effort_sign", "ok", detail, friction, unit, interval)
    if friction <= _SURE * error:
        detail = f"a friction of {friction:.2g} {unit} can't be told from zero"
        if mass > _SURE * mass_error:
            return Finding("effort_sign", "ok", "the axis accelerates in the direction of the effort", friction, unit, interval)
        if mass < -_SURE * mass_error and view.balance.part("mass") > 3.0 * view.balance.residual:
            return Finding(
                "effort_sign", "fault", "the axis accelerates against the effort", friction, unit, interval,
                "reverse the sign of the effort or of the position", correction=Correction(effort_factor=-1.0),
            )  # fmt: skip
        return Finding("effort_sign", "unknown", detail, friction, unit, interval)
    return Finding(
        "effort_sign", "ok", f"the axis loses energy to friction, as it should: {friction:.3g} {unit}", friction, unit, interval
    )


CHECK = Check("effort_sign", "sign of the force", "sliding motion under force", each(_judge))
