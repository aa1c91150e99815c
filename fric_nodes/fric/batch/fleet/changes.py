"""When a parameter of an axis changes, told day by day from the days before, with a stated rate of false alarms.

A value is the median of an axis on a day. What all axes do on a day (weather, say) is taken off first: the median over axes of
their distance from their own medians. Two tests then run every day, each at the same share of the rate of false alarms:

``step``   the value against a straight line through the days before, fitted by least squares: Student's t with n - 2 degrees of
           freedom, exact for independent normal scatter. The scatter is never taken as smaller than the standard errors of the
           identifications say. After an alarm the axis begins anew.
``apart``  the change since the first days of the axis against that of its twins on the same day, by median and median absolute
           deviation (MAD); finds what grows too slowly for a step. Student's t with 0.37 (n - 1) degrees of freedom: the MAD
           is worth 37 % of the values to a standard deviation (Huber and Ronchetti, Robust Statistics, 2009, section 5.1).

Scatter is neither independent nor normal in practice. The limit of each test is therefore taken from the distribution that its
statistic has over all axis-days (the empirical null of Efron (2004), J. Am. Stat. Assoc. 99, 96-104): a Student's t whose scale
and degrees of freedom give the same median and the same 98 % quantile, which a few changed axes do not move. It only widens
the limit of the theory. With too few axis-days for these quantiles, the theory's stands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtri
from scipy.stats import norm
from scipy.stats import t as student

from ...record import Array, Index, Mask

__all__ = ["FALSE_ALARMS", "Alarm", "alarms_of", "robust_z", "without_common"]

FALSE_ALARMS = 2.5e-4
"""Expected per axis-day, over all parameters and both tests (statistical level): a quarter of one in 1,000."""

_WINDOW = 21  # [d] that a line goes through, physical: three weeks, within which a drift is straight
_LEARNT = 7  # days before the first judgement (statistical: five degrees of freedom for the scatter)
_TWINS = 10  # axes for a comparison among twins (statistical: three degrees of freedom for its scale)
_COMMON = 5  # axes for what they have in common (statistical: one of them cannot make the median)
_FOR_TAILS = 2000  # axis-days for a 98 % quantile (statistical: 40 of them are beyond it)
_TAIL = 0.98  # quantile by which the tails are judged (statistical: three in a thousand changed axis-days leave it as it is)
_MAD = float(1.0 / ndtri(0.75))  # from MAD to standard deviation of a normal distribution
_WORTH = 0.37  # efficiency of the MAD at the normal distribution


@dataclass(frozen=True)
class Alarm:
    """A change of one axis.

    Attributes:
        axis: index of the axis.
        day: index of the day on which it was found.
        kind: ``step``, ``apart``, or ``one day`` for what was gone the day after.
        size: how far the value is from what was expected, in the parameter's unit.
        z: the same in standard deviations of a normal distribution of the same probability, at its largest.
    """

    axis: int
    day: int
    kind: str
    size: float
    z: float


def robust_z(values: Array) -> tuple[Array, float]:
    """How far each value is from the others' median, as a quantile of the normal distribution, and the scale used.

    Args:
        values: shape ``(n,)``; NaN where there is none.
    """
    held = np.isfinite(values)
    count = int(held.sum())
    if count < _TWINS:
        return np.full(values.shape, np.nan), float("nan")
    middle = float(np.median(values[held]))
    scale = _MAD * float(np.median(np.abs(values[held] - middle)))
    if scale <= 0.0:
        return np.full(values.shape, np.nan), 0.0
    return _as_normal((values - middle) / scale, _WORTH * (count - 1)), scale


def _as_normal(t: Array, freedom: Array | float) -> Array:
    """The quantile of the normal distribution with the probability that Student's ``t`` has."""
    tail = student.logsf(np.abs(t), freedom)
    # Beyond the reach of numbers the normal quantile grows as the root of the logarithm does.
    normal = np.where(tail > -700.0, norm.isf(np.exp(np.maximum(tail, -700.0))), np.sqrt(np.maximum(-2.0 * tail, 0.0)))
    return np.asarray(np.sign(t) * normal, dtype=np.float64)


def without_common(values: Array) -> Array:
    """Values less what all axes do on a day.

    Args:
        values: shape ``(n_axes, n_days)``; NaN where there is none.
    """
    held = np.isfinite(values)
    left = values - _median(values, 1)[:, None]
    enough = held.sum(axis=0) >= _COMMON
    common = np.where(enough, _median(left, 0), 0.0)
    return values - np.where(np.isfinite(common), common, 0.0)


def _median(values: Array, along: int) -> Array:
    """Medians of what is finite; NaN where nothing is."""
    held = np.isfinite(values).any(axis=along)
    found = np.full(held.shape, np.nan)
    if along == 0:
        found[held] = np.nanmedian(values[:, held], axis=0)
    else:
        found[held] = np.nanmedian(values[held], axis=1)
    return found


def alarms_of(values: Array, errors: Array, n_parameters: int) -> list[Alarm]:
    """The changes of one parameter, one for each time that an axis begins to differ.

    Args:
        values: medians of axes and days, shape ``(n_axes, n_days)``; NaN where there is none.
        errors: their standard errors as identified, of the same shape; NaN where not known.
        n_parameters: how many parameters share the rate of false alarms.
    """
    level = FALSE_ALARMS / (2.0 * n_parameters)
    plain = without_common(values)
    known = np.where(np.isfinite(errors), errors, 0.0)
    first, _ = _steps(plain, known, np.inf)
    beyond, spread = _limit(first, level)
    z, size = _steps(plain, known, beyond)
    found = []
    for axis, day in np.argwhere(np.abs(z) > beyond):
        away = float(size[axis, day])
        found.append(Alarm(int(axis), int(day), _kind(plain[axis], int(day), away), away, float(z[axis, day] / spread)))
    return found + _apart(plain, level)


