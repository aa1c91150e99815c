"""Saturated: the force stays at its extreme with sharp corners while the motion goes on changing.

A smooth peak is as flat as that near its top, but it widens: the time that a parabola spends within four tolerances of its
top is twice the time within one, that of a clipped signal hardly longer. A force that is held while the axis rests or moves
steadily (a deflection before a release, friction in a slow stroke) is level by nature, unless it has noise on it everywhere but
there: noise doesn't stop by itself. One that has levels of its own (switched, or stepped) is meant so. Where the force balance
of the axis holds at the limit as well as elsewhere, the force recorded is the one that acted, and nothing is wrong with the
recording: the drive was at its limit. Where it doesn't, the sensor was at its own, or the command was recorded and not the
force. The value is the share of the recording that is spent at a limit.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_closing

from ...record import Array
from ..check import Check, Evidence, Finding, each
from ..view import View, imbalance, runs

__all__ = ["CHECK", "Plateau", "clipped", "plateaus"]

_SHORTEST = 0.015  # [s] of a plateau
_FEWEST = 5  # samples
_EXACT = 1e-4  # of the force range: tolerance of a plateau without noise
_FLAT = 0.005  # the same with noise, at least
_COARSE = 0.05  # the same, at most
_ALIVE = 4.0  # times that tolerance: with so much noise, from sample to sample, a force can't be exactly level by nature
_RARE = 0.4  # share of a recording up to which plateaus are a limit and not the excitation
_WIDENING = 1.4  # between 1 for a clipped signal and 2 for a parabola
_STEADY = 0.08  # of the recording's high speed: change of speed within a plateau, or beside it
_FAULT = 0.003
_HELD = 0.1  # [s] that a force is held for, at least, when somebody wants it so
_SURE = 4.0  # standard errors
_OFF = 1.5  # times the imbalance elsewhere
_OFF_SHARE = 0.015  # of the force range


class Plateau(NamedTuple):
    """A force at its limit: its first sample, the one after the last, and its level [F]."""

    first: int
    last: int
    level: float


def plateaus(view: View) -> list[Plateau]:
    """Where the force of ``view`` is at a limit."""
    record = view.record
    effort, time = record.effort, record.time
    spread = float(np.ptp(effort))
    if spread == 0.0 or record.n_samples < 40 or not view.moves:
        return []
    velocity = np.interp(time, np.arange(view.n) * view.h, view.velocity)
    # A sensor's limit is exact, a drive's has the noise of its measurement on it.
    noise = 1.4826 * float(np.median(np.abs(np.diff(effort, 2)))) / np.sqrt(6.0)
    exact = _EXACT * spread
    for tolerance in (exact, max(_FLAT * spread, 3.0 * noise)):
        cut_off = tolerance == exact and noise > _ALIVE * exact
        found: list[Plateau] = []
        if tolerance > _COARSE * spread:
            continue
        for extreme in (float(np.min(effort)), float(np.max(effort))):
            for first, last, level in _flat(effort, extreme, tolerance):
                long_enough = time[last - 1] - time[first] >= _SHORTEST and last - first >= _FEWEST
                # Exactly zero is a drive that is switched off.
                level_by_limit = cut_off and level != 0.0
                if long_enough and (level_by_limit or float(np.ptp(velocity[first:last])) > _STEADY * view.speed):
                    found.append(Plateau(first, last, level))
        total = sum(last - first for first, last, _ in found)
        if found and (cut_off or total <= _RARE * record.n_samples) and not _levels(effort, found, tolerance):
            return found
    return []


def _flat(effort: Array, extreme: float, tolerance: float) -> list[tuple[int, int, float]]:
    """Runs near the extreme that don't widen as a smooth peak does, with their level."""
    # The extreme itself may be a spike on top of the plateau; what the force reaches most often near it is the plateau.
    near = effort[np.abs(effort - extreme) <= 4.0 * tolerance]
    level = float(np.median(near))
    wide_runs = runs(np.abs(effort - level) <= 4.0 * tolerance)
    # Single samples of noise don't end a plateau.
    flat = binary_closing(np.abs(effort - level) <= tolerance, np.ones(5))
    found = []
    for first, last in runs(flat):
        around = sum(end - start for start, end in wide_runs if start < last and end > first)
        if around <= _WIDENING * (last - first):
            found.append((first, last, level))
    return found


