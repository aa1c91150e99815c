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

from ..engine.kernel import loop
from ..record import Array, Record

__all__ = ["SAMPLE_TIME", "graded_strokes", "recorded", "wandering"]

SAMPLE_TIME = 1.6e-4  # [s] of the controller and of the recording
ELEMENTS = 150
_FINE = 10
_MASS, _VISCOUS, _LAG = 0.6, 2.0, 1e-4  # [kg], [N s/m], [s]
_COULOMB, _STATIC, _STRIBECK = 0.6, 0.75, 2e-3  # [N], [N], [m/s]
_STIFFNESS, _ATTRACTION, _BRISTLE_DAMPING = 6e5, 30.0, 60.0  # [N/m], [N/s], [N s/m]
_GAINS = np.array([1.31e5, 3.57e7, 479.0, 3.2e-4])  # kp, ki, kd, filter time
_POSITION_NOISE, _RESOLUTION, _FORCE_NOISE = 1e-10, 1e-10, 2e-4  # [m], [m], [N]


@loop
def _closed_loop(
    wanted: Any, noise: Any, gains: Any, h: float, share: Any, stiffness: Any, element: Any, slides: Any,
    position_out: Any, force_out: Any,
) -> None:  # fmt: skip
    """The axis under its controller along ``wanted``; ``position_out`` as measured, ``force_out`` the mean since the last."""
    q, v, u = 0.0, 0.0, 0.0
    integral, rate, last = 0.0, 0.0, 0.0
    mean = 0.0
    inner = h / _FINE
    for k in range(wanted.shape[0]):
        seen = round((q + noise[k]) / _RESOLUTION) * _RESOLUTION
        position_out[k] = seen
        force_out[k] = mean
        error = wanted[k] - seen
        integral += gains[1] * h * error
        rate += h / (h + gains[3]) * ((error - last) / h - rate)
        last = error
        command = gains[0] * error + integral + gains[2] * rate
        mean = 0.0
        for _ in range(_FINE):
            u += (command - u) * inner / _LAG
            friction, sticking = 0.0, 0.0
            for i in range(share.shape[0]):
                friction += element[i]
                sticking += 0.0 if slides[i] else share[i]
            friction += _BRISTLE_DAMPING * v * sticking
            before = v
            v += inner / _MASS * (u - friction - _VISCOUS * v)
            q += inner * v
            mean += u / _FINE
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


def _population() -> tuple[Array, Array]:
    """Shares of the slip level and stiffnesses [N/m] of the elements, each ``(ELEMENTS,)``.

    The first loading has the slope K (1 - x/x_p)^2: elements of the density -dslope/dx break away at x.
    """
    edges = np.linspace(0.0, 1.0, ELEMENTS + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    stiffness = _STIFFNESS * ((1.0 - edges[:-1]) ** 2 - (1.0 - edges[1:]) ** 2)
    held = stiffness * middle
    return held / held.sum(), stiffness


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
