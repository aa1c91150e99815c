"""How a recording holds its force: by how much of a sample the force acts after the stamps that it is recorded with.

A controller's output that is held from its stamp to the next acts, on average, half a sample after its stamp; one that is
recorded with the state at the end of its interval, or the mean force over that interval, half a sample before it; a measured
continuous force at its stamp; in a log slower than its controller something in between. So one number tells them apart, the
lateness tau of the force against the force balance of the sliding axis

    u(t) = m a + k q + b + (F_+ or F_-) sgn v + F_v v + F_2 v |v| + tau du/dt,

to first order in tau. The derivative of the recorded force carries its noise; what the balance explains of it doesn't, and
serves as its instrument (two-stage least squares), so that tau isn't pulled to zero. Samples around reversals and rests, where
sgn v isn't known, stay out. Standard errors add the products of instrument and residual up over blocks longer than what is
correlated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage, signal
from scipy.interpolate import make_interp_spline

from ..record import Array, Index, Mask, Record
from .resolution import noise_of, step_of

__all__ = ["Hold", "hold_of", "resolved"]

_ORDER = 4
_HIGHEST = 0.2  # of the sampling rate: above it a log says little of what acts between its samples
_JERK_NOISE = 0.03  # of the jerk's rms: what a controller makes of its encoder's noise is then no part of the answer
_NARROWING = 1.25
_LOWEST = 1.0  # [Hz]
_SLIDING = 0.05  # of the high speed
_REACH = 1.0  # of a cutoff's period, by which a filter smears a reversal to either side
_BLOCKS = 40
_FEWEST = 200  # samples
_NINETY = 1.645  # standard errors
_KNOWN = 0.25  # of a sample: half of what lies between two ways to hold a force
_NEARLY = 0.05  # of a sample
_ROUNDS = 3
_MOST = 0.5  # sample either way, by how a force may be held; what is more is a delay
_CLASSES = {"following": 0.5, "linear": 0.0, "preceding": -0.5}
_MEANS = {
    "following": "held from its stamp to the next",
    "linear": "a continuous force, sampled",
    "preceding": "held until its stamp, or a mean over the sample before",
}


@dataclass(frozen=True)
class Hold:
    """By how much the force of a recording acts after its stamps.

    Attributes:
        late: [samples]; NaN where the recording can't tell.
        error: standard error [samples].
        sample_time: [s].
    """

    late: float
    error: float
    sample_time: float

    @property
    def kind(self) -> str:
        """``following``, ``preceding`` or ``linear`` where only one of them fits; ``between``, ``delayed`` or ``unknown``."""
        if not (np.isfinite(self.late) and self.error < _KNOWN):
            return "unknown"
        own = _NINETY * self.error
        # A hold is half a sample late but for small errors of this estimate; a sampled force may be late by anything.
        reach = {"following": max(own, _NEARLY), "preceding": max(own, _NEARLY), "linear": own}
        fitting = [name for name, late in _CLASSES.items() if abs(self.late - late) <= reach[name]]
        if fitting:
            return fitting[0] if len(fitting) == 1 else "unknown"
        return "between" if abs(self.late) < _MOST else "delayed"

    @property
    def likely(self) -> tuple[float, float]:
        """The lateness to go on with, and its standard error [samples]: what was measured, and that holds lie within a half."""
        if not np.isfinite(self.late) or (self.kind == "unknown" and abs(self.late) > 2.0 * _MOST + _NINETY * self.error):
            return 0.0, _MOST
        if abs(self.late) > _MOST + _NINETY * self.error:
            # What a hold doesn't explain belongs to the axis: a model without a delay is wrong by it.
            held = float(np.copysign(_MOST, self.late))
            return held, float(np.hypot(self.error, self.late - held))
        weight = _MOST**2 / (_MOST**2 + self.error**2)
        return weight * self.late, self.error * float(np.sqrt(weight))

    @property
    def told(self) -> str:
        """In one sentence."""
        if not np.isfinite(self.late):
            return "how the force is held between samples isn't stated nor determined by the motion: taken as sampled"
        after = f"{self.late:+.2f} +- {self.error:.2f} samples ({1e3 * self.late * self.sample_time:+.2g} ms) after them"
        start = f"how the force is held between its stamps isn't stated; it acts {after}: "
        late, error = self.likely
        if self.kind in _CLASSES:
            return f"{start}{_MEANS[self.kind]} (effort_hold: {self.kind})"
        if self.kind == "between":
            return f"{start}as in a log slower than its controller; that lateness is used"
        if self.kind == "delayed":
            return f"{start}a hold explains {late:+.1f} of it, the rest is a delay; add a term 'delay' or 'actuator_lag'"
        return f"{start}the kind of hold is not determined; taken as {late:+.2f} +- {error:.2f} samples"


def _low_pass(values: Array, cutoff: float, h: float) -> Array:
    sos = signal.butter(_ORDER, min(2.0 * cutoff * h, 0.95), output="sos")
    return np.asarray(signal.sosfiltfilt(sos, values, padlen=min(values.shape[0] - 1, round(3.0 / (cutoff * h)))))


def _cutoff(position: Array, h: float) -> float:
    """As high as the noise of the position lets the jerk be known, which carries the lateness [Hz]."""
    noise = max(noise_of(position), step_of(position) / np.sqrt(12.0), 1e-15 * float(np.max(np.abs(position))))
    cutoff = _HIGHEST / h
    while cutoff > _LOWEST:
        smooth = _low_pass(position, cutoff, h)
        jerk = np.gradient(np.gradient(np.gradient(smooth, h), h), h)
        # White noise s gives s (2 pi)^3 B^3.5 sqrt(2 h / 7) after a filter to B.
        if noise * (2.0 * np.pi) ** 3 * cutoff**3.5 * np.sqrt(h * 2.0 / 7.0) <= _JERK_NOISE * float(np.std(jerk)):
            break
        cutoff /= _NARROWING
    return cutoff


def _sliding(velocity: Array, valid: Mask, reach: int) -> Mask:
    """Away from rests, reversals, gaps and ends."""
    slow = np.abs(velocity) < _SLIDING * float(np.quantile(np.abs(velocity), 0.98))
    turn = np.concatenate([[False], np.sign(velocity[1:]) != np.sign(velocity[:-1])])
    bad = slow | turn | ~valid
    bad[:reach] = bad[-reach:] = True
    return np.asarray(~ndimage.binary_dilation(bad, iterations=max(reach, 1)), dtype=np.bool_)


def hold_of(record: Record) -> Hold:
    """When the force of ``record`` acts, from its motion alone; the recording on an even grid."""
    even = record.uniform()
    h = even.sample_time
    nothing = Hold(float("nan"), float("inf"), h)
    if even.n_samples < _FEWEST or float(np.ptp(even.effort)) == 0.0 or float(np.ptp(even.position)) == 0.0:
        return nothing
    cutoff = _cutoff(even.position, h)
    q = _low_pass(even.position, cutoff, h)
    v = _low_pass(np.asarray(make_interp_spline(even.time, even.position, 3).derivative()(even.time)), cutoff, h)
    a = np.asarray(make_interp_spline(even.time, v, 3).derivative()(even.time))
    u = _low_pass(even.effort, cutoff, h)
    rate = np.asarray(make_interp_spline(even.time, u, 3).derivative()(even.time))
    use: Index = np.flatnonzero(_sliding(v, even.mask, round(_REACH / (cutoff * h)))).astype(np.int64)
    if use.size < _FEWEST:
        return nothing
    ones = np.ones(even.n_samples)
    # The filter lets a reversal of the friction ring on farther than the samples that are left out around it.
    rung = _low_pass(np.sign(v), cutoff, h)
    columns = np.column_stack([a, v, v * np.abs(v), q - np.mean(q), ones, rung])
    if np.ptp(np.sign(v[use])) == 0.0:
        columns = columns[:, :-1]
    columns = columns / np.maximum(np.sqrt(np.mean(columns[use] ** 2, axis=0)), 1e-300)
    late = error = 0.0
    for _ in range(_ROUNDS):
        # The instrument: the derivative of what the balance makes of the force, late as found so far.
        theta = np.linalg.lstsq(columns[use], (u - late * rate)[use], rcond=1e-10)[0]
        made = np.asarray(make_interp_spline(even.time, columns[:, :-1] @ theta[:-1], 3).derivative()(even.time))
        late, error = _two_stage(columns[use], rate[use], made[use], u[use], use, even.n_samples)
        if not np.isfinite(late):
            return nothing
    return Hold(late / h, error / h, h)


def _two_stage(columns: Array, rate: Array, made: Array, force: Array, at: Index, n: int) -> tuple[float, float]:
    """Lateness and its standard error [s]."""
    basis, _ = np.linalg.qr(columns)

    def apart(values: Array) -> Array:
        return values - basis @ (basis.T @ values)

    instrument, regressor, target = apart(made), apart(rate), apart(force)
    power = float(instrument @ regressor)
    if not power > 0.0:
        return float("nan"), float("inf")
    late = float(instrument @ target) / power
    score = instrument * (target - late * regressor)
    sums = np.bincount((at * _BLOCKS) // n, weights=score, minlength=_BLOCKS)
    return late, float(np.sqrt(np.sum(sums**2))) / power


def resolved(record: Record) -> Record:
    """``record`` with its hold found and a note of it, where it states none; otherwise as it is."""
    if record.effort_hold != "unknown":
        return record
    found = hold_of(record)
    notes = (*record.notes, found.told)
    late, error = found.likely
    settled = replace(record, timing_error=error * found.sample_time, notes=notes)
    kind = {0.5: "following", -0.5: "preceding"}.get(late, "linear") if found.kind == "delayed" else found.kind
    if kind in _CLASSES:
        return replace(settled, effort_hold=kind)
    return replace(settled, effort=_moved(record, late * found.sample_time), effort_hold="linear")


def _moved(record: Record, late: float) -> Array:
    """The effort of ``record``, later by ``late`` [s], by a cubic, shape ``(n,)`` [F].

    What is level stays so, and nothing passes the recorded extremes: a force at a limit stays recognisable.
    """
    time, effort = record.time, record.effort
    at = time - late
    before = np.clip(np.searchsorted(time, at, side="right") - 1, 0, time.shape[0] - 2)
    level = effort[before] == effort[before + 1]
    return np.where(level, effort[before], np.clip(make_interp_spline(time, effort, 3)(at), np.min(effort), np.max(effort)))
