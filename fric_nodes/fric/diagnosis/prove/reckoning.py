"""The examiner's own reckoning of how much a nominal structure leaves unexplained, without noise and without fric's fits.

The force balance of each sample interval holds exactly for the interval's means: u = m (v(k+1) - v(k))/h + F. Its columns
(mean acceleration, mean sign of the velocity, mean velocity, one, and where the structure has them a Stribeck fall or a
bristle's force) and u pass the same zero-phase low-pass filter; the coefficients are least squares with their signs kept; a
Stribeck velocity or a pre-sliding displacement is found by a search over its logarithm. Where the axis moves less than one
encoder step in 10 ms, friction is whatever it takes up to the level found, so that only what goes beyond counts.

From it come, on a validation run that the fit has not seen,

- ``noe``: 100 sum e^2 / sum (u - mean u)^2 [%], e the filtered remainder: the strength of what is concealed;
- ``floor``: the same for what noise and rounding alone put into the remainder of a perfect model: filtered force noise,
  and mass and viscous coefficient times the errors of the differentiated measured position;
- ``energy``: e^2 summed over cells of 10 ms: when the mismatch shows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.optimize import lsq_linear, minimize_scalar
from scipy.signal import butter, sosfiltfilt

from ...record import Array, Index, Mask
from .course import Run

__all__ = ["CELL", "Balance", "Nominal", "balance", "floor_of", "refit"]

CELL = 0.01
"""Length of the cells of :attr:`Remainder.energy` [s]."""

_REST = 0.01  # [s] within which less than one encoder step counts as rest
_ORDER = 4


@dataclass(frozen=True)
class Nominal:
    """A nominal structure: its parts besides the mass (``coulomb``, ``viscous``, ``bias``, ``stribeck``, ``presliding``)."""

    parts: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Balance:
    """The force balance of a run; arrays of shape ``(n_intervals,)``.

    Attributes:
        force: command [N].
        acceleration: mean [m/s^2].
        velocity: mean [m/s].
        direction: mean sign of the velocity.
        travel: position seen at the samples, ``(n_intervals + 1,)`` [m].
        moving: False at rest.
        sample_time: [s].
        cutoff: of the filter [Hz].
    """

    force: Array
    acceleration: Array
    velocity: Array
    direction: Array
    travel: Array
    moving: Mask
    sample_time: float
    cutoff: float

    def smooth(self, signal: Array) -> Array:
        """``signal`` below the cutoff, along the first axis."""
        sos = butter(_ORDER, 2.0 * self.cutoff * self.sample_time, output="sos")
        return np.asarray(sosfiltfilt(sos, signal, axis=0), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Remainder:
    """What a refitted structure leaves on a run: see the module's docstring; ``error`` [N] has shape ``(n_intervals,)``."""

    noe: float
    energy: Array
    error: Array
    coefficients: dict[str, float]


