"""Effects concealed in a recording: the changed recording is that of an axis that has them, by simulation of that axis."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import fric
import numpy as np
import pytest
from fric.diagnosis.limits import Limit
from fric.diagnosis.prove import injection_exam
from fric.diagnosis.prove.calibrating import trials_of
from fric.diagnosis.prove.injection import CHANGED, INJECTED, Injected, at_limit, can_be_at_limit, injected, injections
from fric.diagnosis.prove.injection_exam import examined
from fric.effects import EFFECTS
from fric.errors import InputError
from fric.model import build_model, term
from fric.record import Record

H = 1e-3
NOMINAL = build_model("rigid", {"mass": 5.0}, [term("coulomb", force=8.0), term("viscous", coefficient=30.0)])


@pytest.fixture(scope="module")
def record() -> Record:
    t = H * np.arange(9000)
    force = 30.0 * np.sin(2.0 * np.pi * (0.3 + 0.06 * t) * t) + 12.0 * np.sin(2.0 * np.pi * 1.7 * t)
    moved = fric.simulate(NOMINAL, force, period=H)
    noise = np.random.default_rng(2).standard_normal((2, t.shape[0]))
    return replace(moved, position=moved.position + 1e-7 * noise[0], effort=moved.effort + 0.05 * noise[1])


def test_what_is_injected_is_in_the_vocabulary_and_of_the_size_that_is_said(record: Record) -> None:
    names = {EFFECTS[key].id for key in EFFECTS}
    for what in injections([3.0]):
        assert what.effect in names
        (changed,) = injected([record], what.effect, 0.6)
        added = changed.effort - record.effort
        acts = np.abs(added) > 0.05 * np.max(np.abs(added))
        assert float(np.sqrt(np.mean(added[acts] ** 2))) == pytest.approx(0.6, rel=0.3 if what.effect in CHANGED else 0.05)
    assert len(injections([3.0, 6.0])) == 2 * (len(INJECTED) + len(CHANGED))


def test_the_axis_with_the_spring_moves_the_same_under_the_changed_effort(record: Record) -> None:
    (changed,) = injected([record], "stiffness", 1.5)
    added = changed.effort - record.effort
    low = float(np.min(record.position))
    slope = np.polyfit(record.position - low, added, 1)[0]
    axis = NOMINAL.with_terms((*NOMINAL.terms, term("stiffness", stiffness=slope, position=low)))
    moved = fric.simulate(axis, changed.effort, period=H)
    plain = fric.simulate(NOMINAL, record.effort, period=H)
    assert np.max(np.abs(moved.position - plain.position)) < 0.01 * np.ptp(plain.position)


@pytest.mark.parametrize("effect", ["actuator_lag", "gear_friction"])
def test_the_axis_with_the_effect_moves_the_same_under_the_changed_effort(effect: str) -> None:
    t = H * np.arange(4000)
    force = 30.0 * np.sin(2.0 * np.pi * 0.8 * t) + 12.0 * np.sin(2.0 * np.pi * 1.7 * t)
    plain = replace(fric.simulate(NOMINAL, force, period=H), effort=force)
    (changed,), (twice,) = (injected([plain], effect, size) for size in (1.0, 2.0))
    # How large it became is known from a small one: the added force over the slope.
    slope = np.gradient(force, t) if effect == "actuator_lag" else np.abs(force)
    size = float(np.median(np.abs(changed.effort - force)[slope != 0.0] / np.abs(slope[slope != 0.0])))
    assert float(np.median(np.abs(twice.effort - force))) == pytest.approx(
        2.0 * float(np.median(np.abs(changed.effort - force))), rel=0.1
    )
    value = {"time": size} if effect == "actuator_lag" else {"coefficient": size}
    axis = NOMINAL.with_terms((*NOMINAL.terms, term(effect, **value)))
    moved = fric.simulate(axis, changed.effort, period=H)
    without = fric.simulate(NOMINAL, changed.effort, period=H)
    off = np.max(np.abs(moved.position - plain.position))
    assert off < 0.1 * np.max(np.abs(without.position - plain.position))


@pytest.mark.parametrize(
    ("effect", "strength", "others"),
    [
        ("stribeck", {"force": 3.0}, {"velocity": 0.2}),
        ("ripple", {"cosine": 2.0}, {"sine": 0.0, "period": 0.9}),
        ("quadratic_drag", {"coefficient": 1.2}, {}),
        ("time_drift", {"change": 0.3}, {"time": 3.0}),
        ("delay", {"time": 4e-3}, {}),
        ("gear_friction", {"coefficient": 0.05}, {}),
    ],
)
def test_the_axis_with_a_multiple_of_the_limit_moves_the_same_under_the_changed_effort(
    effect: str, strength: dict[str, float], others: dict[str, float]
) -> None:
    t = H * np.arange(6000)
    force = 30.0 * np.sin(2.0 * np.pi * 0.8 * t) + 12.0 * np.sin(2.0 * np.pi * 1.7 * t)
    plain = replace(fric.simulate(NOMINAL, force, period=H), effort=force)
    ((name, value),) = strength.items()
    limit = Limit(effect, "", name, value, False, "", "", "", term(effect, **strength, **others))
    assert can_be_at_limit(limit, 1.5)
    (changed,) = at_limit([plain], NOMINAL, limit, 1.5)
    axis = NOMINAL.with_terms((*NOMINAL.terms, term(effect, **{name: 1.5 * value}, **others)))
    moved = fric.simulate(axis, changed.effort, period=H)
    without = fric.simulate(NOMINAL, changed.effort, period=H)
    off = np.max(np.abs(moved.position - plain.position))
    assert off < 0.1 * np.max(np.abs(without.position - plain.position))


def test_what_cant_be_put_into_the_effort_at_its_limit_is_left_out() -> None:
    assert not can_be_at_limit(Limit("stribeck", "", "", None, False, "", "the fitted parameters do the same"), 0.5)
    backlash = term("backlash", gap=1e-5)
    assert not can_be_at_limit(Limit("backlash", "", "gap", 1e-5, False, "m", "", "", backlash), 0.5)
    gear = term("gear_friction", coefficient=0.7)
    assert can_be_at_limit(Limit("gear_friction", "", "coefficient", 0.7, False, "1", "", "", gear), 0.5)
    assert not can_be_at_limit(Limit("gear_friction", "", "coefficient", 0.7, False, "1", "", "", gear), 1.5)
    directional = term("gear_friction", "directional", driving=0.1, driven=0.05)
    assert not can_be_at_limit(Limit("gear_friction", "", "driving", 0.1, False, "1", "", "", directional), 0.5)


def test_recordings_at_one_speed_each_are_refused(record: Record, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(injection_exam, "diagnose", lambda *_, **__: SimpleNamespace(by_means=True))
    with pytest.raises(InputError, match="is at one speed"):
        examined([record], NOMINAL, [Injected("stiffness", 6.0)], 6, tmp_path, list[str]().append)


@pytest.mark.long
def test_what_is_injected_is_found_and_an_examination_goes_on_in_its_folder(record: Record, tmp_path: Path) -> None:
    wanted, told = [Injected("stiffness", 6.0), Injected("quadratic_drag", 6.0)], list[str]()
    bare, outcomes = examined([record], NOMINAL, wanted[:1], 6, tmp_path, told.append, jobs=1)
    assert not bare.mismatch
    assert sum("diagnosed" in each for each in told) == 1
    _, outcomes = examined([record], NOMINAL, wanted, 6, tmp_path, told.append, jobs=1)
    assert sum("diagnosed" in each for each in told) == 2
    assert all(each.found and not each.wrong and not each.failure for each in outcomes)
    trials = list(trials_of(tmp_path))
    assert [each.effect for each in trials if each.right] == ["quadratic_drag", "stiffness"]
    with pytest.raises(InputError, match="holds an examination of other recordings"):
        examined([record], NOMINAL, wanted, 5, tmp_path, told.append)
