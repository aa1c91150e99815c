"""Methods meet axes: every seed draws an axis, records it, identifies it, tunes each method and lets it follow the task.

Seeds are interleaved: each goes through all axes and methods before the next, so that a slow drift of the machine that runs
them falls on all alike, and a run that is stopped early is still a comparison. What is compared is the ratio to the first
method on the same seed. Its interval is that of the mean of logarithms over the seeds, by Student's t at 90 %; a gain counts
only where its interval excludes 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from ...errors import InputError
from ...record import Array
from .axes import AXES
from .methods import METHODS, NEEDS_SPRINGS, Bench, peak_at_reversals

__all__ = ["Cell", "Outcome", "compete", "interval", "table"]

_LEVEL = 0.9  # statistical
_AGED = ("coulomb", "stribeck", "presliding", "viscous", "bias", "motor_coulomb", "motor_viscous")


@dataclass(frozen=True)
class Outcome:
    """One method on one axis of one seed.

    Attributes:
        rms: of the tracking error, second half of the task [x].
        peak: mean largest error after a reversal there [x].
        force: root mean square of the command there [F].
        saturated: number of samples whose force was limited.
        failed: why there is no figure; empty: there is.
    """

    rms: float
    peak: float
    force: float
    saturated: int
    failed: str = ""


@dataclass(frozen=True)
class Cell:
    """One method on one axis, over the seeds.

    Attributes:
        axis: its id.
        method: its name.
        outcomes: one for each seed.
    """

    axis: str
    method: str
    outcomes: tuple[Outcome, ...]

    def values(self, name: str) -> Array:
        """``rms``, ``peak`` or ``force`` of the seeds, ``(n_seeds,)``; NaN where it failed."""
        return np.array([math.nan if each.failed else getattr(each, name) for each in self.outcomes])


def interval(ratios: Array) -> tuple[float, float, float]:
    """Geometric mean of ratios and its interval; without limits for a single one."""
    logs = np.log(ratios[np.isfinite(ratios) & (ratios > 0.0)])
    n = logs.shape[0]
    if n == 0:
        return math.nan, math.nan, math.nan
    middle = float(np.mean(logs))
    if n == 1:
        return math.exp(middle), 0.0, math.inf
    half = float(student.ppf(0.5 + 0.5 * _LEVEL, n - 1) * np.std(logs, ddof=1) / math.sqrt(n))
    return math.exp(middle), math.exp(middle - half), math.exp(middle + half)


def _outcome(bench: Bench, name: str) -> Outcome:
    try:
        course = METHODS[name](bench)
    except InputError as error:
        return Outcome(math.nan, math.nan, math.nan, 0, error.problem)
    if not course.stable:
        return Outcome(math.nan, math.nan, math.nan, course.saturated, "unstable")
    half = course.reference.position.shape[0] // 2
    rms = float(np.sqrt(np.mean(course.error[half:] ** 2)))
    force = float(np.sqrt(np.mean(course.force[half:] ** 2)))
    return Outcome(rms, peak_at_reversals(course, half), force, course.saturated)


def compete(
    seeds: Sequence[int],
    axes: Sequence[str] = (),
    methods: Sequence[str] = (),
    *,
    aged: bool = False,
    told: Callable[[str], None] = lambda _: None,
) -> list[Cell]:
    """Every method on every axis over the seeds.

    Args:
        seeds: of axes and noise.
        axes: ids; empty: all.
        methods: names; empty: all.
        aged: True lets the friction change within +-20 % after the recording.
        told: is told what comes next.

    Raises:
        InputError: an axis or method is unknown.
    """
    chosen_axes, chosen = list(axes) or list(AXES), list(methods) or list(METHODS)
    for names, choices, what in ((chosen_axes, list(AXES), "axis"), (chosen, list(METHODS), "method")):
        for name in names:
            if name not in choices:
                raise InputError("comparison", f"no {what} '{name}'", f"choose from {', '.join(choices)}")
    found: dict[tuple[str, str], list[Outcome]] = {}
    for seed in seeds:
        for axis_id in chosen_axes:
            axis = AXES[axis_id]
            told(f"seed {seed}, {axis.title}: recording and identification")
            truth = axis.drawn(seed)
            known = axis.identified(*axis.recorded(truth, seed))
            at_work = axis.drawn(seed + 500_000, _AGED, truth) if aged else truth
            bench = Bench(axis, at_work, seed, known)
            for name in chosen:
                if name in NEEDS_SPRINGS and known.dnlrx is None:
                    continue
                told(f"seed {seed}, {axis_id}: {name}")
                found.setdefault((axis_id, name), []).append(_outcome(bench, name))
    return [Cell(axis, method, tuple(each)) for (axis, method), each in found.items()]


def table(cells: Sequence[Cell]) -> list[tuple[str, ...]]:
    """Rows of text: axis, method, tracking RMS with spread, its ratio to the first method's with interval, peak, force."""
    rows: list[tuple[str, ...]] = []
    first: dict[str, Cell] = {}
    for cell in cells:
        base = first.setdefault(cell.axis, cell)
        rms, peak, force = cell.values("rms"), cell.values("peak"), cell.values("force")
        if not np.any(np.isfinite(rms)):
            rows.append((cell.axis, cell.method, cell.outcomes[0].failed, "", "", "", ""))
            continue
        gain, low, high = interval(base.values("rms") / rms)
        counts = low > 1.0 or high < 1.0
        spread = f"{np.nanmin(rms):.3g} to {np.nanmax(rms):.3g}"
        rows.append(
            (
                cell.axis,
                cell.method,
                f"{np.nanmedian(rms):.3g}",
                spread,
                f"{gain:.3g} ({low:.3g} to {high:.3g}){'' if counts else ' ns'}",
                f"{np.nanmedian(peak):.3g}",
                f"{np.nanmedian(force):.3g}",
            )
        )
    return rows
