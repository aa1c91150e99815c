"""Effects that scale the level of the others: by load, place, time and temperature; and the order in which they do it."""

from __future__ import annotations

import numpy as np
import pytest
from fric.effect import Context
from fric.effects import EFFECTS
from fric.model import build_model, term
from fric.simulation import Simulator, predict_force


def scaled(key: str, *p: float, q: float = 0.0, t: float = 0.0, load: float = 1.0, temperature: float = 0.0) -> float:
    c = Context(q, 0.1, 1.0, t, load, temperature, 0.0, 0.0, np.zeros(0), 0.0)
    return EFFECTS[key].level(c, 3.0, *p)  # type: ignore[misc]


def test_scales_typed_a_second_time() -> None:
    assert scaled("load_dependence/scaling", 1.0, load=0.4) == pytest.approx(1.2)
    assert scaled("load_dependence/scaling", 0.5, load=3.0) == pytest.approx(6.0)
    for q in (-0.3, 0.01, 0.2):
        assert scaled("position_dependence/periodic", 0.2, -0.1, 0.05, q=q) == pytest.approx(
            3.0 + 0.6 * np.cos(40 * np.pi * q) - 0.3 * np.sin(40 * np.pi * q)
        )
        assert scaled("position_dependence/local", 0.5, 0.1, 0.02, q=q) == pytest.approx(
            3.0 + 1.5 * np.exp(-1250.0 * (q - 0.1) ** 2)
        )
    assert scaled("position_dependence/local", -1.0, 0.1, 0.02, q=0.1) == 0.0
    assert scaled("position_dependence/local", 0.5, 0.1, 0.02, q=0.12) == pytest.approx(3.0 + 1.5 * 0.6065306597126334)
    assert scaled("time_drift/linear", -0.01, t=20.0) == pytest.approx(2.4)
    assert scaled("time_drift/exponential", -0.4, 30.0, t=0.0) == 3.0
    assert scaled("time_drift/exponential", -0.4, 30.0, t=30.0) == pytest.approx(3.0 * (1.0 - 0.4 * 0.6321205588285577))
    assert scaled("time_drift/exponential", -0.4, 30.0, t=1e6) == pytest.approx(1.8)
    assert scaled("temperature/linear", -0.01, 0.3, temperature=20.0) == pytest.approx(2.4)
    c = Context(0.0, -0.5, -1.0, 0.0, 1.0, 20.0, 0.0, 0.0, np.zeros(0), 0.0)
    assert EFFECTS["temperature/linear"].force(c, -0.01, -0.3) == pytest.approx(3.0)  # type: ignore[misc]


def test_scales_of_other_forms() -> None:
    assert scaled("load_dependence/power", 2.0 / 3.0, load=8.0) == pytest.approx(12.0)
    assert scaled("load_dependence/power", 1.4, load=1.0) == 3.0
    assert scaled("load_dependence/power", 0.5, load=-1.0) == 0.0
    # The bent law is the expansion of an exponential change, whose third order is what is left.
    for warmer in (-10.0, 4.0, 20.0):
        left = scaled("temperature/quadratic", -0.02, 0.0, 2e-4, 0.0, temperature=warmer) - 3.0 * np.exp(-0.02 * warmer)
        assert left == pytest.approx(3.0 * (0.02 * warmer) ** 3 / 6.0, rel=0.12)
    c = Context(0.0, -0.5, -1.0, 0.0, 1.0, 20.0, 0.0, 0.0, np.zeros(0), 0.0)
    assert EFFECTS["temperature/quadratic"].force(c, -0.01, -0.3, 0.0, 0.01) == pytest.approx(1.0)  # type: ignore[misc]
    # A Lorentz curve, and nearly a bell; both are bent alike at the top.
    assert scaled("position_dependence/peak", 0.5, 0.1, 0.02, 1.0, q=0.1) == 4.5
    assert scaled("position_dependence/peak", 0.5, 0.1, 0.02, 1.0, q=0.1 + 0.02 * np.sqrt(2.0)) == pytest.approx(3.75)
    bell = scaled("position_dependence/local", 0.5, 0.1, 0.02, q=0.11)
    assert scaled("position_dependence/peak", 0.5, 0.1, 0.02, 20.0, q=0.11) == pytest.approx(bell, rel=1e-3)
    assert scaled("position_dependence/peak", 0.5, 0.1, 0.02, 1.0, q=0.101) == pytest.approx(
        4.5 - 0.5 * 1.5 * 0.05**2, abs=1e-5
    )


def test_what_depends_on_direction_is_scaled_too() -> None:
    """Whatever the order in the model file: add up, then tell directions apart, then scale."""
    terms = [term("load_dependence", coefficient=1.0), term("asymmetry", force=1.0), term("coulomb", force=4.0)]
    model = build_model("rigid", {"mass": 1.0}, terms)
    assert [held.effect.id for held in model.terms] == ["coulomb", "asymmetry", "load_dependence"]
    v = np.array([0.1, -0.1])
    zero = np.zeros(2)
    assert predict_force(model, zero, zero, v, zero, 1e-3, load=np.array([2.0])) == pytest.approx([10.0, -6.0])


def test_several_scales_multiply() -> None:
    terms = [
        term("coulomb", force=4.0),
        term("load_dependence", coefficient=0.5),
        term("temperature", level_change=-0.01),
        term("position_dependence", "periodic", cosine=0.1, period=0.02),
        term("position_dependence", "periodic", sine=0.2, period=0.008),
        term("position_dependence", "local", amplitude=1.0, position=0.0, width=0.01),
        term("time_drift", "linear", rate=0.05),
    ]
    model = build_model("rigid", {"mass": 1.0}, terms)
    q, t = np.array([0.002]), np.array([4.0])
    expected = 4.0 * 1.5 * 0.9 * (1 + 0.1 * np.cos(0.2 * np.pi)) * 1.2 * (1 + np.exp(-0.02)) * 1.2
    found = predict_force(model, t, q, np.array([0.1]), np.zeros(1), 1e-3, load=np.array([2.0]), temperature=np.array([10.0]))
    assert found == pytest.approx([expected], rel=1e-12)


def test_break_away_follows_the_load_of_each_interval() -> None:
    model = build_model("rigid", {"mass": 1.0}, [term("coulomb", force=4.0), term("load_dependence", coefficient=1.0)])
    load = np.array([2.0, 1.5, 1.01, 0.99])
    states, friction = Simulator(model).run(np.full(4, 4.0), 1e-3, 1, load=load)
    assert np.all(states[:3, 1] == 0.0)
    assert np.all(friction[:3] == 4.0)
    assert states[3, 1] == pytest.approx(0.04e-3, rel=1e-6)


def test_a_level_that_a_scale_would_take_below_zero_is_zero() -> None:
    model = build_model("rigid", {"mass": 1.0}, [term("coulomb", force=4.0), term("time_drift", "linear", rate=-1.0)])
    simulator = Simulator(model, velocity=0.1)
    simulator.time = 5.0
    states, friction = simulator.run(np.zeros(10), 1e-3)
    assert np.all(friction == 0.0)
    assert np.all(states[:, 1] == 0.1)
