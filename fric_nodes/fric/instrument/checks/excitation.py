"""Not excited: what never changes can't be told apart.

Four things make up the least model of an axis: inertia, Coulomb friction, viscous friction, and a constant force. The value
is how many of them the motion of all recordings together tells apart: the scaled columns a, sgn v, v, 1 of the sliding
samples, and the number of their singular values above a tenth of the largest; inertia counts only where its force shows above
the noise. Less than four is a warning, an axis at rest too: that is what the axis did, and no fault of the recording.
"""

from __future__ import annotations

import numpy as np

from ..check import Check, Evidence, Finding

__all__ = ["CHECK"]

_SMALL = 0.1
_NAMES = ("inertia", "Coulomb friction", "viscous friction", "constant force")


def _run(evidence: Evidence) -> list[Finding]:
    moving = [view for view in evidence.views if view.moves and np.any(view.sliding)]
    if not moving:
        detail = "the joint rests: no motion beyond the noise and the steps of the position"
        return [Finding("excitation", "warning", detail, 0.0, "1", remedy="move it, in both directions, at several speeds")]
    rows = []
    for view in moving:
        at = np.flatnonzero(view.sliding)
        v = view.velocity[at]
        seen = abs(view.balance.value("mass")) > 4.0 * view.balance.error("mass")
        rows.append(np.column_stack([view.acceleration[at] * seen, np.sign(v), v, np.ones(at.size)]))
    columns = np.concatenate(rows)
    size = np.sqrt(np.mean(columns**2, axis=0))
    seen = size > 0.0
    spread = np.linalg.svd(columns[:, seen] / size[seen], compute_uv=False)
    count = int(np.sum(spread > _SMALL * spread[0]))
    if count == 4:
        detail = "the motion separates inertia, dry and viscous friction and constant forces"
        return [Finding("excitation", "ok", detail, 4.0, "1")]
    together = _mixed(columns[:, seen] / size[seen], [n for n, s in zip(_NAMES, seen, strict=True) if s])
    hidden = [] if seen[0] else ["inertia does not show above the noise"]
    detail = f"{count} of 4 combinations are excited: " + "; ".join([*hidden, *together])
    remedy = "record a multisine, or moves from point to point at several speeds in both directions"
    return [Finding("excitation", "warning", detail, float(count), "1", remedy=remedy)]


def _mixed(columns: np.ndarray, names: list[str]) -> list[str]:
    """Which columns can't be told apart, in words."""
    _, spread, parts = np.linalg.svd(columns, full_matrices=False)
    told = []
    for value, part in zip(spread, parts, strict=True):
        if value <= _SMALL * spread[0]:
            strong = [name for name, weight in zip(names, np.abs(part), strict=True) if weight > 0.3]
            told.append(f"{' and '.join(strong)} can't be told apart" if len(strong) > 1 else f"{strong[0]} is hardly excited")
    return told


CHECK = Check("excitation", "excited enough", "motion", _run)
