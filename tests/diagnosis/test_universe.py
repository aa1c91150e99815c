"""One structure for many models: several terms of one effect each have a place of their own."""

from __future__ import annotations

import numpy as np
import pytest
from fric.diagnosis.universe import universe_of
from fric.model import Model, build_model, term
from fric.simulation import predict_force

RIPPLES = [term("ripple", cosine=1.0 + k, sine=0.5 * k, period=0.03 / (1 + k)) for k in range(4)]
SPOTS = [term("position_dependence", "local", amplitude=0.3, position=0.05 * k, width=0.01) for k in range(2)]


def models() -> dict[str, Model]:
    plain = [term("coulomb", force=5.0), term("viscous", coefficient=3.0)]
    made = {f"{n} ripples": build_model("rigid", {"mass": 2.0}, [*plain, *RIPPLES[:n]]) for n in (1, 2, 3)}
    return {**made, "two spots": build_model("rigid", {"mass": 2.0}, [*plain, *SPOTS])}


@pytest.mark.parametrize("name", ["1 ripples", "2 ripples", pytest.param("3 ripples", marks=pytest.mark.long), "two spots"])
def test_every_term_acts(name: str) -> None:
    model = models()[name]
    n, h = 400, 1e-3
    t = h * np.arange(n)
    q, v, a = 0.1 * np.sin(9.0 * t), 0.9 * np.cos(9.0 * t), -8.1 * np.sin(9.0 * t)
    universe = universe_of(model)
    needed, friction = np.empty(n), np.empty(n)
    states = universe.inner_states(model, float(v[0]))
    one, none = np.ones(1), np.zeros(1)
    universe.loops.predict(universe.values(model), t, q, v, a, h, one, none, *states, needed, friction)
    assert needed == pytest.approx(predict_force(model, t, q, v, a, h), rel=1e-9)


def test_a_transmission_has_no_place_that_no_term_takes() -> None:
    links = [term("compliance", stiffness=stiffness, damping=1.0) for stiffness in (1e4, 2e4)]
    model = build_model("rigid", {"mass": 2.0, "load_share": 0.5}, links)
    assert len(universe_of(model).places["compliance/linear"]) == len(links)


def test_one_more_fits_beside_those_that_are_there() -> None:
    model = models()["1 ripples"]
    universe = universe_of(model)
    values = universe.values(model)
    universe.put(values, RIPPLES[1])
    places = universe.places["ripple"]
    assert [values[at] for _, at in places] == [1.0, 2.0]
