"""Pre-sliding from reversals: how stiff motion begins, over which way the friction turns round, how much of it is the rig's.

After a reversal the force changes by dF while the joint moves on from its turning point. dF is what it has come to at two and
a half times the way at which the slope of force over way has fallen to a tenth of its steepest
(:func:`.parts.knee`), or at the end of a stroke that is shorter than that: there friction has turned round, and
what it does further along the stroke, by place or slowly, isn't counted. The break-away distance d_b is the way to 90 % of
dF. Taken besides are the stiffness with which motion begins (slope between 2 % and 30 % of dF) and the way to half of dF.
Their means over the reversals of one recording and direction have standard errors that count the correlation from one
reversal to the next.

What lies between the place where the position is measured and the contact gives way too, in series: d_b = L + 0.9 dF/k_r,
with L the contact's own distance. If L is the contact's (bristles, asperities that bend by the same way whatever presses
them) and doesn't depend on the load, recordings under several loads tell the two apart: the part of d_b that grows in
proportion to dF and is common to all loads is the rig's, the part that stays is the contact's. With one load nothing but
bounds can be given: of two springs in series neither is softer than both together, dd/dF = 1/k_r + (dd/dF)_contact, so that
the rig is at least as stiff as the steepest part k_s of any reversal, and takes between nothing and 0.9 dF/k_s of d_b.

Source: Canudas de Wit et al. 1995 and Al-Bender, Lampaert, Swevers 2004 (pre-sliding: stiffness and break-away distance);
springs in series.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats
from scipy.optimize import isotonic_regression

from ...record import Array, Record
from .parts import Motion, Part, knee, turning_point
from .weighted import weighted

__all__ = ["LEVELS", "SHARE", "Compliance", "Presliding", "Reversal", "reversals", "rig_compliance", "serial_mean", "summary"]

SHARE = 0.9
"""Part of the change of force over which the break-away distance is taken."""

_TURNED = 2.5  # of the way to the knee: there friction has turned round
_LEAST_TURNED = 1.5
LEVELS = np.linspace(0.05, 0.95, 19)
"""Shares of the change of force at which mean ways are kept."""

_START = (0.02, 0.30)
_STEEP = 6  # levels: three tenths
_LEAST_SPREAD = 1.5  # of the changes of force, largest over smallest: less tells no proportion


@dataclass(frozen=True, eq=False)
class Reversal:
    """One reversal.

    Attributes:
        time: of the turning point [s].
        direction: of the motion after it.
        change: dF [F].
        stiffness: with which motion begins [F/x]; NaN where fewer than three samples show it.
        half: way to half of dF [x].
        distance: way to 90 % of dF, d_b [x].
        way: from the turning point on [x], shape ``(n,)``.
        share: of dF that has come, shape ``(n,)``.
    """

    time: float
    direction: float
    change: float
    stiffness: float
    half: float
    distance: float
    way: Array
    share: Array


@dataclass(frozen=True, eq=False)
class Presliding:
    """Reversals of one recording into one direction; each quantity with its standard error, and ``n`` of them.

    Attributes:
        source: the recording.
        load: mean, NaN where not recorded.
        direction: 1 forward, -1 backward.
        n: number of reversals.
        change: dF [F] and its error.
        stiffness: [F/x] and its error.
        half: way to half of dF [x] and its error.
        distance: way to 90 % of dF, d_b [x], and its error.
        steepest: largest slope over three tenths of dF, of the mean curve [F/x].
        ways: mean way at which each of :data:`LEVELS` of dF is reached [x], shape ``(n_levels,)``.
        coarse: the first sample after the turning point is beyond 30 % of dF, so that the beginning can't be seen.
    """

    source: str
    load: float
    direction: float
    n: int
    change: tuple[float, float]
    stiffness: tuple[float, float]
    half: tuple[float, float]
    distance: tuple[float, float]
    steepest: float
    ways: Array
    coarse: bool

    def interval(self, of: tuple[float, float], level: float = 0.95) -> tuple[float, float]:
        """Confidence interval of one of the quantities."""
        half = float(stats.t.ppf(0.5 + 0.5 * level, max(self.n - 1, 1))) * of[1]
        return of[0] - half, of[0] + half

    def least(self, steepest: float) -> float:
        """What the contact has at least of the break-away distance [x], with a rig as stiff as ``steepest`` [F/x]."""
        return max(self.distance[0] - SHARE * self.change[0] / steepest, 0.0)


@dataclass(frozen=True)
class Compliance:
    """What the loads tell about the rig.

    Attributes:
        told_apart: whether they do.
        compliance: 1/k_r [x/F] and its standard error.
        distance: L, the contact's own break-away distance [x], and its standard error.
        freedom: of the quantile of their intervals.
        misfit: root of its reduced sum of squares in standard errors.
        text: what it means, or why it can't be told.
    """

    told_apart: bool
    compliance: tuple[float, float]
    distance: tuple[float, float]
    freedom: int
    misfit: float
    text: str

    def interval(self, of: tuple[float, float], level: float = 0.95) -> tuple[float, float]:
        """Confidence interval of one of the quantities."""
        half = float(stats.t.ppf(0.5 + 0.5 * level, max(self.freedom, 1))) * of[1]
        return of[0] - half, of[0] + half


def reversals(record: Record, motion: Motion, parts: Sequence[Part], force: Array) -> list[Reversal]:
    """The reversals that lead to a settled part.

    Args:
        record: the recording.
        motion: of it.
        parts: its settled parts in the order of time.
        force: friction and bias force, what else acts on the joint taken off, shape ``(n_samples,)``.
    """
    found = []
    for part in parts:
        sign = part.direction
        before = motion.direction[: part.start]
        if not np.any(before == -sign):
            continue
        turn = turning_point(record, motion, part.start, sign)
        # Only the first settled part after a turn: at the others the friction has turned round long before.
        if not np.all(record.mask[turn : part.first + 1]) or any(turn < other.first < part.first for other in parts):
            continue
        way = sign * (record.position[turn : part.last] - record.position[turn])
        towards = sign * force[turn : part.last]
        turned = knee(way, towards)[0]
        if not np.isfinite(turned) or turned <= 0.0:
            continue
        end = min(_TURNED * turned, float(way[-1]))
        if end < _LEAST_TURNED * turned:
            continue
        first, n = (int(np.searchsorted(np.maximum.accumulate(way), x)) for x in (0.8 * end, end))
        n = max(n, first + 1)
        change = float(np.mean(towards[first:n]) - towards[0])
        if change <= 6.0 * part.error:
            continue
        way, share = way[:n], (towards[:n] - towards[0]) / change
        reached = _rising(share)
        if reached[-1] < LEVELS[-1]:
            continue
        half, distance = (_first(reached, way, level) for level in (0.5, SHARE))
        begins = (share >= _START[0]) & (share <= _START[1]) & (np.arange(share.shape[0]) <= int(np.argmax(share > _START[1])))
        slope = float("nan")
        if np.sum(begins) >= 3 and np.ptp(way[begins]) > 0:
            slope = float(np.polyfit(way[begins], share[begins], 1)[0]) * change
        found.append(Reversal(float(record.time[turn]), sign, change, slope, half, distance, way, share))
    return found


def _rising(share: Array) -> Array:
    """The nearest curve to ``share``, ``(n,)``, that doesn't fall: the largest value so far would run ahead on noise."""
    return np.asarray(isotonic_regression(share).x)


