"""What a diagnosis relies on: at its neutral values an effect does nothing, and a switch that is off leaves it out."""

from __future__ import annotations

import time

import numpy as np
import pytest
from fric.diagnosis.universe import common_effects, universe_of
from fric.effect import Effect
from fric.effects import EFFECTS
from fric.model import Model, Term, build_model, term
from fric.record import Array
from fric.simulation import Simulator, simulate

H = 1e-3
ABLE = common_effects()
OTHERS = [each for each in EFFECTS.values() if each.neutral is not None and each not in ABLE and each.id != "stribeck"]


def force() -> Array:
    t = H * np.arange(1500)
    return np.asarray(18.0 * np.sin(2 * np.pi * 1.3 * t) + 6.0 * np.sin(2 * np.pi * 7.1 * t + 1.0))


def base() -> Model:
    return build_model("rigid", {"mass": 2.0}, [term("coulomb", force=5.0), term("viscous", coefficient=20.0)])


def run(values: Array) -> Array:
    """Positions of the base model's universe with these values."""
    universe = universe_of(base())
    effort = force()
    states = np.ascontiguousarray(universe.plant.start(values[:1], 0.0, 0.0))
    found, friction, applied = np.empty((effort.shape[0], 2)), np.empty(effort.shape[0]), np.empty(effort.shape[0])
    universe.loops.simulate(
        values, effort, H, 4, 0.0, np.ones(1), np.zeros(1), states, *universe.inner_states(base()), found, friction, applied
    )
    return found[:, 0]


@pytest.mark.parametrize("effect", ABLE, ids=[effect.key for effect in ABLE])
def test_neutral_values_leave_the_motion_as_it_was(effect: Effect) -> None:
    universe = universe_of(base())
    values = universe.values(base())
    expected = run(values)
    assert effect.neutral is not None
    universe.put(values, Term(effect, effect.neutral))
    if effect.id in {"coulomb", "viscous"}:
        assert np.max(np.abs(run(values) - expected)) > 1e-3  # there it takes the base model's own friction away
        return
    assert np.max(np.abs(run(values) - expected)) <= 1e-9 * np.ptp(expected)


@pytest.mark.parametrize("effect", OTHERS, ids=[effect.key for effect in OTHERS])
def test_neutral_values_of_other_laws_leave_the_motion_as_it_was(effect: Effect) -> None:
    held = base().with_terms((*base().terms, term("stribeck", force=2.0, velocity=0.05)))  # for what only lags
    assert effect.neutral is not None
    expected = simulate(held, force(), H).position
    found = simulate(held.with_terms((*held.terms, Term(effect, effect.neutral))), force(), H).position
    steps = 1e-5 if effect.rate is not None else 1e-9  # a lag asks for steps of its own
    assert np.max(np.abs(found - expected)) <= steps * np.ptp(expected)


def test_an_effect_with_an_amplitude_is_not_always_neutral() -> None:
    strong = base().with_terms((*base().terms, term("bias", force=4.0)))
    assert abs(simulate(strong, force(), H).position[-1] - simulate(base(), force(), H).position[-1]) > 1e-3


@pytest.mark.parametrize(
    "more",
    [
        (),
        (term("stribeck", force=2.0, velocity=0.03),),
        (term("presliding", stiffness=1e5, damping=200.0), term("ripple", cosine=1.0, sine=0.5, period=0.02)),
        (term("backlash", gap=1e-4), term("actuator_lag", time=2e-3)),
    ],
    ids=["plain", "level", "slip and force", "transmission and command"],
)
def test_the_universe_moves_as_the_model_does(more: tuple[Term, ...]) -> None:
    """The same model, once compiled alone and once among all candidates that are switched off."""
    model = base().with_terms((*base().terms, *more))
    effort = force()
    alone = Simulator(model)
    expected, _ = alone.run(effort, H, 4)
    universe = universe_of(model)
    states = np.ascontiguousarray(universe.plant.start(np.array(model.plant_values), 0.0, 0.0))
    found, friction, applied = np.empty_like(expected), np.empty(effort.shape[0]), np.empty(effort.shape[0])
    universe.loops.simulate(
        universe.values(model), effort, H, 4, 0.0, np.ones(1), np.zeros(1), states, *universe.inner_states(model), found,
        friction, applied,
    )  # fmt: skip
    assert np.max(np.abs(found - expected)) <= 1e-9 * np.max(np.abs(expected))


def test_what_is_absent_costs_little_time() -> None:
    """The compiler would rather evaluate the exponentials of all effects than look whether they are there."""
    model, effort = base(), np.tile(force(), 10)
    universe = universe_of(model)
    absent, present = universe.values(model), universe.values(model)
    for effect in ABLE:
        assert effect.neutral is not None
        universe.put(present, Term(effect, tuple(0.5 if value == 0.0 or value > 1e6 else value for value in effect.neutral)))
    found, friction, applied = np.empty((effort.shape[0], 2)), np.empty(effort.shape[0]), np.empty(effort.shape[0])
    times: dict[str, list[float]] = {"absent": [], "present": []}
    for _ in range(12):  # by turns, so that other work on the machine slows both
        for which, values in (("absent", absent), ("present", present)):
            states = np.ascontiguousarray(universe.plant.start(values[:1], 0.0, 0.0))
            inner = universe.inner_states(model)
            began = time.perf_counter()
            universe.loops.simulate(
                values, effort, H, 1, 0.0, np.ones(1), np.zeros(1), states, *inner, found, friction, applied
            )  # fmt: skip
            times[which].append(time.perf_counter() - began)
    assert min(times["absent"]) < min(times["present"]) / 2.0
