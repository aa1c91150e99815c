"""Coverage of the intervals of the two-stage method, over 200 simulated recordings for each pace of the motion.

An axis on three Maxwell springs is led along random strokes by a PD law at 6 kHz that reads the quantised position,
integrated with twenty steps of its own to each of the law's; recorded at 1 kHz, the force as the mean since the last sample
and with noise that never acted. What changes from case to case is how long a stroke takes at least: slow strokes hide the
mass behind what the springs leave, fast ones turn within the period of the low-pass.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from ...engine.kernel import loop
from ...figure import Figure
from ...identification import METHODS
from ...identification.result import Options
from ...model import Model, build_model, term
from ...record import Array, Record
from ..benchmark import Benchmark
from ..trials import SEEDS, Change, Finding, Listener, as_it_is, count, figures_of, of_model, unheard

__all__ = ["BENCHMARK", "LIMITS", "PACES", "SPRINGS", "recorded", "structure", "trial", "truth"]

SPRINGS = np.array([4e5, 2e5, 1e5])
"""Stiffnesses [N/m]."""

LIMITS = np.array([4e-7, 1.5e-6, 5e-6])
"""Deformations at which they slide [m]."""

PACES: Mapping[str, float] = {"strokes of 0.04 s": 0.04, "strokes of 0.12 s": 0.12, "strokes of 0.5 s": 0.5}
"""Least duration of a stroke [s]."""

_MASS, _VISCOUS, _BIAS = 2.0, 40.0, 0.3
_STEP, _PER_SAMPLE, _FINE = 1e-3, 6, 20
_LARGEST, _SMALLEST, _SPEED = 4e-5, 3e-8, 2e-3  # [m], [m], [m/s]
_DURATION = 20.0
_RESOLUTION = 1e-10  # [m]


@loop
def _led(wanted: Any, h: float, springs: Any, limits: Any, bent: Any, position: Any, force: Any) -> None:
    """The velocity by Euler, the way by its mean over the step, Eq. 11 of Amthor in each step.

    ``wanted`` has ``_PER_SAMPLE`` values to a sample; ``force`` is the mean since the last one.
    """
    q, v, before = 0.0, 0.0, 0.0
    fast = h / _PER_SAMPLE
    inner = fast / _FINE
    for k in range(position.shape[0] - 1):
        position[k] = round(q / _RESOLUTION) * _RESOLUTION
        mean = 0.0
        for j in range(k * _PER_SAMPLE, (k + 1) * _PER_SAMPLE):
            seen = round(q / _RESOLUTION) * _RESOLUTION
            rate = (wanted[j + 1] - wanted[j]) / fast
            u = 3e6 * (wanted[j] - seen) + 4000.0 * (rate - (seen - before) / fast) + _BIAS
            before = seen
            mean += u / _PER_SAMPLE
            for _ in range(_FINE):
                friction = 0.0
                for i in range(springs.shape[0]):
                    friction += springs[i] * bent[i]
                before_v = v
                v += inner / _MASS * (u - friction - _VISCOUS * v - _BIAS)
                way = 0.5 * inner * (before_v + v)
                q += way
                for i in range(springs.shape[0]):
                    bent[i] = min(max(bent[i] + way, -limits[i]), limits[i])
        force[k + 1] = mean
    position[-1] = round(q / _RESOLUTION) * _RESOLUTION


def _reference(random: np.random.Generator, least: float) -> Array:
    """Smooth strokes of random length, after one that is longer than all; at the rate of the controller."""
    points = [0.0, 1.3 * _LARGEST, -1.3 * _LARGEST]
    fast = _STEP / _PER_SAMPLE
    parts: list[Array] = [np.zeros(round(0.2 / fast))]
    spent = 0
    while spent < _DURATION / fast:
        if len(points) < 2:
            way = math.exp(random.uniform(math.log(_SMALLEST), math.log(2.0 * _LARGEST))) * random.choice((-1.0, 1.0))
            # Back inside by whichever way, and never as far as the first stroke went.
            there = points[-1] + (way if abs(points[-1] + way) < _LARGEST else -way)
            points.append(min(max(there, -_LARGEST), _LARGEST))
        for a, b in pairwise(points):
            n = round(max(least * random.uniform(1.0, 1.5), 1.9 * abs(b - a) / _SPEED) / fast)
            s = np.arange(1, n + 1) / n
            parts.append(np.asarray(a + (b - a) * s**3 * (10.0 - 15.0 * s + 6.0 * s**2), dtype=np.float64))
            spent += n
        points = points[-1:]
    return np.concatenate(parts)


def recorded(seed: int, least: float, force_noise: float = 0.02) -> Record:
    """What the instruments record over a motion that belongs to ``seed``.

    Args:
        seed: of motion and noise.
        least: duration of a stroke at least [s].
        force_noise: standard deviation [N].
    """
    random = np.random.default_rng(seed)
    wanted = _reference(random, least)
    position, force = np.empty((2, (wanted.shape[0] - 1) // _PER_SAMPLE + 1))
    _led(wanted, _STEP, SPRINGS, LIMITS, np.zeros(SPRINGS.shape[0]), position, force)
    force[0] = force[1]
    force += force_noise * random.standard_normal(force.shape[0])
    time: Array = _STEP * np.arange(force.shape[0], dtype=np.float64)
    return Record(time, position, force, effort_hold="preceding", source=f"springs, seed {seed}")


def structure(n_springs: int = 3) -> Model:
    """What is fitted: so many springs (0: as many as the method finds), a viscous force and a bias."""
    springs = {f"{what}_{k}": 1.0 for what in ("stiffness", "limit") for k in range(1, n_springs + 1)}
    dry = [term("presliding", "maxwell_slip", **springs)] if n_springs else []
    terms = [term("coulomb", force=1.0), *dry, term("viscous", coefficient=1.0), term("bias", force=0.0)]
    return build_model("rigid", {"mass": 1.0}, terms)


def truth() -> dict[str, float]:
    """Values by name."""
    found = {"mass": _MASS, "viscous.coefficient": _VISCOUS, "bias.force": _BIAS, "coulomb.force": float(SPRINGS @ LIMITS)}
    found |= {f"presliding.stiffness_{k}": value for k, value in enumerate(SPRINGS.tolist(), start=1)}
    return found | {f"presliding.limit_{k}": value for k, value in enumerate(LIMITS.tolist(), start=1)}


def trial(least: float, seed: int, change: Change = as_it_is, heard: Listener = unheard) -> Finding:
    """One recording, its three springs given.

    Args:
        least: duration of a stroke at least [s].
        seed: of motion and noise.
        change: made to the recording before it is fitted.
        heard: is given the result.
    """
    found = METHODS["two-stage"].fit(structure(), [change(recorded(seed, least))], Options(decimation=25))
    heard(found)
    return of_model(found, truth())


def run(seeds: Sequence[int] = SEEDS) -> list[Figure]:
    """Coverage, bias and spread per pace and parameter."""
    figures = []
    for title, least in PACES.items():
        figures += figures_of(title, *count(partial(trial, least), seeds))
    return figures


BENCHMARK = Benchmark("calibration-two-stage", "coverage of the intervals of the two-stage method", run, long=True)
