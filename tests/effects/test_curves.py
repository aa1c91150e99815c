"""Steady curves and forces over position, each typed here a second time; positive opposes positive motion."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from fric.effect import Context
from fric.effects import EFFECTS
from fric.model import Term, build_model, term
from fric.simulation import Simulator, predict_force
from scipy.integrate import quad, solve_ivp

SPEEDS = [-2.0, -0.01, 1e-9, 0.003, 0.7]


def context(velocity: float = 0.0, position: float = 0.0, step: float = 0.0) -> Context:
    return Context(position, velocity, math.copysign(1.0, velocity), 0.0, 1.0, 0.0, 0.0, step, np.zeros(0), 0.0)


def level(key: str) -> Callable[..., float]:
    return lambda v, *p: EFFECTS[key].level(context(v), 0.0, *p)  # type: ignore[misc]


def force(key: str) -> Callable[..., float]:
    return lambda v, *p: EFFECTS[key].force(context(v), *p)  # type: ignore[misc]


@pytest.mark.parametrize("v", SPEEDS)
def test_curves_over_velocity(v: float) -> None:
    s = -1.0 if v < 0 else 1.0
    assert level("coulomb")(v, 4.0) == 4.0
    assert force("viscous")(v, 10.0) == pytest.approx(10.0 * v)
    assert force("quadratic_drag/quadratic")(v, 3.0) == pytest.approx(3.0 * v**2 * s)
    assert force("quadratic_drag/power")(v, 3.0, 1.75) == pytest.approx(3.0 * v**2 / abs(v) ** 0.25 * s if v else 0.0)
    assert force("quadratic_drag/power")(s, 3.0, 2.6) == pytest.approx(3.0 * s)  # at 1 x/s whatever the exponent is
    assert force("bias")(v, -3.0) == -3.0
    assert level("asymmetry/linear")(v, 0.5, 3.0) == 0.5 * s
    assert force("asymmetry/linear")(v, 0.5, 3.0) == pytest.approx(3.0 * abs(v))
    assert level("stribeck/static")(v, 2.0) == 0.0
    assert level("stribeck/hess_soom")(v, 2.0, 0.01) == pytest.approx(2.0 / (1.0 + (v / 0.01) ** 2), rel=1e-12)
    for delta in (0.5, 1.0, 2.0, 3.7):
        assert level("stribeck/exponential")(v, 2.0, 0.01, delta) == pytest.approx(
            2.0 * np.exp(-((abs(v) / 0.01) ** delta)), rel=1e-12, abs=1e-30
        )


def test_landmarks_of_the_stribeck_curves() -> None:
    exponential = level("stribeck/exponential")
    assert exponential(0.0, 2.0, 0.01, 2.0) == 2.0
    assert exponential(0.01, 2.0, 0.01, 2.0) == pytest.approx(2.0 * 0.36787944117144233)
    assert exponential(0.01, 2.0, 0.01, 0.7) == pytest.approx(2.0 * 0.36787944117144233)
    assert exponential(1e6, 2.0, 0.01, 2.0) == 0.0
    hess_soom = level("stribeck/hess_soom")
    assert hess_soom(0.0, 2.0, 0.01) == 2.0
    assert hess_soom(0.01, 2.0, 0.01) == pytest.approx(1.0)
    assert hess_soom(-0.1, 2.0, 0.01) == pytest.approx(2.0 / 101.0)
    static = level("stribeck/static")
    assert static(0.0, 2.0) == 2.0
    assert static(1e-300, 2.0) == 0.0


def test_szell_model_a_as_a_whole() -> None:
    """Eq. 11 with the parameters of Model A, at a few velocities, worked out by hand."""
    model = build_model(
        "rigid",
        {"mass": 1.0},
        [
            term("coulomb", force=2.447),
            term("stribeck", "hess_soom", force=3.7 - 2.447, velocity=0.019),
            term("viscous", coefficient=15.0),
        ],
    )
    v = np.array([0.019, -0.038, 0.05])
    expected = [2.447 + 0.6265 + 0.285, -(2.447 + 1.253 / 5.0 + 0.57), 2.447 + 1.253 / (1.0 + (50.0 / 19.0) ** 2) + 0.75]
    zero = np.zeros(3)
    assert predict_force(model, zero, zero, v, zero, 1e-3) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("q", [-0.7, 0.0, 0.013, 2.0])
def test_forces_over_position(q: float) -> None:
    c = context(0.3, q)
    assert EFFECTS["stiffness"].force(c, 5.0, 0.1) == pytest.approx(5.0 * (q - 0.1))  # type: ignore[misc]
    assert EFFECTS["nonlinear_stiffness"].force(c, 5.0, 0.1) == pytest.approx(5.0 * (q - 0.1) ** 3)  # type: ignore[misc]
    wave = 0.4 * math.cos(2.0 * math.pi * q / 0.032) - 0.7 * math.sin(2.0 * math.pi * q / 0.032)
    assert EFFECTS["ripple"].force(c, 0.4, -0.7, 0.032) == pytest.approx(wave, rel=1e-9)  # type: ignore[misc]


@pytest.mark.parametrize("step", [1e-4, 0.01, 0.1, 1.0])
@pytest.mark.parametrize(
    ("key", "p"), [("nonlinear_stiffness", (5.0, 0.02)), ("ripple", (0.4, -0.7, 0.032)), ("stiffness", (5.0, 0.02))]
)
def test_over_a_step_they_give_the_mean_along_the_way(key: str, p: tuple[float, ...], step: float) -> None:
    effect = EFFECTS[key]
    v, q = 0.3, 0.05
    assert effect.force is not None
    along = quad(
        lambda t: effect.force(context(v, q + v * t), *p), -0.5 * step, 0.5 * step, epsabs=1e-13, epsrel=1e-12, limit=500
    )  # type: ignore[misc]
    assert effect.force(context(v, q, step), *p) == pytest.approx(along[0] / step, rel=1e-8, abs=1e-11)


@pytest.mark.parametrize(
    ("terms", "energy"),
    [
        ([term("nonlinear_stiffness", stiffness=5e4)], lambda q: 5e4 * q**4 / 4.0),
        ([term("stiffness", stiffness=400.0, position=-0.05)], lambda q: 200.0 * (q + 0.05) ** 2),
        (
            [term("ripple", cosine=2.0, sine=-1.0, period=0.01)],
            lambda q: 0.01 / (2 * np.pi) * (2.0 * np.sin(2 * np.pi * q / 0.01) + np.cos(2 * np.pi * q / 0.01)),
        ),
    ],
    ids=["hardening", "linear", "ripple"],
)  # fmt: skip
def test_what_depends_on_position_alone_keeps_the_energy(terms: list[Term], energy: Callable[[np.ndarray], np.ndarray]) -> None:
    simulator = Simulator(build_model("rigid", {"mass": 0.5}, terms), position=0.02, velocity=0.6)
    start = 0.25 * 0.6**2 + energy(np.array(0.02))
    states, _ = simulator.run(np.zeros(5000), 2e-3, 1)  # long steps on purpose: a fifth of the ripple's passage each
    total = 0.25 * states[:, 1] ** 2 + energy(states[:, 0])
    # The solver stops where its error is far below that of the rule, not at the last bit.
    assert np.max(np.abs(total - start)) < 1e-4 * (np.max(total) - np.min(energy(states[:, 0])))
    assert np.ptp(states[:, 1]) > 0.02


def test_a_hardening_spring_swings_as_the_equation_says() -> None:
    model = build_model(
        "rigid", {"mass": 0.5}, [term("nonlinear_stiffness", stiffness=5e4), term("quadratic_drag", coefficient=2.0)]
    )
    t = np.arange(1, 1001) * 1e-3
    expected = solve_ivp(
        lambda _, y: [y[1], -(5e4 * y[0] ** 3 + 2.0 * y[1] * abs(y[1])) / 0.5],
        (0.0, 1.0),
        [0.0, 1.0],
        "DOP853",
        t,
        rtol=1e-11,
        atol=1e-13,
    )
    states, _ = Simulator(model, velocity=1.0).run(np.zeros(1000), 1e-3, 8)
    assert np.max(np.abs(states[:, 0] - expected.y[0])) < 1e-3 * np.ptp(expected.y[0])


def test_static_friction_lets_go_at_its_level_and_holds_no_longer() -> None:
    model = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=4.0), term("stribeck", "static", force=1.5)])
    simulator = Simulator(model)
    states, friction = simulator.run(np.full(100, 5.5), 1e-3)
    assert np.all(states == 0.0)
    assert np.all(friction == 5.5)
    states, friction = simulator.run(np.full(100, 5.5000001), 1e-3)
    assert friction[1:] == pytest.approx(4.0, rel=1e-9)
    assert states[-1, 1] == pytest.approx(0.1 * 1.5 / 2.0, rel=1e-6)
    # Back to rest, and held again up to the static level.
    states, _ = simulator.run(np.full(300, 0.0), 1e-3)
    assert states[-1, 1] == 0.0
    states, friction = simulator.run(np.full(10, -5.4), 1e-3)
    assert np.all(states[:, 1] == 0.0)
    assert np.all(friction == -5.4)
