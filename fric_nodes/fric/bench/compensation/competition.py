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

from ...control.trial import Course
from ...errors import InputError
from ...identification.result import IdentificationError
from ...record import Array
from .catalogue import AXES
from .methods import METHODS, NEEDS_SPRINGS, Bench, peak_at_reversals

__all__ = ["Cell", "Outcome", "compete", "failed", "interval", "rest_figures", "table", "text_of"]

_LEVEL = 0.9  # statistical
_CYCLE = 3.0  # physical: encoder steps; a position that flickers between two of them is at rest
_NOISE = 3.0  # statistical: standard deviations of a reading that count as a step
_SHOWN = 2.0 / 3.0  # of the second half of the task, in a plot
_AGED = ("coulomb", "stribeck", "presliding", "viscous", "bias", "motor_coulomb", "motor_viscous")


@dataclass(frozen=True)
class Outcome:
    """One method on one axis of one seed; the second half of the task counts, and the moves with rests.

    Attributes:
        rms: of the tracking error [x].
        peak: mean largest error after a reversal [x].
        force: root mean square of the command [F].
        saturated: number of samples whose force was limited.
        failed: why there is no figure; empty: there is.
        without_lag: RMS of the tracking error less the share that a constant lag explains [x].
        lag: that lag [s].
        settling: from the end of a move until the error stays within the axis's tolerance, mean over the moves; a move that
            doesn't settle counts with its whole rest [s].
        unsettled: number of moves that don't settle.
        width: range of the true position in the last third of the last rest [x].
        hunts: whether that is a limit cycle: more than three steps of the encoder, or than nine standard deviations of a
            reading.
        power: mean of |force times velocity| [F x/s].
        share: largest command over the limit [1].
    """

    rms: float
    peak: float
    force: float
    saturated: int
    failed: str = ""
    without_lag: float = math.nan
    lag: float = math.nan
    settling: float = math.nan
    unsettled: int = 0
    width: float = math.nan
    hunts: bool = False
    power: float = math.nan
    share: float = math.nan


def failed(why: str, saturated: int = 0) -> Outcome:
    """The outcome without figures."""
    return Outcome(math.nan, math.nan, math.nan, saturated, why)


@dataclass(frozen=True)
class Cell:
    """One method on one axis, over the seeds.

    Attributes:
        axis: its id.
        method: its name.
        outcomes: one for each seed.
        error: of the last period of the task, first seed, ``(2, n)``: time [s] and error [x]; None: there is none.
    """

    axis: str
    method: str
    outcomes: tuple[Outcome, ...]
    error: Array | None = None

    def values(self, name: str) -> Array:
        """A figure of :class:`Outcome` by its name, ``(n_seeds,)``; NaN where the method failed."""
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


