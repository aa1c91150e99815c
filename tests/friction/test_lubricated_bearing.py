"""The lubricated bearing: the law typed a second time, break-away, and that it never drives."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.friction.lubricated_bearing import general, simple, transition_force
from fric.model import ModelError, build_model, term
from fric.simulation import Predictor, Simulator
from numpy.typing import NDArray

MU, TRANSITION, CURVATURE, VISCOUS, NOMINAL = 0.1, 187.9, 0.02, 2500.0, 1000.0
SPEEDS = np.array([-0.4, -0.03, -1e-3, 1e-6, 5e-3, 0.02, 0.2])


def friction(terms: tuple[object, ...], load: float) -> NDArray[np.float64]:
    model = build_model("rigid", {"mass": 1.0}, terms)  # type: ignore[arg-type]
    zero = np.zeros_like(SPEEDS)
    return Predictor(model).run(zero, zero, SPEEDS, zero, 1e-3, load=np.array([load]))[0]


@pytest.mark.parametrize("normal", [0.0, 300.0, 1000.0, 2700.0])
def test_the_law_while_sliding(normal: float) -> None:
    speed = np.abs(SPEEDS)
    of_simple = np.sign(SPEEDS) * (187.9 * np.exp(-speed / 0.02) + 2500.0 * speed)
    of_general = of_simple + np.sign(SPEEDS) * 0.1 * normal
    load = normal / NOMINAL
    np.testing.assert_allclose(friction(simple(TRANSITION, CURVATURE, VISCOUS), load), of_simple, rtol=1e-12)
    np.testing.assert_allclose(friction(general(MU, TRANSITION, CURVATURE, VISCOUS, NOMINAL), load), of_general, rtol=1e-12)


def test_it_falls_from_stiction_and_then_rises() -> None:
    model = build_model("rigid", {"mass": 1.0}, simple(TRANSITION, CURVATURE, VISCOUS))
    v = np.linspace(1e-9, 0.4, 4001)
    force = Predictor(model).run(0 * v, 0 * v, v, 0 * v, 1e-3)[0]
    lowest = v[np.argmin(force)]
    # Where the slopes of both parts cancel.
    assert lowest == pytest.approx(0.02 * math.log(187.9 / (0.02 * 2500.0)), abs=1e-4)
    assert force[0] == pytest.approx(187.9, rel=1e-6)
    assert np.min(force) < 0.65 * force[0]


def test_it_never_drives_the_body_whatever_the_load_does() -> None:
    random = np.random.default_rng(2)
    n = 5000
    model = build_model("rigid", {"mass": 240.0}, general(MU, TRANSITION, CURVATURE, VISCOUS, NOMINAL))
    push = 900.0 * np.repeat(random.uniform(-1, 1, n // 50), 50)
    load = np.abs(push) / NOMINAL + 0.5 * random.uniform(0, 1, n)
    states, force = Simulator(model).run(push, 1e-3, 1, load=load)
    v = np.concatenate([[0.0], states[:, 1]])
    slides = v[1:] * v[:-1] > 0
    assert np.mean(slides) > 0.3
    assert np.all((force * (v[1:] + v[:-1]))[slides] > 0.0)


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.5])
def test_break_away_comes_at_the_force_asked_for(mu: float) -> None:
    angle = math.radians(60.0)
    transition = transition_force(199.41, mu, angle)
    model = build_model("rigid", {"mass": 240.0}, general(mu, transition, CURVATURE, VISCOUS, NOMINAL))
    for share, moves in ((1.0 - 1e-9, False), (1.0 + 1e-9, True)):
        push = 199.41 * share
        load = push / math.tan(angle) / NOMINAL
        states, _ = Simulator(model).run(np.full(10, push), 1e-3, load=np.array([load]))
        assert bool(np.any(states[:, 0] != 0.0)) is moves


def test_a_bearing_that_locks_itself_is_refused() -> None:
    with pytest.raises(ModelError, match="locks itself"):
        transition_force(200.0, 1.8, math.radians(60.0))
    with pytest.raises(ModelError, match="locks itself"):
        transition_force(200.0, -0.1, math.radians(60.0))


def test_a_value_out_of_bounds_is_refused() -> None:
    with pytest.raises(ModelError, match="force"):
        general(-0.1, TRANSITION, CURVATURE, VISCOUS, NOMINAL)
    with pytest.raises(ModelError, match="velocity"):
        simple(TRANSITION, 0.0, VISCOUS)


def test_alone_it_is_coulomb_friction_scaled_by_the_load() -> None:
    of_load = friction((term("load_dependence", "proportional", force=100.0),), 1.7)
    scaled = friction((term("coulomb", force=100.0), term("load_dependence", coefficient=1.0)), 1.7)
    np.testing.assert_allclose(of_load, scaled, rtol=1e-14)
    np.testing.assert_allclose(of_load, 170.0 * np.sign(SPEEDS), rtol=1e-14)