def balance(run: Run, sample_time: float, resolution: float) -> Balance:
    """The force balance of ``run``."""
    velocity = np.diff(run.seen) / sample_time
    width = max(round(_REST / sample_time), 1)
    ahead = np.minimum(np.arange(velocity.shape[0]) + (width + 1) // 2, velocity.shape[0])
    behind = np.maximum(np.arange(velocity.shape[0]) - width // 2, 0)
    moving = np.abs(run.seen[ahead] - run.seen[behind]) > max(resolution, 1e-12)
    return Balance(
        force=run.command[:-1],
        acceleration=np.diff(run.speed) / sample_time,
        velocity=velocity,
        direction=run.direction[:-1],
        travel=run.seen,
        moving=moving,
        sample_time=sample_time,
        cutoff=min(0.1 / sample_time, 100.0),
    )


@njit(error_model="numpy", cache=True)
def _bristle(travel: Array, displacement: float) -> Array:
    """Mean bristle force over each interval in units of the level, shape ``(n_intervals,)``."""
    n = travel.shape[0] - 1
    out = np.empty(n)
    z = 0.0
    for k in range(n):
        d = (travel[k + 1] - travel[k]) / displacement
        end = 1.0 if d > 0.0 else -1.0
        r = abs(d)
        if r < 1e-12:
            out[k] = z
            continue
        after = end + (z - end) * math.exp(-r)
        out[k] = end + (z - after) / r
        z = after
    return out


def _columns(nominal: Nominal, run: Balance, inner: float) -> tuple[list[str], Array]:
    """Names and columns of a structure whose Stribeck velocity or pre-sliding displacement is ``inner``."""
    names = ["mass", *nominal.parts]
    slip = _bristle(run.travel, inner) if "presliding" in nominal.parts else run.direction
    columns = {
        "mass": run.acceleration,
        "coulomb": slip,
        "viscous": run.velocity,
        "bias": np.ones_like(run.velocity),
    }
    if "stribeck" in nominal.parts:
        columns["stribeck"] = slip * np.exp(-((run.velocity / inner) ** 2))
    names.remove("presliding") if "presliding" in names else None
    return names, np.column_stack([columns[name] for name in names])


@dataclass(frozen=True, eq=False)
class _Equations:
    """The filtered columns of a structure on some runs; those that depend on ``inner`` are made anew for each value of it."""

    nominal: Nominal
    runs: Sequence[Balance]
    smooth: Sequence[Array]
    names: Sequence[str]

    @classmethod
    def of(cls, nominal: Nominal, runs: Sequence[Balance]) -> _Equations:
        """The equations of ``runs``; the force is the last column."""
        both = []
        for run in runs:
            names, columns = _columns(nominal, run, 1.0)
            both.append(run.smooth(np.column_stack([columns, run.force])))
        return cls(nominal, runs, both, names)

    def solved(self, inner: float) -> tuple[float, dict[str, float]]:
        """Sum of squares and coefficients of the best fit of the linear parts."""
        moved = [name for part, name in (("presliding", "coulomb"), ("stribeck", "stribeck")) if part in self.nominal.parts]
        kept = []
        for run, smooth in zip(self.runs, self.smooth, strict=True):
            use = np.ones_like(run.moving) if "presliding" in self.nominal.parts else run.moving
            step = max(int(0.4 / (run.cutoff * run.sample_time)), 1)
            part = smooth[::step].copy()
            if moved:
                at = [self.names.index(name) for name in moved]
                part[:, at] = run.smooth(_columns(self.nominal, run, inner)[1][:, at])[::step]
            kept.append(part[use[::step]])
        both = np.concatenate(kept)
        matrix, target = both[:, :-1], both[:, -1]
        scale = np.linalg.norm(matrix, axis=0)
        scale[scale == 0.0] = 1.0
        lower = np.array([-np.inf if name == "bias" else 0.0 for name in self.names])
        with np.errstate(invalid="ignore"):  # scipy's own: nothing times the infinite way to a bound that isn't there
            answer = lsq_linear(matrix / scale, target, bounds=(lower, np.full(len(self.names), np.inf)))
        return float(2.0 * answer.cost), dict(zip(self.names, (answer.x / scale).tolist(), strict=True))


def refit(nominal: Nominal, train: Sequence[Balance], validation: Balance) -> Remainder:
    """Fit ``nominal`` to the runs of ``train`` and see what it leaves of ``validation``."""
    equations = _Equations.of(nominal, train)
    inner = 1.0
    if "stribeck" in nominal.parts or "presliding" in nominal.parts:
        inner = _searched(equations)
    _, found = equations.solved(inner)
    names, columns = _columns(nominal, validation, inner)
    # Rest is judged before the filter: there a static law balances whatever is below its level.
    remainder = validation.force - columns @ np.array([found[name] for name in names])
    if "presliding" not in nominal.parts:
        level = found.get("coulomb", 0.0) + found.get("stribeck", 0.0)
        still = ~validation.moving
        sliding = [name for name in names if name not in ("coulomb", "stribeck")]
        rest = validation.force - columns[:, [names.index(name) for name in sliding]] @ np.array([found[n] for n in sliding])
        remainder[still] = rest[still] - np.clip(rest[still], -level, level)
    error = validation.smooth(remainder)
    force = validation.smooth(validation.force)
    spread = force - float(np.mean(force))
    per_cell = np.add.reduceat(error**2, _cell_starts(error.shape[0], validation.sample_time))
    if "stribeck" in nominal.parts:
        found["stribeck_velocity"] = inner
    if "presliding" in nominal.parts:
        found["displacement"] = inner
    return Remainder(100.0 * float(error @ error) / float(spread @ spread), per_cell, error, found)


def _cell_starts(n: int, sample_time: float) -> Index:
    cells = np.floor(np.arange(n) * sample_time / CELL * (1 + 1e-12)).astype(np.int64)
    return np.flatnonzero(np.diff(cells, prepend=-1))


def _searched(equations: _Equations) -> float:
    """The Stribeck velocity [m/s] or pre-sliding displacement [m] with the least remainder."""
    runs = equations.runs
    if "stribeck" in equations.nominal.parts:
        top = max(float(np.quantile(np.abs(run.velocity), 0.99)) for run in runs)
        low, high = math.log(1e-3 * top), math.log(0.7 * top)
    else:
        reach = max(float(np.ptp(run.travel)) for run in runs)
        low, high = math.log(1e-6 * reach), math.log(0.03 * reach)

    def cost(logarithm: float) -> float:
        return equations.solved(math.exp(logarithm))[0]

    grid = np.linspace(low, high, 9)
    at = int(np.argmin([cost(float(point)) for point in grid]))
    around = (float(grid[max(at - 1, 0)]), float(grid[min(at + 1, 8)]))
    return math.exp(float(minimize_scalar(cost, bounds=around, method="bounded", options={"xatol": 0.02}).x))


def floor_of(run: Run, balance_of_run: Balance, force_noise: Array, mass: float, viscous: float) -> float:
    """NOE of noise and rounding alone [%]; ``force_noise`` [N] has shape ``(n_intervals,)``."""
    h = balance_of_run.sample_time
    off = balance_of_run.smooth(run.measured - run.seen)
    rate = np.gradient(off, h)
    error = balance_of_run.smooth(force_noise) - (mass * np.gradient(rate, h) + viscous * rate)[:-1]
    force = balance_of_run.smooth(balance_of_run.force)
    spread = force - float(np.mean(force))
    return 100.0 * float(error @ error) / float(spread @ spread)
