"""Signals that were not sampled together, brought onto one time base.

A signal sampled at its own times s_j with values x_j is wanted at the times t_i of the others.

- A motion (position, velocity, reference) is smooth: the cubic spline through its samples.
- A force that is held from s_j to s_(j+1) and acts, on the new base, from t_i to t_(i+1) gives the same impulse when its value
  is the mean of the held one over that interval.
- A force that was logged more seldom than its controller ran is not held between its samples: the straight line between them
  comes nearest, and each of the new values is then held over one step of the new base. Which of the two a force is can't be
  told from its samples. The motion tells: of both, that which the equation of motion u = m a + d v + c sgn v + k q + b
  explains better is taken.
- Anything else: the straight line.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..record import Array, Mask

__all__ = ["Placed", "as_held", "explained", "is_seldom", "place"]

SMOOTH = frozenset({"position", "velocity", "reference"})
_SLOWER = 1.5  # steps longer than this many of the base are another rate, not jitter
_GAP = 10  # steps without a sample that are a gap, as in a recording's checks
_GAP_FLOOR = 0.05  # [s]


@dataclass(frozen=True)
class Placed:
    """A signal on another time base; arrays of shape ``(n_samples,)``.

    Attributes:
        values: NaN before its first and after its last sample.
        bridged: True within a gap of its own samples.
        how: what was done, for a note.
    """

    values: Array
    bridged: Mask
    how: str


def is_seldom(signal: Array) -> bool:
    """True when a signal has values in some rows only, evenly spread: it was sampled at a rate of its own."""
    rows = np.flatnonzero(np.isfinite(signal))
    return rows.size > 2 and float(np.median(np.diff(rows))) > _SLOWER


def place(name: str, base: Array, own: Array, values: Array, hold: str, position: Array | None) -> Placed:
    """A signal at other times.

    Args:
        name: of the signal; what is smooth follows from it.
        base: wanted times [s], increasing.
        own: times of its samples [s], increasing.
        values: its samples, finite.
        hold: of an effort, see :attr:`fric.record.Record.effort_hold`.
        position: at ``base``, by which an effort is judged; None when it is not known there.
    """
    step, base_step = float(np.median(np.diff(own))), float(np.median(np.diff(base)))
    slower = step > _SLOWER * base_step
    last = own[-1] + (step if name == "effort" and hold == "following" else 0.0)
    first = own[0] - (step if name == "effort" and hold == "preceding" else 0.0)
    tolerance = 1e-6 * base_step
    if name in SMOOTH and own.size > 3:
        from scipy.interpolate import CubicSpline  # slow to import

        found, how = np.asarray(CubicSpline(own, values)(np.clip(base, own[0], own[-1]))), "by a cubic spline"
    elif name == "effort" and hold != "linear":
        found, how = _force(base, own, values, hold, slower, position)
        if how.startswith("by the line") or slower is False:
            first, last = (own[0], last) if slower else (first, last)
    else:
        found, how = np.interp(base, own, values), "by the line between its samples"
    found = np.where((base < first - tolerance) | (base > last + tolerance), np.nan, found)
    right = np.clip(np.searchsorted(own, base, side="left"), 1, own.size - 1)
    wide = own[right] - own[right - 1] > max(_GAP * step, _GAP_FLOOR)
    inside = (base > own[right - 1] + tolerance) & (base < own[right] - tolerance)
    return Placed(found.astype(np.float64), wide & inside, how)


def _force(base: Array, own: Array, values: Array, hold: str, slower: bool, position: Array | None) -> tuple[Array, str]:
    held = as_held(base, own, values, hold)
    if not slower:
        return held, "by its mean over each step"
    line = np.interp(base, own, values)
    if position is None or not np.all(np.isfinite(position)):
        return line, "by the line between its samples"
    inside = (base >= own[0]) & (base <= own[-1])
    window = 2 * round(float(np.median(np.diff(own)) / np.median(np.diff(base)))) + 1
    # The motion's derivatives at t_i belong to the force around t_i: the mean of the steps on either side of it.
    other = -1 if hold == "following" else 1
    around = [0.5 * (force + np.roll(force, -other)) for force in (line, held)]
    left = [explained(base[inside], position[inside], force[inside], window) for force in around]
    shares = f"the motion leaves {100 * left[0]:.2g} % of it unexplained, held between its samples {100 * left[1]:.2g} %"
    if left[1] < left[0]:
        return held, f"as held between its samples (by the line between them {shares})"
    return line, f"by the line between its samples ({shares})"


def as_held(base: Array, own: Array, values: Array, hold: str) -> Array:
    """Mean of a held force over each step of the base: that after a time when it is ``following``, that before it otherwise."""
    step = float(np.median(np.diff(base)))
    if hold == "following":
        edges, levels = np.append(base, base[-1] + step), values
        knots = np.append(own, max(own[-1] + float(np.median(np.diff(own))), edges[-1]))
    else:
        edges, levels = np.concatenate(([base[0] - step], base)), values
        knots = np.concatenate(([min(own[0] - float(np.median(np.diff(own))), edges[0])], own))
    impulse = np.concatenate(([0.0], np.cumsum(levels * np.diff(knots))))
    found: Array = np.diff(np.interp(edges, knots, impulse)) / np.diff(edges)
    return found


def explained(time: Array, position: Array, force: Array, window: int) -> float:
    """What the equation of motion leaves of a force while it slides one way, RMS as a share of the force's own.

    All of it is smoothed alike, by two means over ``window`` samples; where the motion turns round or rests within them, or is
    slower than a twentieth of its RMS speed, the friction isn't that of sliding and the samples don't count.
    """
    step = float(np.median(np.diff(time)))
    if time.size < 8 * window:
        return float("inf")
    velocity = np.gradient(position, step)
    columns = np.stack([np.gradient(velocity, step), velocity, position, force], axis=1)
    running = np.cumsum(np.concatenate((np.zeros((1, 4)), columns - columns.mean(axis=0))), axis=0)
    once = (running[window:] - running[:-window]) / window
    running = np.cumsum(np.concatenate((np.zeros((1, 4)), once)), axis=0)
    acceleration, speed, place, target = ((running[window:] - running[:-window]) / window).T
    speed = speed + velocity.mean()
    reach = 2 * window - 1
    slow = np.abs(speed) < 0.05 * float(np.sqrt(np.mean(speed**2)))
    turning = np.convolve(slow | (np.diff(np.sign(speed), prepend=0.0) != 0.0), np.ones(reach), "same") > 0.5
    if np.count_nonzero(~turning) < 8 * window:
        return float("inf")
    regressors = np.stack([acceleration, speed, np.sign(speed), place, np.ones_like(speed)], axis=1)[~turning]
    scale = np.linalg.norm(regressors, axis=0)
    regressors = regressors / np.where(scale > 0, scale, 1.0)
    target = target[~turning]
    left = target - regressors @ np.linalg.lstsq(regressors, target, rcond=None)[0]
    size = float(np.std(target))
    return float(np.sqrt(np.mean(left**2))) / size if size > 0 else float("inf")
