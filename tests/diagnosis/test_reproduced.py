"""Terms that halves of a recording contradict each other about go, and others stay."""

from __future__ import annotations

import pytest
from fric.diagnosis.fitting import refit
from fric.diagnosis.growth import Growth
from fric.diagnosis.reproduced import reproduced
from fric.diagnosis.settle import Step, audit
from fric.diagnosis.track import Track
from fric.model import Term, term

from .small_axis import NOMINAL, followed, recorded, with_terms

DRAG = term("quadratic_drag", coefficient=15.0)
RIPPLE = term("ripple", cosine=3.0, sine=0.0, period=0.04)


def grown(track: Track, *terms: Term, names: tuple[str, ...]) -> Growth:
    begin, end = refit(track, NOMINAL), refit(track, with_terms(*terms))
    steps = tuple(Step(name, begin.left, end.left, end.floor, begin.excess, (), ()) for name in names)
    return Growth(track, begin, end, steps, (), audit(track, begin.fit.model, end.fit.model))


@pytest.fixture(scope="module")
def changing() -> Track:
    """A drag that is always there and a ripple that is there in every other quarter only."""
    return Track.of([recorded(DRAG, RIPPLE), recorded(DRAG, seed=1)] * 2, 45.0, NOMINAL)


def test_what_one_half_does_not_find_again_in_the_other_goes(changing: Track) -> None:
    growth = grown(changing, DRAG, RIPPLE, names=("quadratic_drag", "ripple"))
    said: list[str] = []
    fewer = reproduced(growth, said.append)
    assert [step.term for step in fewer.steps] == ["quadratic_drag"]
    assert set(fewer.end.fit.model.prefixes) == {*NOMINAL.prefixes, "quadratic_drag"}
    assert fewer.rejected == (("ripple", "one half of the recordings does not find it again in the other"),)
    assert fewer.rest == pytest.approx(audit(changing, fewer.begin.fit.model, fewer.end.fit.model))
    assert fewer.price < growth.price
    assert len(said) == 1
    assert said[0].startswith("ripple")


def test_a_single_term_is_left_to_others(changing: Track) -> None:
    growth = grown(changing, RIPPLE, names=("ripple",))
    assert reproduced(growth) is growth


def test_what_both_halves_tell_stays() -> None:
    track = followed(DRAG, RIPPLE)
    growth = grown(track, DRAG, RIPPLE, names=("quadratic_drag", "ripple"))
    assert reproduced(growth) is growth


def test_of_two_terms_of_one_effect_the_other_keeps_its_place(changing: Track) -> None:
    """The second ripple is called the first when that has gone."""
    always = term("ripple", cosine=2.0, sine=0.0, period=0.02)
    track = Track.of([recorded(always, RIPPLE), recorded(always, seed=1)] * 2, 45.0, NOMINAL)
    fewer = reproduced(grown(track, RIPPLE, always, names=("ripple", "ripple#2")))
    assert [step.term for step in fewer.steps] == ["ripple"]
    assert fewer.end.fit.model.value("ripple.period") == pytest.approx(0.02, rel=0.02)
