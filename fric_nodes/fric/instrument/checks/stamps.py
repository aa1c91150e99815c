"""Stamps: gaps, samples that are missing, samples that were repeated, jitter.

A step of n median steps is n - 1 missing samples, unless the samples were read unevenly. A sample with the same position and
the same effort as the one before, while both usually change, is the one before again. The value is the share of samples that
are missing or repeated.
"""

from __future__ import annotations

import numpy as np

from ...signals.held_position import NOTE
from ...signals.stamps import grid_of, is_jitter
from ..check import Check, Evidence, Finding, Verdict, each
from ..view import View, runs

__all__ = ["CHECK", "repeated"]

_FAULT = 0.04
_JITTER_FAULT = 0.35
_JITTER = 0.1
_CHANGES = 0.7  # share of samples, in the quicker half of the motion, that a signal has to change at


def repeated(view: View) -> float:
    """Share of samples, in the quicker half of the motion, that repeat the one before; NaN where that can't be told."""
    record = view.record
    quick = np.abs(np.diff(record.position, prepend=record.position[0])) > 0.0
    speed = np.abs(np.interp(record.time, np.arange(view.n) * view.h, view.velocity))
    fast = speed > 0.5 * view.speed
    fast[0] = False
    still_effort = np.diff(record.effort, prepend=np.nan) == 0.0
    if view.resolution > 0.0:
        # Only where the position moves by several of its steps from sample to sample does standing still mean something.
        fast &= speed * record.sample_time > 3.0 * view.resolution
    if np.sum(fast) < 50:
        return float("nan")
    # An effort that is itself a staircase tells nothing; one that changes with nearly every sample does.
    if float(np.mean(~still_effort[fast & quick])) < _CHANGES:
        return float("nan")
    return float(np.mean((~quick & still_effort)[fast]))


def _judge(view: View, evidence: Evidence) -> Finding:
    time = view.record.time
    step = np.diff(time)
    grid = grid_of(time)
    usual = grid.period
    missing = np.diff(grid.number) - 1.0
    lost = float(np.sum(missing)) / (time.size + float(np.sum(missing)))
    again = repeated(view) if view.moves else float("nan")
    again = 0.0 if np.isnan(again) else again
    jitter = 1.4826 * float(np.median(np.abs(step - usual))) / usual
    spread = float(np.std(step[missing == 0.0] - usual)) / usual
    gaps = tuple((float(time[a]), float(time[b])) for a, b in runs(missing > 0.0))[:20]
    uneven = max(jitter, spread)
    parts = []
    # No even clock stands behind stamps that differ so much and don't make up for each other: nothing is missing between them.
    unevenly = uneven > _JITTER_FAULT and not is_jitter(grid)
    if unevenly:
        lost, gaps = 0.0, ()
        low, high = 1e3 * np.quantile(step, (0.05, 0.95))
        parts.append(f"read unevenly: {low:.3g} to {high:.3g} ms apart, {1e3 * float(np.max(step)):.3g} ms at most")
    share = lost + again
    if lost > 0.0:
        parts.append(f"{100 * lost:.2g} % of the samples are missing, the longest gap {1e3 * float(np.max(step)):.3g} ms")
    if again > 0.002:
        parts.append(f"{100 * again:.2g} % of the samples repeat the one before")
    if uneven > _JITTER and not unevenly:
        parts.append(f"stamps jitter by {100 * uneven:.0f} % of a step")
    # What was made of them when the recording was made ready for use.
    parts += [note for note in view.record.notes if note.startswith(("stamps jitter", "the stamps", NOTE))]
    bad = share > _FAULT or (uneven > _JITTER_FAULT and not unevenly)
    verdict: Verdict = "fault" if bad else "warning" if parts else "ok"
    remedy = "record on the machine that reads the sensor, stamp at the source; --time log may be more even"
    if verdict == "ok":
        remedy = ""
    elif unevenly and verdict == "warning":
        remedy = "read the sensor in a loop of an even period; until then fits interpolate between the samples"
    detail = "; ".join(parts) or f"even to {float(f'{100 * uneven:.1g}'):g} % of a step, nothing missing"
    return Finding("stamps", verdict, detail, share, "1", remedy=remedy, time=gaps)


CHECK = Check("stamps", "stamps, gaps and repeated samples", "stamps", each(_judge))
