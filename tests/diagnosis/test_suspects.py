"""Which component changed: a machine that was its model until then, and is it no longer by one thing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric.diagnosis.suspects import Suspects, prepare_suspects, suspects
from fric.model import Model, Term, term
from fric.record import Record
from fric.simulation import simulate

from .small_axis import NOMINAL, STEP, with_terms

BIASED = with_terms(term("bias", force=0.5))
FLOOR = 0.02  # [N], what a model that is right lacks in these recordings to an observer of 140 rad/s


def since(machine: Model, seconds: float = 4.0) -> Record:
    """What the ``machine`` does since the change."""
    time = STEP * np.arange(round(seconds / STEP))
    effort = 18.0 * np.sin(5.0 * time) + 9.0 * np.sin(17.0 * time)
    moved = simulate(machine, effort, STEP, n_substeps=4)
    noise = 1e-8 * np.random.default_rng(0).standard_normal(time.size)
    return Record(time, moved.position + noise, effort, effort_hold="following")


def told(machine: Model, before: Model = BIASED) -> Suspects:
    return suspects(before, since(machine), 140.0, FLOOR)


@pytest.mark.parametrize(
    ("name", "value", "effect", "component"),
    [
        ("viscous.coefficient", 28.0, "viscous", "load"),
        ("coulomb.force", 4.6, "coulomb", "guideway friction"),
        ("bias.force", 3.0, "bias", "load"),
        ("mass", 2.6, "mass", "load"),
    ],
)
def test_a_value_of_the_model_that_changed_is_known_by_its_name(name: str, value: float, effect: str, component: str) -> None:
    found = told(BIASED.with_value(name, value))
    assert (found.effect, found.component) == (effect, component)
    assert found.known
    assert found.confidence > 0.6
    assert found.share > 0.9
    assert found.runner_up not in ("", effect)


@pytest.mark.parametrize("force", [5.0, 6.0, 7.0])
def test_friction_that_grew_by_much_is_no_other_effect_that_resembles_it(force: float) -> None:
    """First order falls short where a contact sticks: fitted as other effects are, the value leaves less than they do."""
    found = told(BIASED.with_value("coulomb.force", force))
    assert (found.effect, found.component, found.known) == ("coulomb", "guideway friction", True)
    assert found.share > 0.95


@pytest.mark.parametrize(
    ("new", "component"),
    [
        (term("ripple", cosine=3.0, sine=0.0, period=0.05), "load"),
        (term("saturation", limit=16.0), "command path"),
        (term("quadratic_drag", coefficient=25.0), "load"),
    ],
    ids=lambda each: each if isinstance(each, str) else each.effect.id,
)
def test_an_effect_that_came_is_no_value_of_the_model(new: Term, component: str) -> None:
    found = told(BIASED.with_terms((*BIASED.terms, new)))
    assert (found.effect, found.component) == (new.effect.id, component)
    assert not found.known
    assert found.share > 0.9


def test_the_strength_is_the_root_mean_square_of_the_force_that_is_missing() -> None:
    found = told(BIASED.with_value("bias.force", 4.5))
    # Four newtons, but where the axis rests and friction takes some of them up.
    assert found.strength == pytest.approx(4.0, rel=0.15)
    assert found.duration == pytest.approx(4.0, abs=0.01)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_a_force_of_no_known_kind_is_unknown(seed: int) -> None:
    """Somebody pulls, at random times and either way."""
    made = since(BIASED)
    rough = np.random.default_rng(seed).standard_normal(20).repeat(100)
    pulled = replace(made, effort=made.effort + 3.0 * rough)
    found = suspects(BIASED, pulled, 140.0, FLOOR)
    assert found.effect == "unknown"
    assert not found.known
    assert found.share == 0.0


def test_within_seconds_no_slow_effect_is_named() -> None:
    """A drift of friction that takes minutes is not told from another value of it."""
    drifting = BIASED.with_terms((*BIASED.terms, term("time_drift", "linear", rate=0.05)))
    found = told(drifting)
    assert found.effect not in ("time_drift", "temperature")
    assert found.runner_up not in ("time_drift", "temperature")


def test_getting_ready_says_nothing_and_takes_no_recording() -> None:
    """It compiles what is asked later: the answer afterwards is the same."""
    before = told(NOMINAL.with_value("viscous.coefficient", 30.0), NOMINAL)
    prepare_suspects(NOMINAL)
    assert told(NOMINAL.with_value("viscous.coefficient", 30.0), NOMINAL) == before
