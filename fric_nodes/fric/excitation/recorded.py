"""Recorded motion: the reference (or the position, or the force) of an earlier recording, again.

Equation: the cubic spline through the recorded samples; before it a least-jerk move from rest at 0 to the state at its start,
after it one back, so that it starts and ends at rest. A force goes through the samples by the monotone cubic of Fritsch and
Carlson, which doesn't overshoot where the force jumps.
Source: a bag (``reference`` of the record as read by :mod:`fric.bagio`), or a table (``.csv``, ``.npz``, ``.parquet``,
``.mat``) with the columns ``time`` [s] and ``reference``, ``position`` or ``effort`` in SI units.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..excitation_kind import Excitation, ExcitationError, Points, Text, Trajectory
from ..parameter import Parameter
from ..record import Array

__all__ = ["EXCITATION"]


def _load(file: str, signal: str, joint: str) -> tuple[Array, Array]:
    """Time from 0 [s], evenly spaced, and the signal, each of shape ``(n_samples,)``."""
    # Slow to import, and only this excitation reads files.
    from ..bagio import read_record
    from ..importers import suffixes

    path = Path(file).expanduser()
    if path.suffix.lower() in suffixes():
        return _from_table(path, signal)
    record = read_record(path, joint=joint or None).uniform()
    values = record.signals().get(signal)
    if values is None:
        known = ", ".join(name for name in ("reference", "position", "effort") if name in record.signals())
        raise ExcitationError(path, f"holds no {signal}", f"set recorded.signal to what it holds: {known}")
    return record.time, values


def _from_table(path: Path, signal: str) -> tuple[Array, Array]:
    from ..importers import TextOptions, load_table

    columns = load_table(path, TextOptions(), ("time", signal)).columns
    for name in ("time", signal):
        if name not in columns:
            raise ExcitationError(path, f"has no column '{name}'", f"name a column so; it has {', '.join(columns)}")
    time, values = columns["time"], columns[signal]
    if time.shape[0] < 4 or not np.all(np.isfinite(time) & np.isfinite(values)) or not np.all(np.diff(time) > 0.0):
        problem = "needs at least 4 samples of finite numbers, with times that increase"
        raise ExcitationError(path, problem, "correct the table")
    time = time - time[0]
    grid = np.linspace(0.0, time[-1], time.shape[0])
    return grid, np.asarray(np.interp(grid, time, values), dtype=np.float64)


class _Replay:
    """``curve`` over ``[0, length]`` [s], joined to rest at 0 by quintic polynomials of ``lead`` [s] at both ends."""

    def __init__(self, curve: Any, length: float, lead: float) -> None:
        self._derivatives = (curve, curve.derivative(1), curve.derivative(2))
        self._length, self._lead = length, lead
        self.duration = length + 2.0 * lead
        (q_0, v_0, a_0), (q_1, v_1, a_1) = ([float(of(t)) for of in self._derivatives] for t in (0.0, length))
        self._joins = _join(q_0, v_0, a_0, lead), _join(q_1, -v_1, a_1, lead)

    def at(self, time: Array) -> Points:
        local = time - self._lead
        inside = np.clip(local, 0.0, self._length)
        values = [np.asarray(of(inside), dtype=np.float64) for of in self._derivatives]
        if self._lead > 0.0:
            for polynomial, left, back in (
                (self._joins[0], time, 1.0),
                (self._joins[1], self.duration - time, -1.0),  # the way back is the way there, with time reversed
            ):
                here = left < self._lead
                s = left[here] / self._lead
                for order in range(3):
                    rate = (back / self._lead) ** order
                    values[order][here] = rate * np.polynomial.polynomial.polyval(s, _derived(polynomial, order))
        return Points(*values)


def _join(position: float, velocity: float, acceleration: float, span: float) -> Array:
    """Coefficients, in powers of s in [0, 1], of the quintic from rest at 0 to the given state within ``span`` [s]."""
    v, a = velocity * span, acceleration * span * span
    return np.array(
        [
            0.0,
            0.0,
            0.0,
            10.0 * position - 4.0 * v + 0.5 * a,
            -15.0 * position + 7.0 * v - a,
            6.0 * position - 3.0 * v + 0.5 * a,
        ]
    )


def _derived(polynomial: Array, order: int) -> Array:
    return np.asarray(np.polynomial.polynomial.polyder(polynomial, order)) if order else polynomial


def plan(values: Mapping[str, float], random: np.random.Generator, texts: Mapping[str, str]) -> Trajectory:
    from scipy.interpolate import CubicSpline, PchipInterpolator
    from scipy.ndimage import gaussian_filter1d

    if not texts["file"]:
        raise ExcitationError("recorded", "no file is given", "name a bag or a table with recorded.file")
    time, signal = _load(texts["file"], texts["signal"], texts["joint"])
    first, last = values["start"], values["end"] if values["end"] > 0.0 else float(time[-1])
    keep = (time >= first) & (time <= last)
    if np.count_nonzero(keep) < 4:
        problem = f"has fewer than 4 samples from {first:g} to {last:g} s; it lasts {time[-1]:g} s"
        raise ExcitationError(texts["file"], problem, "choose another part with recorded.start and recorded.end")
    signal = signal[keep]
    step = float(time[1] - time[0])
    if values["smoothing_time"] > 0.0:
        signal = gaussian_filter1d(signal, values["smoothing_time"] / step, mode="nearest")
    scaled = values["scale"] * signal + values["offset"]
    stamps = np.arange(scaled.shape[0], dtype=np.float64) * step / values["rate"]
    curve = PchipInterpolator(stamps, scaled) if texts["signal"] == "effort" else CubicSpline(stamps, scaled)
    return _Replay(curve, float(stamps[-1]), values["lead_time"])


EXCITATION = Excitation(
    id="recorded",
    title="recorded motion",
    shows="what the recorded machine met: the motion of its work, with another controller, model or axis",
    parameters=(
        Parameter("start", "t_1", "s", "where in the recording to begin", lower=0.0, upper=1e9, default=0.0),
        Parameter("end", "t_2", "s", "where to end; 0: with the recording", lower=0.0, upper=1e9, default=0.0),
        Parameter("rate", "r", "1", "how many times faster than recorded", default=1.0, positive=True, upper=1e3),
        Parameter("scale", "s", "1", "factor of the signal", lower=-1e9, upper=1e9, default=1.0),
        Parameter("offset", "q_0", "x", "added to the signal after that", lower=-1e9, upper=1e9, default=0.0),
        Parameter(
            "smoothing_time",
            "T_s",
            "s",
            "width (standard deviation) of a Gaussian that smooths a measured signal",
            lower=0.0,
            upper=100.0,
            default=0.0,
        ),
        Parameter(
            "lead_time",
            "T_l",
            "s",
            "time from rest to its start, and back",
            default=1.0,
            lower=0.0,
            upper=1e4,
        ),
    ),
    plan=plan,
    texts=(
        Text("file", "", "bag or table (.csv, .npz, .parquet, .mat) to play from"),
        Text("signal", "reference", "what of it is played", ("reference", "position", "effort")),
        Text("joint", "", "joint of the bag; empty when there is only one"),
    ),
)
