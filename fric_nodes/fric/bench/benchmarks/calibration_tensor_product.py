"""Coverage of the grid points' intervals of tensor-product friction from data, and how well the map predicts a slip.

The slips are those of :mod:`..verification.pneumatic_reference`: a cylinder on friction with memory, integrated by Radau's
method, with the noise of its sensors. Each slip has friction of its own by one per cent. The truth at a grid point is the
friction of the noiseless slip at that speed, on the branch where the piston speeds up, or slows down.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from ...figure import Figure
from ...identification import METHODS
from ...identification.methods.tensor_product import TensorProductIdentification
from ...identification.result import Options
from ...identification.start import start_model
from ...model import build_model, term
from ...record import Array, Record, Units
from ...simulation import simulate
from ...verification import pneumatic_reference as reference
from ..benchmark import Benchmark
from ..trials import SEEDS, Change, Finding, Listener, as_it_is, count, figures_of, over_interval, unheard

__all__ = ["BENCHMARK", "identified", "ratio", "trial"]

_STEP, _COMMAND, _REST = 2e-4, 0.0208, 0.025
_SLIPS = 10
_SPEEDS = (0.002, 0.005, 0.01, 0.02, 0.028)  # [m/s]
_OWN = 0.01
_EXPERIMENTS = 20


@lru_cache(maxsize=1)
def _truth() -> reference.Slip:
    return reference.stick_slip(0.02, _COMMAND, _STEP, _REST)


def _record(slip: reference.Slip) -> Record:
    way = np.concatenate([[0.0], np.cumsum(0.5 * _STEP * (slip.velocity[1:] + slip.velocity[:-1]))])
    extra = {"acceleration": slip.acceleration}
    return Record(slip.time, way, slip.force, extra=extra, effort_hold="linear", source="slip")


def _recordings(seed: int, own: float) -> list[reference.Slip]:
    random = np.random.default_rng(seed)
    truth = _truth()
    found = []
    for _ in range(_SLIPS):
        share = own * random.standard_normal()
        found.append(replace(truth, force=truth.force + share * truth.friction).recorded(random))
    return found


def identified(slips: Sequence[reference.Slip], change: Change = as_it_is) -> TensorProductIdentification:
    """Tensor-product friction from ``slips``, each recording changed before."""
    structure = start_model(["coulomb"], "axis", Units()).with_value("mass", reference.MASS)
    found = METHODS["tensor-product"].fit(structure, [change(_record(slip)) for slip in slips], Options())
    assert isinstance(found, TensorProductIdentification)
    return found


def trial(seed: int, change: Change = as_it_is, heard: Listener = unheard) -> Finding:
    """The grid point nearest to each of some speeds, on either branch.

    Args:
        seed: of friction and noise.
        change: made to each recording before it is fitted.
        heard: is given the result.
    """
    truth = _truth()
    top = int(np.argmax(truth.velocity))
    moving = truth.velocity > 0.0
    found = identified(_recordings(seed, _OWN), change)
    heard(found)
    result = {}
    for up, name in ((True, "speeding up"), (False, "slowing down")):
        part = moving & ((np.arange(moving.shape[0]) <= top) == up)
        order = np.argsort(truth.velocity[part])
        speed, friction = truth.velocity[part][order], truth.friction[part][order]
        branch = next((each for each in found.branches if each.speeding_up in (up, None)), found.branches[0])
        for wanted in _SPEEDS:
            k = int(np.argmin(np.abs(branch.speed - wanted)))
            level = float(np.interp(branch.speed[k], speed, friction))
            half = float(branch.half_width(0.9)[k])
            label = f"{name} at {1e3 * wanted:g} mm/s"
            result[label] = over_interval(float(branch.force[k]), level, half if math.isfinite(half) else math.nan)
    return result


def _off(velocity: Array, slip: reference.Slip) -> float:
    """Root mean square deviation of the acceleration [m/s^2]."""
    return float(np.sqrt(np.mean((np.gradient(velocity, _STEP) - slip.acceleration) ** 2)))


def ratio(seed: int) -> tuple[float, float]:
    """Deviation of the acceleration with Szell's Model A over that with the map, and over that with the law through it."""
    slips = _recordings(seed, 0.0)
    f_c, surplus = reference.FRICTION["F_C"], reference.FRICTION["F_S"] - reference.FRICTION["F_C"]
    terms = [
        term("coulomb", force=f_c),
        term("viscous", coefficient=reference.FRICTION["F_v"]),
        term("stribeck", "hess_soom", force=surplus, velocity=reference.FRICTION["v_s"]),
    ]
    plain = build_model("rigid", {"mass": reference.MASS}, terms)
    found = identified(slips)
    assert found.law is not None
    off = np.array(
        [
            (
                _off(simulate(plain, slip.force, _STEP, hold="linear").velocity, slip),
                _off(found.law.simulate(slip.force, _STEP, hold="linear").velocity, slip),
                _off(simulate(found.model, slip.force, _STEP, hold="linear").velocity, slip),
            )
            for slip in slips
        ]
    )
    a, d, law = np.sqrt(np.mean(off**2, axis=0)).tolist()
    return a / d, a / law


def run(seeds: Sequence[int] = SEEDS) -> list[Figure]:
    """Coverage, bias and spread at grid points; ratios of deviations."""
    ratios = np.array([ratio(seed) for seed in range(1, _EXPERIMENTS + 1)])
    title = "acceleration: RMSD of Model A over"
    return [
        Figure(f"{title} the map's, median of {_EXPERIMENTS} experiments", float(np.median(ratios[:, 0])), "1", ">= 8"),
        Figure(f"{title} the map's, least favourable", float(np.min(ratios[:, 0])), "1"),
        Figure(f"{title} the law's through the map, median", float(np.median(ratios[:, 1])), "1"),
        *figures_of("tensor-product", *count(trial, seeds)),
    ]


BENCHMARK = Benchmark(
    "calibration-tensor-product", "tensor-product friction from data: intervals and prediction", run, long=True
)