def rest_figures(course: Course, tolerance: float) -> tuple[float, int, float]:
    """Settling [s], number of moves that don't settle, and range of the position at the end of the last rest [x]."""
    still = course.reference.velocity == 0.0
    period, n = course.reference.period, still.shape[0]
    ends = np.flatnonzero(still[1:] & ~still[:-1]) + 1
    begins = np.append(np.flatnonzero(~still[1:] & still[:-1]) + 1, n)
    times, unsettled, last = [], 0, np.zeros(1)
    for end in ends.tolist():
        after = int(begins[begins > end][0])
        outside = np.flatnonzero(np.abs(course.error[end:after]) > tolerance)
        took = 0 if outside.size == 0 else int(outside[-1]) + 1
        unsettled += took >= after - end
        times.append(took * period)
        last = course.position[after - (after - end) // 3 : after]
    return float(np.mean(times)) if times else math.nan, unsettled, float(np.ptp(last))


def _outcome(bench: Bench, name: str) -> tuple[Outcome, Array | None]:
    axis = bench.axis
    try:
        setup = METHODS[name](bench)
        course = bench.run(setup.law(), setup.force())
        if not course.stable:
            return failed("unstable", course.saturated), None
        elsewhere = setup.force if setup.elsewhere is None else setup.elsewhere
        resting = bench.run(setup.law(), elsewhere(), axis.resting)
    except InputError as why:
        return failed(why.problem), None
    half = course.reference.position.shape[0] // 2
    error, velocity, force = course.error[half:], course.reference.velocity[half:], course.force[half:]
    lag = float(error @ velocity / (velocity @ velocity))
    settling, unsettled, width = rest_figures(resting, axis.tolerance)
    step = max(axis.timing.resolution, _NOISE * axis.position_noise)
    moved = np.gradient(course.position[half:], course.reference.period)
    outcome = Outcome(
        float(np.sqrt(np.mean(error**2))),
        peak_at_reversals(course, half),
        float(np.sqrt(np.mean(force**2))),
        course.saturated,
        "" if resting.stable else "unstable at rest",
        float(np.sqrt(np.mean((error - lag * velocity) ** 2))),
        lag,
        settling,
        unsettled,
        width,
        width > _CYCLE * step,
        float(np.mean(np.abs(force * moved))),
        float(max(np.max(np.abs(course.force)), np.max(np.abs(resting.force))) / axis.timing.force_limit),
    )
    last = slice(-round((course.reference.position.shape[0] - half) * _SHOWN), None)
    return outcome, np.stack([course.reference.time[last], course.error[last]])


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
    shown: dict[tuple[str, str], Array | None] = {}
    for seed in seeds:
        for axis_id in chosen_axes:
            axis = AXES[axis_id]
            told(f"seed {seed}, {axis.title}: recording and identification")
            truth = axis.drawn(seed)
            try:
                known = axis.identified(*axis.recorded(truth, seed))
            except IdentificationError as why:
                for name in chosen:
                    found.setdefault((axis_id, name), []).append(failed(f"not identified: {why.problem}"))
                continue
            at_work = axis.drawn(seed + 500_000, _AGED, truth) if aged else truth
            bench = Bench(axis, at_work, seed, known)
            for name in chosen:
                if name in NEEDS_SPRINGS and known.dnlrx is None:
                    continue
                told(f"seed {seed}, {axis_id}: {name}")
                outcome, error = _outcome(bench, name)
                found.setdefault((axis_id, name), []).append(outcome)
                shown.setdefault((axis_id, name), error)
    return [Cell(axis, method, tuple(each), shown.get((axis, method))) for (axis, method), each in found.items()]


def text_of(values: Array) -> str:
    """Median of those values that are finite, with three digits."""
    finite = values[np.isfinite(values)]
    return f"{float(np.median(finite)):.3g}" if finite.size else "–"


def table(cells: Sequence[Cell]) -> list[tuple[str, ...]]:
    """Rows of text: axis, method, RMS, its gain over the first method's with interval, peak, settling, hunting, limit."""
    rows: list[tuple[str, ...]] = []
    first: dict[str, Cell] = {}
    for cell in cells:
        base = first.setdefault(cell.axis, cell)
        rms = cell.values("rms")
        if not np.any(np.isfinite(rms)):
            rows.append((cell.axis, cell.method, cell.outcomes[0].failed, "", "", "", "", ""))
            continue
        gain, low, high = interval(base.values("rms") / rms)
        counts = low > 1.0 or high < 1.0
        within = f" ({low:.3g} to {high:.3g})" if rms.shape[0] > 1 else ""
        good = [each for each in cell.outcomes if not each.failed]
        rows.append(
            (
                cell.axis,
                cell.method,
                text_of(rms),
                f"{gain:.3g}{within}{'' if counts else ' ns'}",
                text_of(cell.values("peak")),
                text_of(cell.values("settling")),
                f"{sum(each.hunts for each in good)} of {len(good)}",
                f"{text_of(100.0 * cell.values('share'))} %",
            )
        )
    return rows
