"""Coverage of the intervals of the methods for free oscillations, over 200 simulated recordings each.

de Marchi's pendulums (:mod:`..verification.free_oscillation_reference`: Runge-Kutta of order 8 from reversal to reversal) in
turn, each recording with its own deflection, instant of release, encoder zero and noise. For the parametric oscillation each
experiment is four recordings of one pendulum under four position gains.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from ...figure import Figure
from ...identification import METHODS
from ...identification.result import Options
from ...model import Model, build_model, term
from ...record import Record, Units
from ...verification.free_oscillation_reference import INERTIA, PENDULUMS, Pendulum, recorded, swing
from ..benchmark import Benchmark
from ..trials import SEEDS, Change, Finding, Listener, as_it_is, count, figures_of, of_model, unheard

__all__ = ["BENCHMARK", "CASES", "free", "parametric"]

CASES = ("log-decrement", "hilbert", "wavelet")
"""Methods that fit one free oscillation."""

_GAINS = (0.43, 0.54, 0.68, 0.86)  # P [N m/rad]
_STIFFNESS = 0.0162  # [N m/rad], of the pendulum itself
_OWN = {"viscous": 0.0024, "asymmetry": 0.0005, "coulomb": 0.036, "constant": 0.016}  # of its friction, [N m s/rad] and [N m]


def _structure(inertia: float) -> Model:
    terms = [
        term("stiffness", stiffness=1.0),
        term("viscous", coefficient=1e-3),
        term("asymmetry", coefficient=0.0),
        term("coulomb", force=1e-2),
        term("bias", force=0.0),
    ]
    return build_model("rigid", {"mass": inertia}, terms, units=Units("rad", "N m"))


def _release(pendulum: Pendulum, seed: int, number: int = 0) -> Record:
    """A recording of ``pendulum`` from a deflection of its own."""
    start = float(np.random.default_rng([seed, number, 1]).uniform(1.1, 2.0))
    return recorded(swing(pendulum, start), 10 * seed + number)


def free(
    method: str,
    seed: int,
    change: Change = as_it_is,
    heard: Listener = unheard,
) -> Finding:
    """One release of one of the four pendulums, fitted by ``method`` with the inertia held.

    Args:
        method: id of the method.
        seed: of the recording.
        change: made to the recording before it is fitted.
        heard: is given the result.
    """
    pendulum = list(PENDULUMS.values())[seed % len(PENDULUMS)]
    found = METHODS[method].fit(_structure(INERTIA), [change(_release(pendulum, seed))], Options())
    heard(found)
    spring = INERTIA * pendulum.frequency**2
    wet = 2.0 * INERTIA * pendulum.frequency
    truth = {
        "stiffness.stiffness": spring,
        "viscous.coefficient": wet * pendulum.damping,
        "asymmetry.coefficient": wet * pendulum.damping_difference,
        "coulomb.force": spring * pendulum.offset,
        "bias.force": spring * pendulum.offset_difference,
    }
    return of_model(found, truth)


def _under_gain(gain: float) -> Pendulum:
    """The one pendulum under a position feedback of ``gain`` [N m/rad]."""
    spring = _STIFFNESS + gain
    frequency = float(np.sqrt(spring / INERTIA))
    wet = 2.0 * INERTIA * frequency
    return Pendulum(
        frequency, _OWN["viscous"] / wet, _OWN["asymmetry"] / wet, _OWN["coulomb"] / spring, _OWN["constant"] / spring
    )


def parametric(seed: int, change: Change = as_it_is, heard: Listener = unheard) -> Finding:
    """Four releases under four position gains, fitted together; the inertia is free. See :func:`free`."""
    records = [change(_release(_under_gain(gain), seed, number)) for number, gain in enumerate(_GAINS)]
    options = Options(gains=tuple((gain, 0.0) for gain in _GAINS))
    found = METHODS["parametric-oscillation"].fit(_structure(0.5 * INERTIA), records, options)
    heard(found)
    truth = {
        "mass": INERTIA,
        "stiffness.stiffness": _STIFFNESS,
        "viscous.coefficient": _OWN["viscous"],
        "asymmetry.coefficient": _OWN["asymmetry"],
        "coulomb.force": _OWN["coulomb"],
        "bias.force": _OWN["constant"],
    }
    return of_model(found, truth)


def run(seeds: Sequence[int] = SEEDS) -> list[Figure]:
    """Coverage, bias and spread per method and parameter."""
    figures = []
    for method in CASES:
        figures += figures_of(method, *count(partial(free, method), seeds))
    return [*figures, *figures_of("parametric-oscillation", *count(parametric, seeds))]


BENCHMARK = Benchmark("calibration-oscillation", "coverage of the intervals of free-oscillation methods", run, long=True)
