"""An actuator whose gain repeats over position: against another integrator, at rest, and back from motion to force."""

from __future__ import annotations

import math

import fric
import numpy as np
import pytest
from fric.model import Model, build_model, term
from fric.simulation import predict_force, simulate
from scipy.integrate import solve_ivp

MASS, DRY, VISCOUS, H = 2.0, 1.5, 3.0, 1e-3
A, B, PERIOD = 0.25, -0.15, 0.05
GAIN = term("gain_ripple", cosine=A, sine=B, period=PERIOD)


def axis(*terms: fric.Term) -> Model:
    return build_model("rigid", {"mass": MASS}, [term("coulomb", force=DRY), term("viscous", coefficient=VISCOUS), *terms])


def gain(position: float) -> float:
    return 1.0 + A * math.cos(2.0 * math.pi * position / PERIOD) + B * math.sin(2.0 * math.pi * position / PERIOD)


def test_it_moves_as_another_integrator_says() -> None:
    moved = simulate(axis(GAIN), np.full(1001, 6.0), H)

    def rates(t: float, x: np.ndarray) -> tuple[float, float]:
        return x[1], (6.0 * gain(x[0]) - DRY - VISCOUS * x[1]) / MASS

    exact = solve_ivp(rates, (0.0, 1.0), (0.0, 0.0), rtol=1e-10, atol=1e-12)
    assert moved.position[1000] == pytest.approx(exact.y[0, -1], abs=1e-5)


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_it_holds_up_to_the_force_that_beats_dry_friction_there(share: float) -> None:
    moved = simulate(axis(GAIN), np.full(200, share * DRY / gain(0.01)), H, position=0.01)
    assert (moved.position[-1] != 0.01) == (share > 1.0)


def test_the_motion_needs_the_force_that_made_it() -> None:
    model = axis(GAIN)
    t = H * np.arange(4000)
    force = 9.0 * np.sin(2.0 * np.pi * 0.9 * t) + 4.0 * np.sin(2.0 * np.pi * 0.37 * t)
    moved = simulate(model, force, H)
    middle, rate = 0.5 * (moved.velocity[1:] + moved.velocity[:-1]), np.diff(moved.velocity) / H
    place = 0.5 * (moved.position[1:] + moved.position[:-1])
    needed = predict_force(model, t[:-1] + 0.5 * H, place, middle, rate, H)
    slides = (moved.velocity[1:] * moved.velocity[:-1] > 0.0) & (np.abs(middle) > 1e-3)
    assert np.count_nonzero(slides) > 3000
    # The place in the middle of a step is half of what its ends are apart off where the velocity changes.
    assert np.max(np.abs(needed - force[:-1])[slides]) < 2e-3
