"""Viscous friction that levels off with speed: its curves at both ends, and the speed at which a constant force ends."""

from __future__ import annotations

import math
from collections.abc import Callable

import fric
import numpy as np
import pytest
from fric.model import build_model, term
from fric.simulation import predict_force, simulate
from scipy.optimize import brentq

CURVES: dict[str, tuple[fric.Term, Callable[[float], float]]] = {
    "saturating": (term("shear_thinning", force=8.0, velocity=0.02), lambda v: 8.0 * (1.0 - math.exp(-v / 0.02))),
    "power": (term("shear_thinning", "power", force=120.0), lambda v: 120.0 * v ** (2.0 / 3.0)),
    "eyring": (term("shear_thinning", "eyring", force=3.0, velocity=0.004), lambda v: 3.0 * math.asinh(v / 0.004)),
}
LAWS = pytest.mark.parametrize("law", CURVES)


def along(law: fric.Term, velocity: float) -> float:
    model = build_model("rigid", {"mass": 1.0}, [law])
    v = np.array([velocity])
    return float(predict_force(model, np.zeros(1), np.zeros(1), v, np.zeros(1), 1e-3)[0])


@LAWS
@pytest.mark.parametrize("speed", [1e-5, 1e-3, 0.02, 0.3, 7.0])
def test_the_curve_is_the_same_both_ways(law: str, speed: float) -> None:
    made, curve = CURVES[law]
    assert along(made, speed) == pytest.approx(curve(speed), rel=1e-12)
    assert along(made, -speed) == -along(made, speed)


@LAWS
def test_nothing_at_rest(law: str) -> None:
    assert along(CURVES[law][0], 0.0) == 0.0


def test_it_begins_as_viscous_friction_and_ends_as_a_constant() -> None:
    made = CURVES["saturating"][0]
    assert along(made, 1e-6) == pytest.approx(8.0 / 0.02 * 1e-6, rel=1e-4)
    assert along(made, 5.0) == 8.0


@LAWS
def test_a_constant_force_ends_at_the_speed_that_balances_it(law: str) -> None:
    made, curve = CURVES[law]
    model = build_model("rigid", {"mass": 0.4}, [term("coulomb", force=2.0), term("viscous", coefficient=60.0), made])
    moved = simulate(model, np.full(4000, 14.0), 1e-3)
    speed = brentq(lambda v: 2.0 + 60.0 * v + curve(v) - 14.0, 1e-9, 1.0, xtol=1e-14)
    assert moved.velocity[-1] == pytest.approx(speed, rel=1e-6)
