"""Simulated recordings as real machines leave them: a truth of its own integrator, and dirt drawn from a seed.

The truth is an axis m dv/dt = u - F_C sgn v - F_v v + b that sticks exactly, under a PD controller that reads its encoder at
a rate of its own and holds its output. Between two instants of the controller the force is constant, so that the motion is
known in closed form: with w = F_v / m and v_inf = (u + b - F_C sgn v) / F_v,

    v(t) = v_inf + (v_0 - v_inf) exp(-w t),    q(t) = q_0 + v_inf t + (v_0 - v_inf) (1 - exp(-w t)) / w,

until v passes zero, where the axis sticks (``|u + b| <= F_C``) or goes on the other way. Nothing of it is shared with the
engine that fits use.

The dirt: encoder of 300 to 10^6 steps over the stroke, white noise below its step, stamps that jitter where
the motion doesn't or with it, a log slower than the controller, a force held in a way that the recording doesn't state, white,
1/f and mains-frequency noise of the force, a coarse current, single-sample spikes, single-precision time, a start in motion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numba
import numpy as np

from ..record import Array, Record
from ..signals.pink_noise import pink_noise
from ..signals.stamps import rounded_grid

__all__ = ["Axis", "Dirt", "drawn", "recorded"]


@dataclass(frozen=True)
class Axis:
    """A rigid axis with Coulomb and viscous friction.

    Attributes:
        mass: [kg].
        coulomb: [N].
        viscous: [N s/m].
        bias: constant force beside the commanded one, as a model's ``bias`` term counts it [N].
    """

    mass: float
    coulomb: float
    viscous: float
    bias: float

    def named(self) -> dict[str, float]:
        """Values by the names of a model's parameters."""
        return {
            "mass": self.mass,
            "coulomb.force": self.coulomb,
            "viscous.coefficient": self.viscous,
            "bias.force": self.bias,
        }


@dataclass(frozen=True)
class Dirt:
    """What stands between the axis and its recording.

    Attributes:
        rate: of the controller [Hz].
        every: of the controller's samples that is logged.
        steps: of the encoder over the stroke.
        position_noise: standard deviation before rounding [encoder steps].
        jitter: largest lateness of a stamp [s].
        sampled_late: True where the position is read when the stamp is taken; False: evenly, and the stamp alone is late.
        hold: ``following``: the controller's output at the stamp; ``preceding``: that of the interval before;
            ``mean``: the mean force since the last logged sample.
        force_noise: standard deviation of white noise of the force signal, of F_C [1].
        pink: of 1/f noise, of F_C [1].
        mains: amplitude of 50 Hz in the force signal, of F_C [1].
        force_step: of the force signal, of F_C [1].
        spikes: number of single samples of the force that are wrong.
        single: True where the time is written in single precision, from an hour on.
        in_motion: True where the log begins while the axis moves.
    """

    rate: float
    every: int
    steps: float
    position_noise: float
    jitter: float
    sampled_late: bool
    hold: str
    force_noise: float
    pink: float
    mains: float
    force_step: float
    spikes: int
    single: bool
    in_motion: bool