def _levels(effort: Array, found: list[Plateau], tolerance: float) -> bool:
    """Whether the force has plateaus between its extremes as well, longer in all than those at the extremes."""
    if not found:
        return False
    shortest = min(last - first for first, last, _ in found)
    still = np.abs(np.diff(effort, prepend=effort[0])) <= 0.2 * tolerance
    extreme = np.zeros(effort.shape[0], dtype=np.bool_)
    for level in {plateau.level for plateau in found}:
        extreme |= np.abs(effort - level) <= 4.0 * tolerance
    zero = np.abs(effort) <= tolerance  # a force that is off is no level of an excitation
    others = sum(last - first for first, last in runs(still & ~extreme & ~zero) if last - first >= shortest)
    return others > sum(last - first for first, last, _ in found)


def clipped(view: View, found: list[Plateau]) -> list[Plateau]:
    """Those of ``found`` at which the force recorded isn't the one that acted.

    What was recorded has to fall short of what the balance of all other samples asks for there, by more than the balance leaves
    elsewhere and by more than its own standard error there. Only speeds that occur elsewhere too are judged: inertia is linear
    in the acceleration, friction need not be so in the speed.
    """
    if not found:
        return []
    inside = np.zeros(view.n, dtype=np.bool_)
    spans = []
    for plateau in found:
        first, last = (round(float(view.record.time[k]) / view.h) for k in (plateau.first, plateau.last - 1))
        spans.append(slice(first, last + 1))
        inside[spans[-1]] = True
    left, error = imbalance(view, inside)
    outside = left[~inside & np.isfinite(left)]
    if outside.size < 40:
        return []
    speeds = view.velocity[~inside & np.isfinite(left)]
    slow, fast = float(np.min(speeds)), float(np.max(speeds))
    usual = float(np.sqrt(np.mean(outside**2)))
    limit = max(_OFF * usual, _OFF_SHARE * float(np.ptp(view.force)))
    middle = float(np.median(view.force))
    wrong = []
    for plateau, span in zip(found, spans, strict=True):
        known = (
            np.isfinite(left[span]) & np.isfinite(error[span]) & (view.velocity[span] >= slow) & (view.velocity[span] <= fast)
        )
        if not np.any(known):
            continue
        # What acted was more than what was recorded.
        short = -math.copysign(1.0, plateau.level - middle) * float(np.mean(left[span][known]))
        if short > max(limit, _SURE * float(np.mean(error[span][known]))):
            wrong.append(plateau)
    return wrong


def _judge(view: View, evidence: Evidence) -> Finding:
    if not view.moves:
        return Finding("saturation", "unknown", "it does not move")
    found = plateaus(view)
    time = view.record.time
    if not found:
        return Finding("saturation", "ok", "the force stays at no limit while the motion changes", 0.0, "1")
    share = sum(last - first for first, last, _ in found) / view.record.n_samples
    levels = " and ".join(f"{level:.4g}" for level in sorted({plateau.level for plateau in found}))
    detail = f"the force stays at {levels} {view.record.units.force} {len(found)} time(s), {100 * share:.2g} % of the recording"
    wrong = sum(last - first for first, last, _ in clipped(view, found)) / view.record.n_samples
    visits = Counter(level for _, _, level in found)
    longest = max(float(time[b - 1] - time[a]) for a, b, _ in found)
    if wrong <= _FAULT and max(visits.values()) == 1 and longest > _HELD:
        # A limit cuts peaks off, again and again; a longer visit to a level is as well a force that was held there.
        detail += "; once at each level, as a constant force would, and the force balance does not contradict that"
        return Finding("saturation", "unknown", detail, share, "1")
    if wrong <= _FAULT:
        detail += "; the force balance holds there: the drive was at its limit, or the force was held"
    remedy = "command less acceleration or speed, or raise the limit; a fit leaves out parts without a force balance"
    spans = tuple((float(time[a]), float(time[b - 1])) for a, b, _ in found)[:50]
    return Finding("saturation", "fault" if wrong > _FAULT else "warning", detail, share, "1", remedy=remedy, time=spans)


CHECK = Check("saturation", "force at a limit", "motion", each(_judge))
