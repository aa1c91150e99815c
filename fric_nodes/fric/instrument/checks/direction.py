"""One direction only: then Coulomb friction is one with any constant force, and asymmetry can't be seen.

The value is the share of the way that was made in the rarer direction, over all recordings. What was recorded is what the axis
did, so that this is a warning and no fault: it limits what a fit can tell.
"""

from __future__ import annotations

import numpy as np

from ..check import Check, Evidence, Finding, Verdict

__all__ = ["CHECK"]

_WARNING = 0.1


def _run(evidence: Evidence) -> list[Finding]:
    forward = backward = 0.0
    for view in evidence.views:
        if view.moves:
            way = np.where(view.moving, view.velocity, 0.0) * view.h
            forward += float(np.sum(way[way > 0.0]))
            backward -= float(np.sum(way[way < 0.0]))
    if forward + backward == 0.0:
        return [Finding("direction", "unknown", "it does not move")]
    share = min(forward, backward) / (forward + backward)
    verdict: Verdict = "warning" if share < _WARNING else "ok"
    name = "backward" if backward < forward else "forward"
    detail = f"{100 * share:.2g} % of the travel is {name}"
    remedy = "" if verdict == "ok" else f"record {name} motion too, over the same places and speeds"
    return [Finding("direction", verdict, detail, share, "1", remedy=remedy)]


CHECK = Check("direction", "both directions", "motion", _run)