def _first(reached: Array, way: Array, level: float) -> float:
    """Way at which ``reached`` first comes to ``level``, between samples."""
    k = int(np.argmax(reached >= level))
    if k == 0:
        return float(way[0])
    part = (level - reached[k - 1]) / (reached[k] - reached[k - 1])
    return float(way[k - 1] + part * (way[k] - way[k - 1]))


def serial_mean(values: Array) -> tuple[float, float]:
    """Mean and its standard error, correlation from one value to the next taken into account (first order)."""
    n = values.shape[0]
    mean = float(np.mean(values))
    if n < 2:
        return mean, float("nan")
    left = values - mean
    energy = float(left @ left)
    variance = energy / (n - 1) / n
    if n < 4 or energy == 0.0:
        return mean, float(np.sqrt(variance))
    # The mean taken off makes the correlation come out too small, by about (1 + 3 rho)/n.
    rho = float(left[1:] @ left[:-1]) / energy
    rho = float(np.clip(rho + (1.0 + 3.0 * max(rho, 0.0)) / n, 0.0, 0.9))
    return mean, float(np.sqrt(variance * (1.0 + rho) / (1.0 - rho)))


def summary(record: Record, load: float, found: Sequence[Reversal]) -> list[Presliding]:
    """Means over the reversals of one recording, by direction; two reversals at least."""
    result = []
    for sign in (1.0, -1.0):
        own = [each for each in found if each.direction == sign]
        if len(own) < 2:
            continue
        ways = np.mean([[_first(_rising(e.share), e.way, x) for x in LEVELS] for e in own], axis=0)
        change = float(np.mean([each.change for each in own]))
        steepest = float(np.max(change * (LEVELS[_STEEP] - LEVELS[0]) / np.maximum(ways[_STEEP:] - ways[:-_STEEP], 1e-300)))
        stiff = np.array([each.stiffness for each in own if np.isfinite(each.stiffness) and each.stiffness > 0])
        result.append(
            Presliding(
                record.source,
                load,
                sign,
                len(own),
                serial_mean(np.array([each.change for each in own])),
                serial_mean(stiff) if stiff.size >= 2 else (float("nan"), float("nan")),
                serial_mean(np.array([each.half for each in own])),
                serial_mean(np.array([each.distance for each in own])),
                steepest,
                ways,
                bool(np.median([each.share[1] for each in own]) > _START[1]) or stiff.size < 0.5 * len(own),
            )
        )
    return result


