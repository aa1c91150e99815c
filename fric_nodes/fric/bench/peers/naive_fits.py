"""Identification beside a naive fit: a simulator written step by step in Python, with least squares or CMA-ES around it.

The recording is the first 4,000 samples of that of ``fric bench fitting``, and so are the six parameters. The simulator makes
one step per sample: first the velocity without friction, then friction takes as much of it as its level allows; with less than
that, the axis rests. The optimisers begin with a rough guess, and with units that make the parameters alike.

``fric.identify`` begins with 1 everywhere. It also checks the recording, foresees what can be identified, and gives standard
errors and warnings. How long the fit and its standard errors take alone stands beside it.

An error is the difference of a parameter from its true value as a share of that; one figure holds the root mean square of the
six, and its name each of them.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from ...facade.identifying import identify
from ...figure import Figure
from ...identification import METHODS
from ...identification.result import Options
from ...record import Array, Record
from ..benchmarks.fitting import HELD, NAMES, STRIBECK, recording, structure, truth
from ..peer import Pair, Peer

__all__ = ["PEER", "step_by_step"]

_N_SAMPLES = 4_000
_GUESS = np.array([120.0, 15.0, 2.0, 0.0, 150.0, 0.0])
_SCALE = np.array([100.0, 20.0, 5.0, 30.0, 200.0, 3.0])
_SEED = 1
_METHOD = "output-error"


def step_by_step(parameters: Array, effort: Sequence[float], h: float, start: float) -> Array:
    """Positions [m], shape ``(n,)``, from rest under ``effort`` [N], each force held until the next sample.

    Args:
        parameters: mass, Coulomb, Stribeck surplus, asymmetry, viscous and bias, shape ``(6,)``.
        effort: length n.
        h: time between samples [s].
        start: position [m].
    """
    mass, coulomb, surplus, asymmetry, viscous, bias = parameters.tolist()
    x, v, gain = start, 0.0, h / mass
    positions = [x]
    for push in effort[:-1]:
        free = v + gain * (push - bias - viscous * v - asymmetry * abs(v))
        most = gain * (coulomb + surplus * math.exp(-((v / STRIBECK) ** 2)))
        new = free - most if free > most else free + most if free < -most else 0.0
        x += 0.5 * h * (v + new)
        v = new
        positions.append(x)
    return np.array(positions)


@dataclass
class _Naive:
    """A fit of :func:`step_by_step` to ``record``; remembers what it found last."""

    record: Record
    found: Array = field(default_factory=lambda: np.zeros(len(NAMES)))
    runs: int = 0

    def residuals(self, parameters: Array) -> Array:
        self.runs += 1
        record = self.record
        found = step_by_step(parameters, record.effort.tolist(), record.sample_time, float(record.position[0]))
        return found - record.position

    def by_least_squares(self) -> float:
        self.runs, begun = 0, time.perf_counter()
        self.found = np.asarray(least_squares(self.residuals, _GUESS, x_scale=_SCALE).x)
        return time.perf_counter() - begun

    def by_cma(self) -> float:
        import cma

        def cost(scaled: Array) -> float:
            parameters = np.asarray(scaled) * _SCALE
            # A mass below 1 % of the scale is none.
            return math.inf if parameters[0] < 1.0 else float(np.sum(self.residuals(parameters) ** 2))

        self.runs, begun = 0, time.perf_counter()
        # Tolerance of the cost: 1e-6 of what noise leaves of it at the end, about 3e-6 m^2.
        options = {"verbose": -9, "seed": _SEED, "tolfun": 1e-12, "tolx": 1e-5}
        best, _ = cma.fmin2(cost, _GUESS / _SCALE, 0.3, options)
        self.found = np.asarray(best) * _SCALE
        return time.perf_counter() - begun


class _Fric:
    """The same by ``fric.identify``."""

    def __init__(self, record: Record) -> None:
        self.record = record
        self.found = np.zeros(len(NAMES))

    def __call__(self) -> float:
        begun = time.perf_counter()
        found = identify(self.record, structure(), method=_METHOD, held=HELD)
        spent = time.perf_counter() - begun
        self.found = np.array([found[name] for name in NAMES])
        return spent

    def fit_alone(self) -> float:
        """Shortest time of three."""
        times = []
        for _ in range(3):
            begun = time.perf_counter()
            METHODS[_METHOD].fit(structure(), [self.record], Options(held=HELD))
            times.append(time.perf_counter() - begun)
        return min(times)


def _errors(who: str, found: Array) -> Figure:
    true = np.array([truth().value(name) for name in NAMES])
    off = 100.0 * (found / true - 1.0)
    each = ", ".join(f"{name} {value:+.2g}" for name, value in zip(NAMES, off.tolist(), strict=True))
    return Figure(f"errors of the parameters, {who}, RMS (each: {each})", float(np.sqrt(np.mean(off**2))), "%")


def _pair(name: str, record: Record, turns: int, way: Callable[[_Naive], float], needs: str = "") -> Pair:
    mine, other = _Fric(record), _Naive(record)

    def beside() -> list[Figure]:
        return [
            Figure("fric, the fit alone", mine.fit_alone(), "s"),
            Figure("free runs of the other", float(other.runs), ""),
            _errors("fric", mine.found),
            _errors("the other", other.found),
        ]

    title = f"identification, {_N_SAMPLES:,} samples, against {name}"
    return Pair(title, mine, lambda: way(other), ">= 100", turns, needs, warm=turns > 3, beside=beside)


def prepare(_: Path) -> Sequence[Pair]:
    """Against least squares, and against CMA-ES."""
    record = recording().slice(0, _N_SAMPLES)
    return (
        _pair("a simulator in Python and least_squares", record, 9, _Naive.by_least_squares),
        _pair("a simulator in Python and CMA-ES", record, 3, _Naive.by_cma, "cma"),
    )


PEER = Peer("naive-fits", prepare)