def _limit(z: Array, level: float) -> tuple[float, float]:
    """The limit that ``z`` passes with the probability ``level``, and its ratio to that of the normal distribution."""
    usual = float(norm.isf(0.5 * level))
    seen = np.abs(z[np.isfinite(z)])
    if seen.size < _FOR_TAILS:
        return usual, 1.0
    middle, tail = (float(each) for each in np.quantile(seen, (0.5, _TAIL)))
    scale = max(1.0, middle / float(ndtri(0.75)))

    def excess(inverse: float) -> float:
        freedom = 1.0 / inverse
        return float(student.ppf(0.5 + 0.5 * _TAIL, freedom) / student.ppf(0.75, freedom)) - tail / middle

    lightest, heaviest = 1e-4, 0.5  # one over the degrees of freedom: normal, and the last with a variance
    if middle <= 0.0 or excess(lightest) >= 0.0:
        limit = usual * scale
    else:
        inverse = heaviest if excess(heaviest) <= 0.0 else brentq(excess, lightest, heaviest)
        own = middle / float(student.ppf(0.75, 1.0 / inverse))
        limit = max(usual, own * float(student.isf(0.5 * level, 1.0 / inverse)))
    return limit, limit / usual


def _steps(values: Array, errors: Array, limit: float) -> tuple[Array, Array]:
    """Quantile and size of each day's distance from the line through the days before; NaN where that is not known.

    An axis begins anew on a day whose quantile is beyond ``limit``.
    """
    n_axes, n_days = values.shape
    z, size = np.full(values.shape, np.nan), np.full(values.shape, np.nan)
    start = np.zeros(n_axes, dtype=np.int64)
    for day in range(_LEARNT, n_days):
        first = max(day - _WINDOW, 0)
        days = np.arange(first, day)
        window = values[:, first:day]
        use = np.isfinite(window) & (days[None, :] >= start[:, None])
        judged = (use.sum(axis=1) >= _LEARNT) & np.isfinite(values[:, day])
        if not judged.any():
            continue
        where = np.flatnonzero(judged)
        t, freedom, away = _line(window[where], use[where], (days - day).astype(np.float64), errors[where, first:day],
                                 values[where, day], errors[where, day])  # fmt: skip
        z[where, day], size[where, day] = _as_normal(t, freedom), away
        start[where[np.abs(z[where, day]) > limit]] = day
    return z, size


def _line(window: Array, use: Mask, at: Array, errors: Array, now: Array, error_now: Array) -> tuple[Array, Array, Array]:
    """Student's t of a new value against a line, its degrees of freedom, and the distance; ``at``: days before [d]."""
    n = use.sum(axis=1).astype(np.float64)
    x, y = np.where(use, at, 0.0), np.where(use, window, 0.0)
    middle_x, middle_y = x.sum(axis=1) / n, y.sum(axis=1) / n
    dx, dy = np.where(use, at - middle_x[:, None], 0.0), np.where(use, y - middle_y[:, None], 0.0)
    sxx = (dx**2).sum(axis=1)
    slope = (dx * dy).sum(axis=1) / sxx
    left = ((dy - slope[:, None] * dx) ** 2).sum(axis=1)
    stated = np.where(use, errors**2, 0.0).sum(axis=1) / n
    variance = np.maximum(left / (n - 2.0), stated)
    away = now - (middle_y - slope * middle_x)
    wide = variance * (1.0 + 1.0 / n + middle_x**2 / sxx) + np.maximum(error_now**2 - variance, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(wide > 0.0, away / np.sqrt(wide), np.where(away == 0.0, 0.0, np.inf * np.sign(away)))
    return np.clip(t, -1e6, 1e6), n - 2.0, away


def _kind(values: Array, day: int, size: float) -> str:
    """Whether a step was gone the day after, by more than half of it; the last day's cannot be told."""
    later = values[day + 1 :]
    later = later[np.isfinite(later)]
    gone = later.size > 0 and (values[day] - later[0]) * np.sign(size) > 0.5 * abs(size)
    return "one day" if gone else "step"


def _apart(values: Array, level: float) -> list[Alarm]:
    """Axes that have changed otherwise than their twins, each from the first day on which that shows."""
    n_days = values.shape[1]
    order = np.cumsum(np.isfinite(values), axis=1)
    learning = (order <= _LEARNT) & np.isfinite(values)
    first = _median(np.where(learning, values, np.nan), 1)
    change = np.where(order > _LEARNT, values - first[:, None], np.nan)
    z = np.full(values.shape, np.nan)
    for day in range(n_days):
        z[:, day], _ = robust_z(change[:, day])
    limit, spread = _limit(z, level)
    found = []
    for axis in np.flatnonzero((np.abs(z) > limit).any(axis=1)):
        days: Index = np.flatnonzero(np.abs(z[axis]) > limit)
        most = int(days[np.argmax(np.abs(z[axis, days]))])
        kind = "one day" if days.size == 1 and days[0] < np.flatnonzero(np.isfinite(z[axis]))[-1] else "apart"
        found.append(Alarm(int(axis), int(days[0]), kind, float(change[axis, most]), float(z[axis, most] / spread)))
    return found