def drawn(seed: int) -> tuple[Axis, Dirt]:
    """An axis and its dirt; every setting has its own share of the draws."""
    random = np.random.default_rng(seed)

    def among(low: float, high: float) -> float:
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    def sometimes(share: float, low: float, high: float) -> float:
        value = among(low, high)
        return value if random.random() < share else 0.0

    mass = among(0.5, 8.0)
    coulomb = mass * among(0.8, 6.0)
    axis = Axis(mass, coulomb, coulomb * among(0.5, 5.0), coulomb * random.uniform(-0.3, 0.3))
    log_rate = among(80.0, 5000.0)
    every = 1 if log_rate > 1000.0 else int(random.choice([1, 2, 5, 10]))
    rate = max(log_rate * every, 250.0)
    every = max(round(rate / log_rate), 1)
    dirt = Dirt(
        rate=rate,
        every=every,
        steps=among(300.0, 1e6),
        position_noise=sometimes(0.5, 0.05, 1.0),
        jitter=sometimes(0.6, 1e-5, 5e-4),
        sampled_late=bool(random.random() < 0.3),
        hold=str(random.choice(["following", "preceding", "mean"], p=[0.6, 0.2, 0.2])),
        force_noise=sometimes(0.8, 0.003, 0.1),
        pink=sometimes(0.4, 0.003, 0.03),
        mains=sometimes(0.3, 0.01, 0.05),
        force_step=sometimes(0.5, 0.002, 0.05),
        spikes=int(random.choice([0, 0, 0, 1, 3])),
        single=bool(random.random() < 0.15),
        in_motion=bool(random.random() < 0.4),
    )
    return axis, dirt


@numba.njit(cache=True)
def _advance(q: float, v: float, u: float, mass: float, coulomb: float, viscous: float, h: float) -> tuple[float, float]:
    """Position and velocity after ``h`` under the constant force ``u``, bias included."""
    left = h
    for _ in range(3):
        if v == 0.0:
            if abs(u) <= coulomb:
                return q, 0.0
            sign = 1.0 if u > 0.0 else -1.0
        else:
            sign = 1.0 if v > 0.0 else -1.0
        w = viscous / mass
        end = (u - coulomb * sign) / viscous
        away = v - end
        # It comes to rest where end + away exp(-w t) is zero.
        stop = math.log(away / -end) / w if v != 0.0 and end * v < 0.0 else left + 1.0
        if stop >= left:
            decay = math.exp(-w * left)
            return q + end * left + away * (1.0 - decay) / w, end + away * decay
        q += end * stop + away * (1.0 - math.exp(-w * stop)) / w
        v = 0.0
        left -= stop
    return q, v


@numba.njit(cache=True)
def _closed_loop(
    wanted: Any, rate: Any, late: Any, noise: Any, h: float, step: float, values: Any, gains: Any, positions: Any, efforts: Any
) -> None:
    """The loop, sample by sample: what the encoder gives at each (at its own instant ``late`` after it), and the force."""
    mass, coulomb, viscous, bias = values
    p, d = gains
    q, v = wanted[0], rate[0]
    before = q
    for k in range(wanted.shape[0]):
        # The encoder is read ``late`` after the instant, while the force of the sample before still acts.
        u_before = efforts[k - 1] if k > 0 else 0.0
        q_read, _ = _advance(q, v, u_before - bias, mass, coulomb, viscous, late[k])
        positions[k] = math.floor((q_read + noise[k]) / step + 0.5) * step
        seen = math.floor((q + noise[k]) / step + 0.5) * step
        u = p * (wanted[k] - seen) + d * (rate[k] - (seen - before) / h)
        before = seen
        efforts[k] = u
        q, v = _advance(q, v, u - bias, mass, coulomb, viscous, h)


def _reference(random: np.random.Generator, axis: Axis, h: float, duration: float) -> Array:
    """Moves from point to point at several speeds and accelerations, or a multisine, about 0.1 m wide [m]."""
    time = h * np.arange(round(duration / h))
    if random.random() < 0.5:
        frequency = np.geomspace(0.2, 3.0, 6) * random.uniform(0.9, 1.1, 6)
        amplitude = 0.1 / frequency / np.sum(1.0 / frequency)
        angle = 2.0 * np.pi * np.outer(time, frequency) + random.uniform(0.0, 2.0 * np.pi, 6)
        return np.asarray(np.sin(angle) @ amplitude)
    knots, ends, at = [0.0], [0.0], 0.0
    while knots[-1] < duration:
        target = random.uniform(-0.05, 0.05)
        speed, acceleration = random.uniform(0.05, 0.4), random.uniform(0.8, 4.0)
        span = abs(target - at)
        # The duration of a cubic whose peak speed and acceleration stay below both.
        took = max(1.5 * span / speed, math.sqrt(6.0 * span / acceleration), 0.05)
        knots += [knots[-1] + took, knots[-1] + took + random.uniform(0.02, 0.2)]
        ends += [target, target]
        at = target
    index = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, len(knots) - 2)
    start, end = np.array(knots)[index], np.array(knots)[index + 1]
    s = np.clip((time - start) / (end - start), 0.0, 1.0)
    first, last = np.array(ends)[index], np.array(ends)[index + 1]
    return np.asarray(first + (last - first) * s**2 * (3.0 - 2.0 * s))


