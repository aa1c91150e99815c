"""Delay between force and motion: the shift of the effort at which the force balance of the sliding axis closes best.

See :mod:`.lag`. Inertia has to show: with constant speeds alone a delay changes nothing. The lag that an actuator or a filter
of first order puts in looks the same; either way the recorded effort is not the force of that instant.
"""

from __future__ import annotations

from ..check import Check, Correction, Evidence, Finding, Verdict, each
from ..lag import judged
from ..view import View

__all__ = ["CHECK"]

_SAMPLES = 1.5  # how far a stamp may be from the middle of what it stands for
_FAULT = 0.5  # share of the residual's energy left when it is corrected
_WARNING = 0.8
_CREDIBLE = 0.7  # of the range that is looked at


def _judge(view: View, evidence: Evidence) -> Finding:
    curves, why = judged(view)
    if curves is None:
        return Finding("delay", "unknown", why, remedy="record motion with accelerations, such as a multisine")
    lag = curves.constant()
    value, error = lag.value, max(lag.error, 0.02 * view.h)
    interval = (value - 1.96 * error, value + 1.96 * error)
    if lag.at_edge or abs(value) > _CREDIBLE * curves.tau[-1]:
        return Finding("delay", "unknown", f"a lag of {1e3 * value:.3g} ms fits best: not credible as a delay")
    if 1.96 * error > _CREDIBLE * curves.tau[-1]:
        return Finding("delay", "unknown", "every lag in the searched range fits equally well", value, "s", interval)
    small = abs(value) <= _SAMPLES * view.record.sample_time
    if not small and abs(value) <= 4.0 * error:
        detail = f"a lag of {1e3 * value:.3g} ms fits best, which can't be told from none ({1e3 * error:.2g} ms standard error)"
        return Finding("delay", "unknown", detail, value, "s", interval)
    if not small and lag.effect < lag.least and lag.left < _WARNING:
        detail = f"a lag of {1e3 * value:.3g} ms would change {100 * lag.effect:.2g} % of the force: too little to be detected"
        return Finding("delay", "unknown", detail, value, "s", interval)
    verdict: Verdict = "ok" if small or lag.left > _WARNING else "fault" if lag.left < _FAULT else "warning"
    side = "effort comes late" if value > 0 else "motion comes late"
    detail = f"the {side}, by {1e3 * abs(value):.3g} ms ({1e3 * interval[0]:.3g} to {1e3 * interval[1]:.3g} ms)"
    if verdict == "ok":
        detail = f"force and motion agree in time within {1e3 * max(abs(value), 1.96 * error):.2g} ms"
        return Finding("delay", verdict, detail, value, "s", interval)
    remedy = "record force and position on one clock, with equal filters, or add the effect 'delay' to the model"
    return Finding("delay", verdict, detail, value, "s", interval, remedy, correction=Correction(effort_shift=value))


CHECK = Check("delay", "delay between force and motion", "motion with accelerations", each(_judge))
