"""Clock drift: a lag between force and motion that grows, as when both are stamped by clocks of their own.

See :mod:`.lag`: the lag is tau + s t, and what counts is how much less s leaves than a constant lag does.
"""

from __future__ import annotations

import math

from ..check import Check, Correction, Evidence, Finding, Verdict, each
from ..lag import judged
from ..view import View

__all__ = ["CHECK"]

_FAULT = 0.4
_WARNING = 0.7
_SURE = 2.5  # standard errors; what decides is the energy


def _judge(view: View, evidence: Evidence) -> Finding:
    curves, why = judged(view, growing=True)
    if curves is None:
        return Finding("clock_drift", "unknown", why, remedy="record motion with accelerations throughout")
    growth = curves.growing()
    value, error = 1e6 * growth.value, 1e6 * growth.error
    interval = (value - 1.96 * error, value + 1.96 * error)
    total = abs(growth.value) * view.n * view.h
    if growth.effect < growth.least and growth.left < _WARNING:
        detail = f"a growth of {value:.3g} ppm would change {100 * growth.effect:.2g} % of the force: too little to be detected"
        return Finding("clock_drift", "unknown", detail, value, "ppm", interval)
    known = math.isfinite(error) and abs(value) > _SURE * error and total > 1.5 * view.record.sample_time
    verdict: Verdict = "fault" if known and growth.left < _FAULT else "warning" if known and growth.left < _WARNING else "ok"
    if verdict == "ok":
        detail = f"no growth of the lag: {value:+.2g} ppm ({interval[0]:.2g} to {interval[1]:.2g})"
        return Finding("clock_drift", verdict, detail, value, "ppm", interval)
    detail = f"the lag between effort and motion grows by {value:+.3g} ppm, {1e3 * total:.3g} ms over the recording"
    correction = Correction(effort_shift=growth.start, effort_stretch=growth.value)
    remedy = "stamp force and position by one clock, or synchronise the two"
    return Finding("clock_drift", verdict, detail, value, "ppm", interval, remedy, correction=correction)


CHECK = Check("clock_drift", "drift of clocks between force and motion", "motion with accelerations", each(_judge))
