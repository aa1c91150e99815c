"""A model grown with a slow observer is judged by the faster one that was given up for it; moves and terms take turns."""

from __future__ import annotations

import importlib
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fric.diagnosis.fitting import State, refit
from fric.diagnosis.grow import left_beyond, with_moves
from fric.diagnosis.growth import Growth
from fric.diagnosis.settle import Step
from fric.diagnosis.track import Track
from fric.model import Model, build_model, term
from fric.record import Record
from fric.simulation import simulate

from .small_axis import NOMINAL as SMALL
from .small_axis import followed, with_terms

H = 1e-3
grow_module = importlib.import_module("fric.diagnosis.grow")
PLAIN = (term("coulomb", force=5.0), term("viscous", coefficient=20.0))
NOMINAL = build_model("rigid", {"mass": 2.0}, PLAIN)
RIPPLE = term("ripple", cosine=2.0, sine=0.0, period=0.05)


def growth(track: Track, begin: State, end: Model) -> Growth:
    return Growth(track, begin, refit(track, end), (), (), 1.0)


@pytest.fixture(scope="module")
def tracks() -> list[Track]:
    t = H * np.arange(8000)
    effort = 18.0 * np.sin(5.0 * t) + 9.0 * np.sin(17.0 * t)
    axis = build_model("rigid", {"mass": 2.0}, [*PLAIN, RIPPLE])
    position = simulate(axis, effort, H, n_substeps=4).position[: t.size]
    position += 1e-7 * np.random.default_rng(3).standard_normal(t.size)
    return [Track.of([Record(t, position, effort)], bandwidth, NOMINAL) for bandwidth in (45.0, 140.0)]


def test_what_it_explains_to_the_faster_one_too_is_not_left(tracks: list[Track]) -> None:
    slow, fast = tracks
    given_up = growth(fast, refit(fast, NOMINAL), NOMINAL)
    whole = growth(slow, refit(slow, NOMINAL), NOMINAL.with_terms((*NOMINAL.terms, RIPPLE)))
    assert left_beyond(given_up, whole) == 0.0


def test_what_neither_explains_is_left(tracks: list[Track]) -> None:
    slow, fast = tracks
    given_up = growth(fast, refit(fast, NOMINAL), NOMINAL)
    wrong = growth(slow, refit(slow, NOMINAL), NOMINAL.with_terms((*NOMINAL.terms, term("quadratic_drag", coefficient=1.0))))
    assert left_beyond(given_up, wrong) > 0.5


def test_a_move_makes_room_for_what_is_added_then() -> None:
    """A narrow Stribeck curve told as hysteresis hides a drag; once it has its name, the drag comes."""
    narrow, drag = (
        term("stribeck", "exponential", force=6.0, velocity=0.15, exponent=2.0),
        term("quadratic_drag", coefficient=15.0),
    )
    track = followed(narrow, drag, bandwidth=140.0)
    begin = refit(track, SMALL)
    end = refit(track, with_terms(term("accel_hysteresis", force=3.0, velocity=0.1)))
    step = Step("accel_hysteresis", begin.left, end.left, begin.floor, begin.excess, (), ())
    rest = end.excess / begin.excess
    found = with_moves(Growth(track, begin, end, (step,), (), rest), lambda _: None)
    assert {each.term for each in found.steps} == {"stribeck", "quadratic_drag"}
    assert found.rest < 0.01
    assert found.end.fit.model.value("quadratic_drag.coefficient") == pytest.approx(15.0, rel=0.02)


def test_a_beginning_is_judged_without_what_only_mends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """With two terms that explain the last per cent, the right beginning would cost more than a wrong one without any."""
    drag, spring = term("quadratic_drag", coefficient=15.0), term("stiffness", stiffness=0.5)
    ripple = term("ripple", cosine=0.1, sine=0.0, period=0.04)
    track = followed(drag)
    begin = refit(track, SMALL)

    def grown(*names: str, **more: Any) -> Growth:
        terms = {"quadratic_drag": drag, "stiffness": spring, "ripple": ripple}
        end = refit(track, with_terms(*(terms[name] for name in names)))
        steps = tuple(Step(name, begin.left, end.left, end.floor, begin.excess, (), ()) for name in names)
        return Growth(track, begin, end, steps, (), 1.0, **more)

    other = SimpleNamespace(names=("stiffness",), effect=spring.effect)
    first = grown("quadratic_drag", "ripple", "stiffness", beginnings=(other,))
    lacks = {("quadratic_drag", "ripple", "stiffness"): 0.01, ("stiffness",): 0.07, ("quadratic_drag",): 0.02}
    monkeypatch.setattr(grow_module, "_surely_lacks", lambda each: lacks[tuple(step.term for step in each.steps)])
    monkeypatch.setattr(grow_module, "extended_by_terms", lambda *_, **__: grown("stiffness", ended=True))
    monkeypatch.setattr(Growth, "dear", property(lambda each: 0.05 * len(each.steps)))
    best = grow_module._compared([track], grown(), first, lambda _: None)
    assert [step.term for step in best.steps] == ["quadratic_drag"]
    assert best.end.fit.model.prefixes == (*SMALL.prefixes, "quadratic_drag")
    assert not best.ended
