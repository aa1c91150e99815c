"""Coverage of the intervals of forced oscillations, over 200 simulated experiments of four runs each.

An axis m a = u + b - F_C sgn v - F_v v - k q between springs under a sinusoidal force that a drive updates at every sample
and holds until the next. While its direction lasts, the axis is a damped oscillator about q_e = (u + b - F_C sgn v)/k, so that
its motion over a sample is known in closed form, with w_0^2 = k/m, d = F_v/(2 m), w^2 = w_0^2 - d^2 and x = q - q_e:

    x(t) = e^{-d t} (x_0 cos w t + (v_0 + d x_0)/w sin w t),    v(t) = e^{-d t} (v_0 cos w t - (d v_0 + w_0^2 x_0)/w sin w t),

until v passes zero, at tan w t = w v_0/(d v_0 + w_0^2 x_0): there it sticks (``|u + b - k q| <= F_C``) or goes on the other
way. Nothing of it is shared with the engine that fits use.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numba
import numpy as np

from ...figure import Figure
from ...identification import METHODS
from ...identification.result import Options
from ...identification.start import start_model
from ...record import Array, Record, Units
from ..benchmark import Benchmark
from ..trials import SEEDS, Change, Finding, Listener, as_it_is, count, figures_of, of_model, unheard

__all__ = ["BENCHMARK", "experiment", "held_force", "trial"]

_STEP = 1e-3  # [s]
_PERIODS = 30
_FREQUENCIES = (0.6, 0.85, 1.3, 1.8)  # of the runs, of the axis's own
_DRIVEN = 4.0  # force of a run, of the friction and the spring it works against
_RESOLUTION = 1e-6  # [m]
_FORCE_NOISE = 0.01  # of the Coulomb force


@numba.njit(cache=True)
def held_force(force: Any, mass: float, viscous: float, stiffness: float, coulomb: float, h: float, position: Any) -> None:
    """Position at each sample of an axis from rest under forces held for ``h``; shapes ``(n,)``."""
    d, natural = 0.5 * viscous / mass, stiffness / mass
    w = math.sqrt(natural - d * d)
    q, v = 0.0, 0.0
    for k in range(position.shape[0]):
        position[k] = q
        left = h
        for _ in range(4):  # a sample holds far fewer reversals
            pull = force[k] - stiffness * q
            if v == 0.0 and abs(pull) <= coulomb:
                break
            sign = math.copysign(1.0, v if v != 0.0 else pull)
            rest = (force[k] - coulomb * sign) / stiffness
            x = q - rest
            turn = math.atan2(w * v, d * v + natural * x) if v != 0.0 else math.pi
            turn = (turn % math.pi) / w
            if turn < 1e-12:  # [s]: it has just turned
                turn = math.pi / w
            t = min(turn, left)
            decay, c, s = math.exp(-d * t), math.cos(w * t), math.sin(w * t)
            q = rest + decay * (x * c + (v + d * x) / w * s)
            v = decay * (v * c - (d * v + natural * x) / w * s) if turn > left else 0.0
            left -= t
            if left <= 0.0:
                break


def experiment(seed: int) -> tuple[list[Record], dict[str, float]]:
    """Four runs of an axis that belongs to ``seed``, and its values by name."""
    random = np.random.default_rng(seed)
    mass, own = float(random.uniform(0.5, 4.0)), 2.0 * math.pi * float(random.uniform(1.5, 4.0))
    stiffness = mass * own**2
    viscous = 2.0 * float(random.uniform(0.05, 0.3)) * mass * own
    coulomb = 0.01 * stiffness * float(random.uniform(0.05, 0.3))
    bias = coulomb * float(random.uniform(-0.5, 0.5))
    records = []
    for number, ratio in enumerate(_FREQUENCIES):
        frequency = own * ratio * float(random.uniform(0.95, 1.05))
        time: Array = _STEP * np.arange(round(_PERIODS * 2.0 * math.pi / frequency / _STEP), dtype=np.float64)
        # What moves the axis by about a centimetre, and more than friction by far.
        dynamic = abs(complex(stiffness - mass * frequency**2, viscous * frequency))
        size = 0.01 * dynamic * float(random.uniform(0.5, 1.5)) + _DRIVEN / math.pi * coulomb
        force = size * np.sin(frequency * time + random.uniform(0.0, 2.0 * math.pi))
        position = np.empty(time.shape[0])
        # A bias is friction that doesn't turn: what the force has to make beside the rest.
        held_force(force - bias, mass, viscous, stiffness, coulomb, _STEP, position)
        noisy = force + _FORCE_NOISE * coulomb * random.standard_normal(time.shape[0])
        position = _RESOLUTION * np.round(position / _RESOLUTION)
        records.append(Record(time, position, noisy, effort_hold="following", source=f"forced, seed {seed}, run {number}"))
    truth = {"mass": mass, "stiffness.stiffness": stiffness, "viscous.coefficient": viscous}
    return records, truth | {"coulomb.force": coulomb, "bias.force": bias}


def trial(seed: int, change: Change = as_it_is, heard: Listener = unheard) -> Finding:
    """One experiment.

    Args:
        seed: of the axis, its runs and their noise.
        change: made to each recording before it is fitted.
        heard: is given the result.
    """
    records, truth = experiment(seed)
    structure = start_model(["stiffness", "viscous", "coulomb", "bias"], "axis", Units())
    found = METHODS["forced-oscillation"].fit(structure, [change(record) for record in records], Options())
    heard(found)
    return of_model(found, truth)


def run(seeds: Sequence[int] = SEEDS) -> list[Figure]:
    """Coverage, bias and spread per parameter."""
    return figures_of("forced-oscillation", *count(trial, seeds))


BENCHMARK = Benchmark("calibration-forced", "coverage of the intervals of forced oscillations", run, long=True)
