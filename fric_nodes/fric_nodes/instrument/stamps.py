"""Stamps: gaps, samples that are missing, samples that were repeated, jitter.

A step of n median steps is n - 1 missing samples. A sample with the same position and the same effort as the one before,
while both usually change, is the one before again. The value is the share of samples that are missing or repeated.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..record import Array, Record
from .check import Check, Evidence, Finding, Verdict, each
from .view import View, runs

__all__ = ["CHECK", "repeated", "with_even_stamps"]

_FAULT = 0.04
_JITTER_FAULT = 0.35
_JITTER = 0.1
_NONE_LOST = 0.5  # of a sample
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


def with_even_stamps(record: Record) -> Record:
    """``record`` with stamps a whole number of samples apart, but across gaps."""
    line = _without_gaps(record)
    if line is not None:
        return replace(record, time=line - line[0])
    step = np.diff(record.time)
    apart = np.maximum(np.round(step / record.sample_time), 1.0)
    number = np.concatenate([[0.0], np.cumsum(apart)])
    pieces = np.split(np.arange(number.shape[0]), np.flatnonzero(apart > 1.0) + 1)
    period = float(np.polyfit(number, record.time, 1)[0])
    time = np.empty_like(record.time)
    for piece in pieces:
        time[piece] = period * number[piece] + float(np.mean(record.time[piece] - period * number[piece]))
    time -= time[0]
    return replace(record, time=time) if np.all(np.diff(time) > 0.0) else record


def _without_gaps(record: Record) -> Array | None:
    """Even stamps [s], where none of the record's own is half a sample or more away from one: then no sample is missing."""
    every = np.arange(record.n_samples, dtype=np.float64)
    line = np.asarray(np.polyval(np.polyfit(every, record.time, 1), every))
    # One lost sample alone shifts what comes after it by one: no line is closer than half a sample then.
    return line if float(np.max(np.abs(record.time - line))) < _NONE_LOST * record.sample_time else None


def _judge(view: View, evidence: Evidence) -> Finding:
    time = view.record.time
    step = np.diff(time)
    usual = view.record.sample_time
    missing = np.maximum(np.round(step / usual) - 1.0, 0.0)
    if _without_gaps(view.record) is not None:
        missing[:] = 0.0
    lost = float(np.sum(missing)) / (time.size + float(np.sum(missing)))
    again = repeated(view) if view.moves else float("nan")
    again = 0.0 if np.isnan(again) else again
    jitter = 1.4826 * float(np.median(np.abs(step - usual))) / usual
    spread = float(np.std(step[missing == 0.0] - usual)) / usual
    gaps = tuple((float(time[a]), float(time[b])) for a, b in runs(missing > 0.0))[:20]
    share = lost + again
    parts = []
    if lost > 0.0:
        parts.append(f"{100 * lost:.2g} % of the samples are missing, the longest gap {1e3 * float(np.max(step)):.3g} ms")
    if again > 0.002:
        parts.append(f"{100 * again:.2g} % of the samples repeat the one before")
    uneven = max(jitter, spread)
    if uneven > _JITTER:
        parts.append(f"stamps jitter by {100 * uneven:.0f} % of a step")
    bad = share > _FAULT or uneven > _JITTER_FAULT
    verdict: Verdict = "fault" if bad else "warning" if parts else "ok"
    remedy = (
        "" if verdict == "ok" else "record on the machine that reads the sensor, stamp at the source; --time log may be evener"
    )
    detail = "; ".join(parts) or f"even to {100 * uneven:.1g} % of a step, nothing missing"
    return Finding("stamps", verdict, detail, share, "1", remedy=remedy, time=gaps)


CHECK = Check("stamps", "stamps, gaps and repeated samples", "stamps", each(_judge))
