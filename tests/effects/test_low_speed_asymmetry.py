"""Friction whose rise at low speed differs by direction, against each direction's own Stribeck curve."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.effect import Context
from fric.effects import EFFECTS, by_name
from fric.model import Model, build_model, term
from fric.model_file import model_from_text
from fric.simulation import Simulator, predict_force
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
# Of each direction by itself: Coulomb level [N], static level [N], viscous coefficient [N s/m]. The Stribeck velocity [m/s].
FORWARD, BACKWARD, V_S = (4.5, 8.0, 13.0), (3.5, 4.0, 9.0), 0.02


def curve(v: float, way: float) -> float:
    """Force [N] of the curve of the direction ``way``, 1 or -1, which goes on smoothly beyond rest."""
    coulomb, static, viscous = FORWARD if way > 0.0 else BACKWARD
    return way * (coulomb + (static - coulomb) * math.exp(-((v / V_S) ** 2))) + viscous * v


def axis(law: str = "low_speed") -> Model:
    """Mean and half difference of both directions as terms, that at low speed by ``asymmetry`` or by ``stribeck``."""
    mean, half = (0.5 * (np.array(FORWARD) + sign * np.array(BACKWARD)) for sign in (1.0, -1.0))
    surplus, difference = mean[1] - mean[0], half[1] - half[0]
    low_speed = {
        "low_speed": [
            term("stribeck", force=surplus, velocity=V_S),
            term("asymmetry", "low_speed", force=half[0], coefficient=half[2], low_speed=difference, velocity=V_S),
        ],
        "directional": [
            term("stribeck", "directional", force=surplus, difference=difference, velocity=V_S),
            term("asymmetry", force=half[0], coefficient=half[2]),
        ],
    }
    always = [term("coulomb", force=mean[0]), term("viscous", coefficient=mean[2])]
    return build_model("rigid", {"mass": 2.0}, [*always, *low_speed[law]])


LAWS = pytest.mark.parametrize("law", ["low_speed", "directional"])


@LAWS
def test_each_direction_has_its_own_curve(law: str) -> None:
    v = np.array([-0.5, -0.02, -0.005, -1e-6, 1e-6, 0.003, 0.02, 0.7])
    zero = np.zeros_like(v)
    assert predict_force(axis(law), zero, zero, v, zero, 1e-3) == pytest.approx(
        [curve(each, math.copysign(1.0, each)) for each in v], rel=1e-12
    )


@pytest.mark.parametrize("exponent", [0.7, 1.0, 2.0])
def test_the_half_difference_falls_as_it_says(exponent: float) -> None:
    def level(v: float) -> float:
        c = Context(0.0, v, math.copysign(1.0, v), 0.0, 1.0, 0.0, 0.0, 0.0, np.zeros(0), 0.0)
        return EFFECTS["asymmetry/low_speed"].level(c, 0.0, 0.5, 3.0, 2.0, 0.01, exponent)  # type: ignore[misc]

    assert level(1e-300) == pytest.approx(2.5)
    assert level(0.01) == pytest.approx(0.5 + 2.0 / math.e)
    assert level(-0.01) == -level(0.01)
    assert level(10.0) == pytest.approx(0.5)


@LAWS
def test_it_breaks_away_at_the_static_level_of_each_direction(law: str) -> None:
    for static, sign in ((FORWARD[1], 1.0), (BACKWARD[1], -1.0)):
        held, _ = Simulator(axis(law)).run(np.full(100, sign * (static - 1e-9)), 1e-3)
        assert np.all(held == 0.0)
        moved, _ = Simulator(axis(law)).run(np.full(100, sign * (static + 1e-3)), 1e-3)
        assert moved[-1, 0] * sign > 0.0


@LAWS
@pytest.mark.parametrize(("start", "push"), [(0.08, 2.0), (-0.08, -2.0), (0.05, -3.0)])
def test_it_comes_to_rest_where_and_when_the_equation_says(law: str, start: float, push: float) -> None:
    def rate(_: float, y: Array) -> list[float]:
        return [y[1], (push - curve(y[1], math.copysign(1.0, start))) / 2.0]

    def rests(_: float, y: Array) -> float:
        return float(y[1])

    rests.terminal = True  # type: ignore[attr-defined]
    exact = solve_ivp(rate, (0.0, 2.0), [0.0, start], "DOP853", events=rests, rtol=1e-11, atol=1e-14)
    (when,), ((where, _),) = exact.t_events[0], exact.y_events[0]
    h = 1e-4
    states, _ = Simulator(axis(law), velocity=start).run(np.full(math.ceil(when / h) + 50, push), h)
    assert h * (1 + int(np.argmax(states[:, 1] == 0.0))) == pytest.approx(when, abs=2.0 * h)
    assert states[-1, 1] == 0.0
    assert states[-1, 0] == pytest.approx(where, abs=1e-7)


def test_a_file_without_a_law_means_the_one_that_it_meant() -> None:
    text = "format: fric-model/1\njoint: axis\nunits: {position: m, force: N}\nplant: {type: rigid, mass: 1.0}\nterms:\n"
    model = model_from_text(text + "  - {effect: asymmetry, force: 0.8, coefficient: 2.0}\n")
    assert model.terms[0].effect is by_name("asymmetry", "linear")
    assert model.terms[0].values == (0.8, 2.0)
    more = text + "  - {effect: asymmetry, law: low_speed, low_speed: 0.5, velocity: 0.01}\n"
    assert model_from_text(more).terms[0].values == (0.0, 0.0, 0.5, 0.01, 2.0)
