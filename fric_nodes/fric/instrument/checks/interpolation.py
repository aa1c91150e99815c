"""Errors within the lines of an encoder: the position errs by what repeats with its lines, not the axis.

See :mod:`..lines`. The value is the amplitude of the error. Where the axis itself moves with that period, as a cogging motor
makes it, the recording is right.
"""

from __future__ import annotations

from ..check import Check, Correction, Evidence, Finding, each
from ..lines import Line, error_found, share_of_sensor
from ..view import View

__all__ = ["CHECK"]

_SURE = 3.0  # standard errors
_SHOWN = 4.0  # standard errors
_EITHER = 0.5  # halfway between a motion (0) and an error of the sensor (1)
_NEAR = 0.3  # how far an error of constant size may be from the one that is there, as a share of it


def _judge(view: View, evidence: Evidence) -> Finding:
    if not view.moves:
        return Finding("interpolation", "unknown", "it does not move")
    error = error_found(view)
    unit = view.record.units.position
    if error is None or error.amplitude < view.noise:
        detail = "nothing that repeats over the position stands out of the sensor's noise"
        return Finding("interpolation", "ok", detail, 0.0, unit)
    # A force without inertia in it shows no motion that something else makes.
    inertial = view.balance.value("mass") > _SHOWN * view.balance.error("mass")
    line = share_of_sensor(view, error) if inertial else Line(error)
    low, high = line.share - _SURE * line.deviation, line.share + _SURE * line.deviation
    what = f"an oscillation of {error.amplitude:.3g} {unit} repeats with every {error.pitch:.4g} {unit}"
    if high < _EITHER:
        return Finding("interpolation", "ok", f"{what}: a motion of the axis", error.amplitude, unit)
    if not (low > _EITHER and low < 1.0 + _NEAR and high > 1.0 - _NEAR):
        return Finding(
            "interpolation",
            "unknown",
            f"{what}; it can't be told whether the encoder errs within its lines or the axis moves",
            error.amplitude,
            unit,
            remedy="record motion at several speeds",
        )
    return Finding(
        "interpolation",
        "warning",
        f"the position errs by {error.amplitude:.3g} {unit} within lines of {error.pitch:.4g} {unit}: not a motion",
        error.amplitude,
        unit,
        remedy="adjust offset, amplitude and phase of the encoder's signals, or have the drive compensate it",
        correction=Correction(position_error=error),
    )


CHECK = Check("interpolation", "errors within an encoder's lines", "motion at several speeds", each(_judge))
