"""Pre-sliding, frictional memory and velocity weakening from a population of asperities that stick, slip and let go.

Equation: F = sum_i k d_i over the asperities in contact; while the tip sticks, dd_i/dt = v; it slips at |d_i| = (y_i g/K)
mu*(t_i), t_i the age of the contact, mu* = 1 + (M - 1)(1 - exp(-t_i/tau)); where the tip has slipped over its wave (length
random, mean w_0) it lets go, what it held is lost, and it touches the next wave alpha w further. y_i are heights over their
mean, g is the slip level of the other terms, K = k N/(1 + alpha) the stiffness of the asperities that touch, of N in all.
Source: Al-Bender, Lampaert, Swevers 2004, Secs. 4 to 6; the population and what was settled about it is in
:mod:`fric.friction.asperity`.

The level g is what friction would be at high speed, where no contact has time to strengthen: with k_t* = K w_0/g, F is the
paper's normalised force F_t* times g. Slow sliding takes nearly M g. So the Stribeck curve, the lag and the rise with dwell
time come from the population itself, and the level is best left to the term ``coulomb`` and what scales it.

The step is exact for constant velocity and level. A contact that is lost is a jump of the states; where the solver of a step
interpolates between two trials, one of the few asperities that let go in one but not in the other is afterwards put back to
what it can hold.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..friction.asperity_loops import advance, heights, start
from ..parameter import Parameter
from ..record import Array

__all__ = ["EFFECT"]


@kernel
def prepare(
    k: Any, j: int,
    stiffness: float, wavelength: float, growth: float, time: float, gap: float, mass: float, asperities: float, seed: float,
) -> None:  # fmt: skip
    """The heights over their mean."""
    heights(k, j, int(asperities + 0.5), int(seed + 0.5))


@kernel
def slip(
    z: Any, z_next: Any, i: int, v: float, h: float, level: float, k: Any, j: int,
    stiffness: float, wavelength: float, growth: float, time: float, gap: float, mass: float, asperities: float, seed: float,
) -> float:  # fmt: skip
    n = int(asperities + 0.5)
    each = (1.0 + gap) / n
    return advance(
        z, z_next, i, v, h, k, j, n, 0, max(level, 0.0) / stiffness, stiffness * each, mass * each,
        int(seed + 0.5), 0, growth, time, 1.0, 1.0, gap, wavelength,
    )  # fmt: skip


def _asperities(
    stiffness: float, wavelength: float, growth: float, time: float, gap: float, mass: float, asperities: float, seed: float
) -> int:
    return int(asperities + 0.5)


def _states(
    stiffness: float, wavelength: float, growth: float, time: float, gap: float, mass: float, asperities: float, seed: float
) -> int:
    return 4 * int(asperities + 0.5)


def _initial(
    stiffness: float, wavelength: float, growth: float, time: float, gap: float, mass: float, asperities: float, seed: float
) -> Array:
    n = int(asperities + 0.5)
    z = np.empty(4 * n)
    start(z, n, int(seed + 0.5), 0, gap, wavelength)
    return z


def _rate(
    body: float, stiffness: float, wavelength: float, growth: float, time: float, gap: float, mass: float, asperities: float,
    seed: float,
) -> float:  # fmt: skip
    """Natural frequency of the body on the asperities that touch [1/s]."""
    return math.sqrt(stiffness / body)


EFFECT = Effect(
    id="presliding",
    law="asperity",
    place=Place.SLIP_DYNAMICS,
    title="pre-sliding displacement",
    equation="F = sum k d_i; sticks: dd_i/dt = v; slips at |d_i| = (y_i g/K) mu*(age), mu* = 1 + (M - 1)(1 - exp(-age/tau))",
    source="Al-Bender, Lampaert, Swevers 2004, Secs. 4-6, Eq. 1",
    parameters=(
        Parameter("stiffness", "K", "F/x", "stiffness of the asperities that touch, with which motion begins", positive=True),
        Parameter("wavelength", "w_0", "x", "mean length over which an asperity keeps its contact", positive=True),
        Parameter(
            "growth", "M", "1", "friction of old contacts over that of fresh ones", lower=1.0, upper=100.0, default=5.0
        ),
        Parameter("time", "tau", "s", "time in which contacts grow old", positive=True),
        Parameter(
            "gap", "alpha", "1", "way without contact over that with contact", lower=0.0, upper=10.0, default=1.0, shape=True
        ),
        Parameter("mass", "m", "F s^2/x", "mass of the asperities that touch, which swings out when they let go", lower=0.0,
                  default=0.0),
        Parameter(
            "asperities", "N", "1", "number of asperities, a whole number", lower=1.0, upper=1e6, default=1000.0, shape=True
        ),
        Parameter("seed", "s", "1", "which of all random populations, a whole number", lower=0.0, upper=1e6, default=1.0,
                  shape=True),
    ),
    slip=slip,
    n_states=_states,
    initial=_initial,
    n_constants=_asperities,
    prepare=prepare,
    rate=_rate,
    regime="the first micrometres after each reversal, and at low speed: weakening, lag and the rise after a rest",
    looks_like={
        "stribeck": "change the speed quickly: a population answers late, and more strongly after a rest",
        "frictional_lag": "reverse within the first micrometres: lag alone has no elastic loops there",
        "dwell_time": "rest, then move back and forth within the first micrometres: only old contacts strengthen the loops too",
    },
)  # fmt: skip
