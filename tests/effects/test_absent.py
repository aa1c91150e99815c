"""What a diagnosis relies on: at its neutral values an effect does nothing."""

from __future__ import annotations

import numpy as np
import pytest
from fric.effect import Effect
from fric.effects import EFFECTS
from fric.model import Model, Term, build_model, term
from fric.record import Array

H = 1e-3
ABLE = [each for each in EFFECTS.values() if each.neutral is not None]


def force() -> Array:
    t = H * np.arange(1500)
    return np.asarray(18.0 * np.sin(2 * np.pi * 1.3 * t) + 6.0 * np.sin(2 * np.pi * 7.1 * t + 1.0))


def base(*more: Term) -> Model:
    own = [term("coulomb", force=5.0), term("viscous", coefficient=20.0), term("stribeck", force=2.0, velocity=0.05)]
    return build_model(
        "rigid", {"mass": 2.0}, [*(held for held in own if held.effect.id not in {m.effect.id for m in more}), *more]
    )


def run(model: Model) -> Array:
    """Positions of ``model`` under the force, shape ``(n,)``."""
    effort = force()
    states = np.ascontiguousarray(model.plant.start(np.array(model.plant_values), 0.0, 0.0))
    found, friction, applied = (
        np.empty((effort.shape[0], states.shape[0])),
        np.empty(effort.shape[0]),
        np.empty(effort.shape[0]),
    )
    model.linked_loops.simulate(
        model.linked, effort, H, 4, 0.0, np.ones(1), np.zeros(1), states, *model.inner_states(), found, friction, applied
    )
    return found[:, 0]


@pytest.mark.parametrize("effect", ABLE, ids=[effect.key for effect in ABLE])
def test_neutral_values_leave_the_motion_as_it_was(effect: Effect) -> None:
    assert effect.neutral is not None
    expected = run(base())
    found = run(base(Term(effect, effect.neutral)))
    if effect.id in {"coulomb", "viscous", "stribeck"}:
        assert np.max(np.abs(found - expected)) > 1e-3  # there it takes the base model's own friction away
        return
    assert np.max(np.abs(found - expected)) <= 1e-9 * np.ptp(expected)


def test_an_effect_with_an_amplitude_is_not_always_neutral() -> None:
    assert abs(run(base(term("bias", force=4.0)))[-1] - run(base())[-1]) > 1e-3
