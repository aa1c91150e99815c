"""A guideway to identify, for :mod:`.amthor`: simulated by an integrator and with friction that share nothing with fric's own.

Axis and controller have the size of ``config/guideway_model.yaml`` and ``config/guideway_pid.yaml``; the paper gives no values:

    m dv/dt = u - F - c v,   T du/dt = command - u,

position control (PID with a filtered derivative) at 6.25 kHz, ten steps of semi-implicit Euler in between. Friction is a
population of ``ELEMENTS`` Maxwell elements after the generalised Maxwell-slip model (Lampaert et al. 2005): each sticks,
dF_i/dt = k_i v, until |F_i| = alpha_i s(v), then slides, dF_i/dt = sgn(v) C alpha_i (1 - |F_i|/(alpha_i s)), until v reverses;
s(v) = F_C + (F_S - F_C) exp(-(v/v_S)^2). Break-away displacements are spread so densely that the first loading is smooth,
F = s (1 - (1 - x/x_p)^3), x_p = 3 s/K: with five or ten springs a DNLRX can but approach it.

Sensors: interferometer of 0.1 nm noise and 0.1 nm steps, force from the measured current with 0.2 mN of noise.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from ..axis import Measurement
from ..engine.kernel import kernel, local_array, loop
from ..record import Array, Record

__all__ = ["READING_AGE", "SAMPLE_TIME", "Guideway", "graded_strokes", "recorded", "wandering"]

SAMPLE_TIME = 1.6e-4  # [s] of the controller and of the recording
ELEMENTS = 150
_FINE = 10
_READINGS, _BETWEEN = 4, 3  # interferometer at 25 kHz, and steps between two of its readings
READING_AGE = 0.5 * (_READINGS - 1) / _READINGS * SAMPLE_TIME  # [s], of the mean of those in a period
_MASS, _VISCOUS, _LAG = 0.6, 2.0, 1e-4  # [kg], [N s/m], [s]
_COULOMB, _STATIC, _STRIBECK = 0.6, 0.75, 2e-3  # [N], [N], [m/s]
_STIFFNESS, _ATTRACTION, _BRISTLE_DAMPING = 6e5, 30.0, 60.0  # [N/m], [N/s], [N s/m]
_GAINS = np.array([1.31e5, 3.57e7, 479.0, 3.2e-4])  # kp, ki, kd, filter time
_POSITION_NOISE, _RESOLUTION, _FORCE_NOISE = 1e-10, 1e-10, 2e-4  # [m], [m], [N]


@kernel
def _moved(x: Any, command: float, inner: float, n: int, share: Any, stiffness: Any, element: Any, slides: Any) -> float:
    """Lead position, velocity and force ``x`` over ``n`` steps of ``inner`` [s] under ``command`` [N]; mean force [N]."""
    q, v, u = x[0], x[1], x[2]
    mean = 0.0
    for _ in range(n):
        u += (command - u) * inner / _LAG
        friction, sticking = 0.0, 0.0
        for i in range(share.shape[0]):
            friction += element[i]
            sticking += 0.0 if slides[i] else share[i]
        friction += _BRISTLE_DAMPING * v * sticking
        before = v
        v += inner / _MASS * (u - friction - _VISCOUS * v)
        q += inner * v
        mean += u / n
        level = _COULOMB + (_STATIC - _COULOMB) * math.exp(-((v / _STRIBECK) ** 2))
        turned = before * v <= 0.0
        way = 1.0 if v > 0.0 else -1.0
        for i in range(share.shape[0]):
            limit = share[i] * level
            if turned:
                slides[i] = False
            if slides[i]:
                element[i] += inner * way * _ATTRACTION * share[i] * (1.0 - way * element[i] / limit)
            else:
                element[i] += inner * stiffness[i] * v
                if way * element[i] >= limit:
                    element[i] = way * limit
                    slides[i] = True
    x[0], x[1], x[2] = q, v, u
    return mean


@loop
def _led(x: Any, command: float, inner: float, n: int, share: Any, stiffness: Any, element: Any, slides: Any) -> float:
    return float(_moved(x, command, inner, n, share, stiffness, element, slides))


@loop
def _closed_loop(
    wanted: Any, noise: Any, gains: Any, h: float, share: Any, stiffness: Any, element: Any, slides: Any,
    position_out: Any, force_out: Any,
) -> None:  # fmt: skip
    """The axis under its controller along ``wanted``; ``position_out`` as measured, ``force_out`` the mean since the last."""
    x = local_array(3)
    x[0] = x[1] = x[2] = 0.0
    integral, rate, last = 0.0, 0.0, 0.0
    mean = 0.0
    inner = h / _FINE
    for k in range(wanted.shape[0]):
        seen = round((x[0] + noise[k]) / _RESOLUTION) * _RESOLUTION
        position_out[k] = seen
        force_out[k] = mean
        error = wanted[k] - seen
        integral += gains[1] * h * error
        rate += h / (h + gains[3]) * ((error - last) / h - rate)
        last = error
        command = gains[0] * error + integral + gains[2] * rate
        mean = _moved(x, command, inner, _FINE, share, stiffness, element, slides)


def _population() -> tuple[Array, Array]:
    """Shares of the slip level and stiffnesses [N/m] of the elements, each ``(ELEMENTS,)``.

    The first loading has the slope K (1 - x/x_p)^2: elements of the density -dslope/dx break away at x.
    """
    edges = np.linspace(0.0, 1.0, ELEMENTS + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    stiffness = _STIFFNESS * ((1.0 - edges[:-1]) ** 2 - (1.0 - edges[1:]) ** 2)
    held = stiffness * middle
    return held / held.sum(), stiffness


class Guideway:
    """The axis in the hands of any controller, of which every period holds ``_READINGS`` readings that are averaged.

    Args:
        seed: of the noise.
    """

    def __init__(self, seed: int) -> None:
        share, stiffness = _population()
        self._axis = share, stiffness, np.zeros(ELEMENTS), np.zeros(ELEMENTS, dtype=np.bool_)
        self._x = np.zeros(3)
        self._random = np.random.default_rng(seed)
        self._read, self._n_read = 0.0, 0
        self._impulse = self._elapsed = 0.0
        self._before = 0.0

    @property
    def position(self) -> float:
        """True position [m]."""
        return float(self._x[0])

    def _reading(self) -> float:
        return _RESOLUTION * round((self.position + _POSITION_NOISE * self._random.standard_normal()) / _RESOLUTION)

    def advance(self, force: float, duration: float) -> None:
        """Lead it over ``duration`` [s] under the command ``force`` [N]."""
        inner = duration / (_READINGS * _BETWEEN)
        for _ in range(_READINGS):
            mean = _led(self._x, force, inner, _BETWEEN, *self._axis)
            self._impulse += mean * inner * _BETWEEN
            self._read += self._reading()
        self._n_read += _READINGS
        self._elapsed += duration

    def measure(self) -> Measurement:
        """What interferometer and current probe say about the time since they were last asked."""
        seen = self._read / self._n_read if self._n_read else self._reading()
        rate = (seen - self._before) / self._elapsed if self._elapsed else 0.0
        effort = self._impulse / self._elapsed if self._elapsed else 0.0
        effort += _FORCE_NOISE * float(self._random.standard_normal())
        self._before, self._read, self._n_read, self._impulse, self._elapsed = seen, 0.0, 0, 0.0, 0.0
        return Measurement(seen, rate, effort)


def recorded(wanted: Array, seed: int, sample_time: float = SAMPLE_TIME, keep: int = 1) -> Record:
    """What position sensor and current probe see while the axis is led along ``wanted`` [m], shape ``(n_samples,)``.

    Args:
        wanted: one value for each sample of the controller.
        seed: of the noise.
        sample_time: of the controller [s].
        keep: record every so many samples, the force as its mean since the last one.
    """
    share, stiffness = _population()
    rng = np.random.default_rng(seed)
    n = wanted.shape[0]
    position, force = np.empty(n), np.empty(n)
    noise = _POSITION_NOISE * rng.standard_normal(n)
    _closed_loop(
        wanted, noise, _GAINS, sample_time, share, stiffness, np.zeros(ELEMENTS), np.zeros(ELEMENTS, dtype=np.bool_),
        position, force,
    )  # fmt: skip
    force += _FORCE_NOISE * rng.standard_normal(n)
    n_kept = (n - 1) // keep
    force = np.append(force[0], force[1 : n_kept * keep + 1].reshape(n_kept, keep).mean(axis=1))
    position = position[: n_kept * keep + 1 : keep].copy()
    time = keep * sample_time * np.arange(n_kept + 1, dtype=np.float64)
    return Record(time, position, force, joint="guideway", source="simulated guideway", effort_hold="preceding")


def _moves(points: list[float], speed: float, least: float, sample_time: float) -> Array:
    """From point to point by moves of least jerk with this peak speed [m/s], none shorter than ``least`` [s]."""
    parts: list[Array] = [np.zeros(1)]
    for a, b in pairwise(points):
        duration = max(1.875 * abs(b - a) / speed, least)
        s = np.arange(1, round(duration / sample_time) + 1) * sample_time / duration
        parts.append(np.asarray(a + (b - a) * s**3 * (10.0 - 15.0 * s + 6.0 * s**2), dtype=np.float64))
    return np.concatenate(parts)


def graded_strokes(largest: float = 3e-5, smallest: float = 3e-8, grades: int = 9, speed: float = 2e-4) -> Array:
    """To and fro with amplitudes that fall from ``largest`` to ``smallest`` [m] and grow again, with inner loops on the way."""
    down = np.geomspace(largest, smallest, grades)
    points = [0.0]
    for amplitude in (*down, *down[-2::-1]):
        a = float(amplitude)
        points += [a, -a, -0.4 * a, -0.8 * a, 0.5 * a, 0.1 * a, a, -a]
    return _moves([*points, 0.0], speed, 0.12, SAMPLE_TIME)


def wandering(
    seed: int, largest: float = 2e-5, smallest: float = 4e-8, turns: int = 150, speed: float = 2e-4,
    sample_time: float = SAMPLE_TIME,
) -> Array:  # fmt: skip
    """Moves of random length and direction, ``smallest`` to twice ``largest`` [m], after one stroke longer than all others."""
    rng = np.random.default_rng(seed)
    points = [0.0, 1.5 * largest, -1.5 * largest]
    for length in np.exp(rng.uniform(math.log(smallest), math.log(2.0 * largest), turns)):
        way = float(length) * (1.0 if rng.random() < 0.5 else -1.0)
        here = points[-1]
        points.append(here + way if abs(here + way) < 1.2 * largest else here - way)
    return _moves([*points, 0.0], speed, 0.12, sample_time)
