"""Record: the signals of one joint over time, the one data type that every room shares.

Conventions (``docs/conventions.md``): SI inside, time in seconds from the first sample, effort positive in the direction of
positive position, one row per sample. A record never hides what was done to it: whatever was dropped, joined or left out on
the way from the file is said in :attr:`Record.notes`, and samples that a fit must not use are marked in :attr:`Record.valid`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Array", "Index", "Mask", "Record", "RecordError", "Units"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Index = NDArray[np.int64]

_HOLDS = ("following", "preceding", "linear", "unknown")


class RecordError(InputError):
    """A recording whose content cannot be used."""


@dataclass(frozen=True)
class Units:
    """Units of a joint: position ``m`` or ``rad``; force ``N``, ``N m``, or a drive's own unit such as ``A``, ``V``, ``%``."""

    position: str = "m"
    force: str = "N"


@dataclass(frozen=True, eq=False)
class Record:
    """Signals of one joint; every array has shape ``(n_samples,)``.

    Attributes:
        time: [s], strictly increasing, first sample at 0.
        position: [m or rad].
        effort: force or torque as applied or measured [N, N m or the drive's unit].
        velocity: as recorded [m/s or rad/s], or None when the source has none.
        reference: position wanted [m or rad], or None.
        extra: further signals by name (``normal_load`` [N], ``temperature`` [degC], ...).
        nominal: what ``normal_load`` and ``temperature`` are seen relative to; their means where not given.
        valid: False where a sample must not be used (gap, saturation, end stop); None means all are good.
        joint: name of the joint.
        units: units of position and force.
        source: the file the record comes from, for messages.
        effort_hold: ``"following"`` when the effort of a sample acts from its stamp to the next, ``"preceding"`` when it acted
            over the interval that ends at the stamp, ``"linear"`` when it is a sampled continuous signal, ``"unknown"`` when
            nobody says so (:func:`fric.signals.hold.resolved` finds it).
        timing_error: standard error of when the effort acts relative to its stamps [s]; 0 where that is stated.
        notes: what was dropped, joined or left out on the way here, and why.
    """

    time: Array
    position: Array
    effort: Array
    velocity: Array | None = None
    reference: Array | None = None
    extra: Mapping[str, Array] = field(default_factory=dict)
    nominal: Mapping[str, float] = field(default_factory=dict)
    valid: Mask | None = None
    joint: str = "axis"
    units: Units = field(default_factory=Units)
    source: str = "record"
    effort_hold: str = "linear"
    timing_error: float = 0.0
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        n_samples = self.time.shape[0] if self.time.ndim == 1 else -1
        for name, signal in self.signals().items():
            if signal.shape != (n_samples,):
                raise RecordError(
                    self.source,
                    f"signal '{name}' has shape {signal.shape}, time has {self.time.shape}",
                    "give every signal one value per time stamp",
                )
            bad = np.flatnonzero(~np.isfinite(signal))
            if bad.size:
                raise RecordError(
                    self.source,
                    f"signal '{name}' is not finite at {bad.size} of {n_samples} samples, first at sample {bad[0]}",
                    "drop or repair these samples (--repair)",
                )
        if self.valid is not None and self.valid.shape != (n_samples,):
            raise RecordError(
                self.source,
                f"mark 'valid' has shape {self.valid.shape}, time has {self.time.shape}",
                "give every sample one mark",
            )
        if self.effort_hold not in _HOLDS:
            raise RecordError(self.source, f"effort_hold is '{self.effort_hold}'", f"use one of {', '.join(_HOLDS)}")
        if n_samples < 2:
            raise RecordError(self.source, f"only {max(n_samples, 0)} sample(s)", "record for longer")
        step = np.diff(self.time)
        if not np.all(step > 0):
            at = int(np.argmax(step <= 0)) + 1
            raise RecordError(
                self.source,
                f"time does not increase at sample {at} ({self.time[at - 1]:.6f} s to {self.time[at]:.6f} s)",
                "repair the stamps (--repair) or use the time of reception (--time log)",
            )

    @classmethod
    def from_arrays(
        cls,
        time: ArrayLike,
        position: ArrayLike,
        effort: ArrayLike,
        *,
        units: tuple[str, str] = ("m", "N"),
        joint: str = "axis",
        effort_hold: str = "unknown",
        source: str = "arrays",
        **signals: ArrayLike,
    ) -> Record:
        """A record from plain arrays, each of shape ``(n_samples,)``.

        Args:
            time: [s], increasing; need not start at 0.
            position: in the first of ``units``.
            effort: force or torque, in the second of ``units``.
            units: of position (``m`` or ``rad``) and force (``N``, ``N m``, or a drive's own such as ``A``).
            joint: name of the joint.
            effort_hold: see :attr:`effort_hold`; what nobody states is found from the motion.
            source: name of the recording in messages.
            signals: ``velocity``, ``reference``, ``normal_load`` [N], ``temperature`` [degC], ...

        Raises:
            RecordError: shapes that differ, values that aren't finite, or a time that doesn't increase.

        Example:
            >>> import numpy as np
            >>> t = np.arange(0.0, 2.0, 1e-3)
            >>> Record.from_arrays(t, np.sin(t), np.cos(t), units=("rad", "N m")).duration
            1.999
        """
        stamps = np.asarray(time, dtype=np.float64)
        held = {name: np.array(values, dtype=np.float64) for name, values in signals.items()}
        return cls(
            stamps - (stamps[0] if stamps.size else 0.0),
            np.array(position, dtype=np.float64),
            np.array(effort, dtype=np.float64),
            velocity=held.pop("velocity", None),
            reference=held.pop("reference", None),
            extra=held,
            units=Units(*units),
            joint=joint,
            effort_hold=effort_hold,
            source=source,
        )

    def to_frame(self) -> pd.DataFrame:
        """The signals as a pandas table, one column each, ``time`` [s] first."""
        import pandas as pd

        return pd.DataFrame(self.signals())

    def signals(self) -> dict[str, Array]:
        """Every signal that is present, by name, time first."""
        named: dict[str, Array | None] = {
            "time": self.time,
            "position": self.position,
            "effort": self.effort,
            "velocity": self.velocity,
            "reference": self.reference,
            **self.extra,
        }
        return {name: signal for name, signal in named.items() if signal is not None}

    @property
    def n_samples(self) -> int:
        """Number of samples."""
        return int(self.time.shape[0])

    @property
    def sample_time(self) -> float:
        """Median time between samples [s]."""
        return float(np.median(np.diff(self.time)))

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def hold(self) -> str:
        """``effort_hold``, with an unknown one taken as a sampled continuous signal."""
        return "linear" if self.effort_hold == "unknown" else self.effort_hold

    @property
    def mask(self) -> Mask:
        """True where a sample may be used, shape ``(n_samples,)``."""
        return np.ones(self.n_samples, dtype=np.bool_) if self.valid is None else self.valid

    def is_uniform(self, tolerance: float = 1e-3) -> bool:
        """True when no step differs from the median step by more than ``tolerance`` of it."""
        step = np.diff(self.time)
        return bool(np.max(np.abs(step - self.sample_time)) <= tolerance * self.sample_time)

    def slice(self, start: int, stop: int) -> Record:
        """Samples ``start`` to ``stop`` (exclusive) as a record of their own, time again from 0; arrays are views but time."""

        def cut(signal: Array | None) -> Array | None:
            return None if signal is None else signal[start:stop]

        time = self.time[start:stop]
        if time.shape[0] < 2:
            raise RecordError(self.source, f"samples {start} to {stop} are fewer than two", "choose a longer part")
        return replace(
            self,
            time=time - time[0],
            position=self.position[start:stop],
            effort=self.effort[start:stop],
            velocity=cut(self.velocity),
            reference=cut(self.reference),
            extra={name: signal[start:stop] for name, signal in self.extra.items()},
            valid=None if self.valid is None else self.valid[start:stop],
        )

    def between(self, start: float | None = None, end: float | None = None) -> Record:
        """The part from ``start`` to ``end`` [s]."""
        first = 0 if start is None else int(np.searchsorted(self.time, start))
        last = self.n_samples if end is None else int(np.searchsorted(self.time, end, side="right"))
        return self.slice(first, last)

    def uniform(self, sample_time: float | None = None) -> Record:
        """The same signals on an even grid; the record itself when it is even already.

        The position goes by a cubic through its neighbours, an effort that is held by its hold, all else by straight lines.

        Args:
            sample_time: step of the grid [s]; the median step when None.
        """
        if sample_time is None and self.is_uniform():
            return self
        step = self.sample_time if sample_time is None else sample_time
        n_steps = int(np.floor(self.duration / step * (1 + 1e-12)))
        grid = np.arange(n_steps + 1, dtype=np.float64) * step

        def on_grid(signal: Array) -> Array:
            return np.asarray(np.interp(grid, self.time, signal), dtype=np.float64)

        valid = None
        if self.valid is not None:
            # A grid point is good only when both neighbours are.
            valid = np.interp(grid, self.time, self.valid.astype(np.float64)) > 1 - 1e-9
        changed: dict[str, Any] = {
            "position": _cubic(grid, self.time, self.position),
            "effort": self._effort_at(grid),
            "velocity": None if self.velocity is None else on_grid(self.velocity),
            "reference": None if self.reference is None else on_grid(self.reference),
            "extra": {name: on_grid(signal) for name, signal in self.extra.items()},
        }
        return replace(self, time=grid, valid=valid, **changed)

    def _effort_at(self, grid: Array) -> Array:
        """Effort at the times ``grid`` [s], by how it is held."""
        if self.hold == "linear":
            return np.asarray(np.interp(grid, self.time, self.effort), dtype=np.float64)
        # A step of the grid stands for the middle of what it spans.
        middle = grid + (0.5 if self.hold == "following" else -0.5) * self.sample_time
        if self.hold == "following":
            at = np.searchsorted(self.time, middle, side="right") - 1
        else:
            at = np.searchsorted(self.time, middle, side="left")
        return self.effort[np.clip(at, 0, self.n_samples - 1)]


def _cubic(grid: Array, time: Array, values: Array) -> Array:
    """``values`` at the times ``grid``, by the cubic through the four samples around each (Lagrange)."""
    if time.shape[0] < 4:
        return np.asarray(np.interp(grid, time, values), dtype=np.float64)
    first = np.clip(np.searchsorted(time, grid, side="right") - 2, 0, time.shape[0] - 4)
    around = [first + k for k in range(4)]
    found = np.zeros(grid.shape[0])
    for j in range(4):
        weight = np.ones(grid.shape[0])
        for k in range(4):
            if k != j:
                weight *= (grid - time[around[k]]) / (time[around[j]] - time[around[k]])
        found += weight * values[around[j]]
    # Across a gap, or between stamps that nearly coincide, a cubic swings; a straight line doesn't.
    low, high = time[around[1]], time[around[2]]
    usual = float(np.median(np.diff(time)))
    spread = np.min(np.diff(np.array([time[k] for k in around]), axis=0), axis=0)
    plain = (high - low > 3.0 * usual) | (spread < 0.2 * usual)
    return np.where(plain, np.interp(grid, time, values), found)
