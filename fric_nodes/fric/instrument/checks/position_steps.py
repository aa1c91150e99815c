"""Impossible steps: a position that folds or jumps, an effort that wraps, and spikes of either.

What :mod:`fric.signals.conditioning` has put right, or would, is named here. The value is the number of such remarks.
"""

from __future__ import annotations

from ...record import RecordError
from ...signals.conditioning import changes
from ..check import Check, Evidence, Finding, each
from ..view import View

__all__ = ["CHECK"]


def _judge(view: View, evidence: Evidence) -> Finding:
    try:
        found = changes(view.record)
    except RecordError as error:
        return Finding("position_steps", "fault", error.problem, remedy=error.remedy)
    if not found:
        return Finding("position_steps", "ok", "no step of the position and no spike that a motion could not make", 0.0, "1")
    spikes = any(note.startswith("spike") for note in found)
    remedy = (
        "check cable, shield and connector of the sensor" if spikes else "record a signal that doesn't fold where there is one"
    )
    return Finding("position_steps", "warning", "; ".join(found), float(len(found)), "1", remedy=remedy)


CHECK = Check("position_steps", "folds, jumps and spikes", "position and effort", each(_judge))
