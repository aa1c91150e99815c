"""Terms that come one after the other, and what is said where the time ends before they have."""

from __future__ import annotations

import pytest
from fric.diagnosis.adding import extended_by_terms
from fric.diagnosis.deadline import within
from fric.diagnosis.fitting import refit
from fric.diagnosis.growth import Growth
from fric.model import term

from .small_axis import NOMINAL, followed

SPRING = term("stiffness", stiffness=60.0, position=0.0)


def grown(seconds: float | None) -> tuple[Growth, list[str]]:
    track = followed(SPRING)
    state = refit(track, NOMINAL)
    said: list[str] = []
    with within(seconds):
        return extended_by_terms([track], Growth(track, state, state, (), (), 1.0), None, said.append), said


def test_what_is_missing_comes_with_its_value_and_then_nothing_more() -> None:
    found, said = grown(None)
    assert [step.term for step in found.steps] == ["stiffness"]
    assert found.ended
    assert len(said) == 1
    assert found.end.fit.model.value("stiffness.stiffness") == pytest.approx(60.0, rel=0.02)
    assert found.end.excess < 0.01 * found.begin.excess


def test_a_search_that_the_time_ended_has_not_come_to_its_end() -> None:
    """Nothing came, though much is missing: further terms may help. What was missing is screened all the same."""
    found, _ = grown(1e-9)
    assert found.steps == ()
    assert not found.ended
    assert found.last[0].column.term.effect.id == "stiffness"
