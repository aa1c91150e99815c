"""Models that go to another process come back with the catalogue's own plants and effects, which are told apart by identity."""

from __future__ import annotations

import pickle

import pytest
from fric.effects import EFFECTS
from fric.model import build_model, term
from fric.plants import PLANTS


@pytest.mark.parametrize("key", EFFECTS)
def test_an_effect_is_the_same_one(key: str) -> None:
    assert pickle.loads(pickle.dumps(EFFECTS[key])) is EFFECTS[key]


@pytest.mark.parametrize("plant", PLANTS)
def test_a_plant_is_the_same_one_with_and_without_a_transmission(plant: str) -> None:
    for each in (PLANTS[plant], PLANTS[plant].driven, PLANTS[plant].behind):
        assert pickle.loads(pickle.dumps(each)) is each


def test_a_model_keeps_its_values() -> None:
    terms = [
        term("coulomb", force=3.0),
        term("compliance", stiffness=1e5, damping=2.0),
        term("stribeck", force=1.0, velocity=0.01),
    ]
    model = build_model("rigid", {"mass": 2.0}, terms)
    again = pickle.loads(pickle.dumps(model))
    assert again.plant is model.plant
    assert again.names == model.names
    assert again.values.tolist() == model.values.tolist()