def recorded(axis: Axis, dirt: Dirt, seed: int, duration: float = 15.0) -> Record:
    """What is recorded of ``axis`` through ``dirt`` over a motion that belongs to ``seed``."""
    random = np.random.default_rng(seed + 1_000_000)
    h = 1.0 / dirt.rate
    lead = 0.5 if dirt.in_motion else 0.0
    wanted = _reference(random, axis, h, duration + lead)
    stroke = float(np.ptp(wanted))
    n = wanted.shape[0]
    late = np.zeros(n)
    # A stamp is at most as late as half a controller's period, or it would belong to the next sample.
    logged = np.arange(0, n, dirt.every)
    stamp_late = random.uniform(0.0, min(dirt.jitter, 0.9 * h * dirt.every), logged.shape[0])
    if dirt.sampled_late:
        late[logged] = stamp_late
    step = stroke / dirt.steps
    noise = dirt.position_noise * step * random.standard_normal(n)
    positions, efforts = np.empty(n), np.empty(n)
    bandwidth = 2.0 * math.pi * min(dirt.rate / 40.0, 8.0)
    gains = (axis.mass * bandwidth**2, 1.2 * axis.mass * bandwidth)
    values = (axis.mass, axis.coulomb, axis.viscous, axis.bias)
    _closed_loop(wanted, np.gradient(wanted, h), late, noise, h, step, values, gains, positions, efforts)
    if dirt.hold == "following":
        force = efforts[logged]
    elif dirt.hold == "preceding":
        force = efforts[np.maximum(logged - 1, 0)]
    else:
        passed = np.concatenate([[0.0], np.cumsum(efforts)])
        low = np.maximum(logged - dirt.every, 0)
        force = (passed[logged] - passed[low]) / np.maximum(logged - low, 1)
    time = h * logged
    n_logged = logged.shape[0]
    level = axis.coulomb
    force = (
        force + level * dirt.force_noise * random.standard_normal(n_logged) + level * dirt.pink * pink_noise(random, n_logged)
    )
    force += level * dirt.mains * np.sin(2.0 * math.pi * 50.0 * time + random.uniform(0.0, 2.0 * math.pi))
    if dirt.force_step:
        force = level * dirt.force_step * np.round(force / (level * dirt.force_step))
    if dirt.spikes:
        at = random.integers(n_logged // 10, n_logged, dirt.spikes)
        force[at] += random.choice([-1.0, 1.0], dirt.spikes) * random.uniform(5.0, 40.0, dirt.spikes) * np.std(force)
    stamps = time + (stamp_late if dirt.jitter else 0.0)
    if dirt.single:
        stamps = (stamps + 3600.0).astype(np.float32).astype(np.float64)
    keep = logged * h >= lead
    position, force, stamps = positions[logged][keep], force[keep], stamps[keep]
    # What every recording goes through when it is read.
    found = rounded_grid(np.asarray(stamps, dtype=np.float64))
    stamps = stamps if found is None else found[0]
    good = np.concatenate([[True], np.diff(stamps) > 0.0])
    record = Record(stamps[good] - stamps[0], position[good], force[good], source=f"dirty axis, seed {seed}")
    return replace(record, effort_hold="unknown")