def rig_compliance(found: Sequence[Presliding], position_unit: str, force_unit: str) -> Compliance:
    """Tell the rig's compliance from the contact's own distance, where the loads allow it."""
    nothing = (float("nan"), float("nan"))
    loads = [each.load for each in found if np.isfinite(each.load)]
    levels = np.sort(np.array([each.change[0] for each in found]))
    n_loads = 1 + int(np.sum(np.diff(np.sort(loads)) > 0.1 * np.max(np.abs(loads)))) if loads else 1
    if n_loads < 3 or levels[-1] < _LEAST_SPREAD * levels[0]:
        why = f"{n_loads} load(s)" if n_loads < 3 else f"changes of force from {levels[0]:.3g} to {levels[-1]:.3g} {force_unit}"
        text = (
            f"the rig's compliance can't be told from the contact's with {why}: {_bounds(found, position_unit, force_unit)}. "
            "Record the same strokes under two more loads, the largest at least twice the smallest, or measure the position at "
            "the contact"
        )
        return Compliance(False, nothing, nothing, 0, float("nan"), text)
    change = SHARE * np.array([each.change[0] for each in found])
    way = np.array([each.distance[0] for each in found])
    error = np.array([each.distance[1] for each in found])
    # One distance for each direction (the ends of a stroke need not be alike), one compliance.
    sides = sorted({each.direction for each in found})
    columns = np.stack([np.array([each.direction == side for each in found], dtype=np.float64) for side in sides] + [change], 1)
    fit = weighted(columns, way, error, sum(each.n - 1 for each in found))
    values, covariance = fit.values, fit.covariance
    compliance = (float(values[-1]), float(np.sqrt(covariance[-1, -1])))
    mean = np.append(np.full(len(sides), 1.0 / len(sides)), 0.0)
    distance = (float(mean @ values), float(np.sqrt(mean @ covariance @ mean)))
    result = Compliance(True, compliance, distance, fit.freedom, fit.misfit, "")
    low, high = result.interval(compliance)
    own = result.interval(distance)
    unit = f"{position_unit}/{force_unit}"
    text = (
        f"{n_loads} loads: a part of the break-away distance in proportion to the force, common to all of them, of "
        f"{compliance[0]:.3g} {unit} (95 %: {low:.3g} to {high:.3g})"
    )
    trouble = ""
    if high <= 0.0:
        trouble = "because the compliance comes out negative: the contact's own distance must decrease with the load"
    elif own[0] <= 0.0:
        trouble = "the distances scatter too much; sample reversals faster and repeat them"
    if trouble:
        text += f". Rig and contact can't be told apart, {trouble}. Bounds: {_bounds(found, position_unit, force_unit)}"
        return replace(result, told_apart=False, text=text)
    if low > 0.0:
        text += f", as of a rig of {1.0 / compliance[0]:.3g} {force_unit}/{position_unit}"
    else:
        text += f": none is found, the rig is stiffer than {1.0 / high:.3g} {force_unit}/{position_unit}"
    text += f"; free of it the contact's own distance is {distance[0]:.3g} {position_unit} (95 %: {own[0]:.3g} to {own[1]:.3g})"
    return replace(result, text=f"{text}. This holds if the contact's own distance doesn't depend on the load")


def _bounds(found: Sequence[Presliding], position_unit: str, force_unit: str) -> str:
    """What holds without telling rig and contact apart."""
    stiff = max(each.steepest for each in found)
    least = float(np.mean([each.least(stiff) for each in found]))
    most = float(np.mean([each.distance[0] for each in found]))
    return (
        f"of the mean break-away distance of {most:.3g} {position_unit} the contact has at least {least:.3g} {position_unit} "
        f"(with a rig as stiff as the steepest part, {stiff:.3g} {force_unit}/{position_unit}) and at most all"
    )
