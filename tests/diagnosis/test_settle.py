"""A grown model settles: what isn't needed goes, what makes the rest worse goes, and a rival that explains more comes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric.diagnosis import settle
from fric.diagnosis.fitting import State, refit
from fric.diagnosis.settle import Settled, Step, audit, exchanged, is_nothing, merged, renamed, settled
from fric.diagnosis.track import Track
from fric.model import Model, Term, build_model, term
from fric.record import Record
from fric.simulation import simulate

from .small_axis import NOMINAL, STEP, followed, recorded, with_terms

DRAG = term("quadratic_drag", coefficient=15.0)
RIPPLE = term("ripple", cosine=1.5, sine=0.0, period=0.04)
SPRING = term("stiffness", stiffness=0.5, position=0.0)


def steps_for(begin: State, state: State, *names: str) -> list[Step]:
    return [Step(name, begin.left, state.left, state.floor, begin.excess, (), ()) for name in names]


def begun(*lacks: Term, grown: tuple[Term, ...]) -> tuple[Track, State, State]:
    """An axis that lacks something, the nominal model and the grown one fitted to it."""
    track = followed(*lacks)
    return track, refit(track, NOMINAL), refit(track, with_terms(*grown))


@pytest.mark.parametrize(
    ("end", "least", "most"),
    [(NOMINAL, 1.0, 1.0), (with_terms(DRAG), 0.0, 0.01), (with_terms(DRAG, SPRING), 0.0, 0.01), (with_terms(SPRING), 0.5, 1.3)],
    ids=["nothing", "truth", "and more", "something else"],
)
def test_the_audit_is_what_is_lacked_where_it_was_not_fitted(end: Model, least: float, most: float) -> None:
    """All of what the nominal model lacks where nothing came; nothing of it where the truth did."""
    track = followed(DRAG)
    begin = refit(track, NOMINAL).fit.model
    assert least - 1e-3 <= audit(track, begin, refit(track, end).fit.model) <= most + 1e-3


def test_what_does_nothing_beside_the_others_goes() -> None:
    track, begin, state = begun(DRAG, grown=(DRAG, SPRING))
    done = settled(track, begin, state, steps_for(begin, state, "quadratic_drag", "stiffness"))
    assert [step.term for step in done.steps] == ["quadratic_drag"]
    assert [name for name, _ in done.gone] == ["stiffness"]
    assert done.state.fit.model.prefixes == (*NOMINAL.prefixes, "quadratic_drag")
    assert done.state.fit.model.value("quadratic_drag.coefficient") == pytest.approx(15.0, rel=0.02)
    assert done.rest < 0.01


def test_what_both_explain_of_two_that_are_there_stays() -> None:
    track, begin, state = begun(DRAG, RIPPLE, grown=(DRAG, RIPPLE))
    done = settled(track, begin, state, steps_for(begin, state, "quadratic_drag", "ripple"))
    assert {step.term for step in done.steps} == {"quadratic_drag", "ripple"}
    assert done.gone == ()


def test_of_two_that_do_the_same_work_one_goes_and_not_both() -> None:
    """Two ripples of one period: either could go."""
    track, begin, state = begun(RIPPLE, grown=(RIPPLE, RIPPLE))
    done = settled(track, begin, state, steps_for(begin, state, "ripple", "ripple#2"))
    assert [step.term for step in done.steps] == ["ripple"]
    assert done.rest < 0.05


def test_what_makes_worse_what_it_was_not_fitted_to_goes() -> None:
    """A ripple that is there in every other quarter only: what one half of the recording says of it spoils the other."""
    track = Track.of([recorded(term("ripple", cosine=3.0, sine=0.0, period=0.04)), recorded(seed=1)] * 2, 45.0, NOMINAL)
    begin, state = refit(track, NOMINAL), refit(track, with_terms(RIPPLE))
    assert audit(track, begin.fit.model, state.fit.model) > 1.2
    done = settled(track, begin, state, steps_for(begin, state, "ripple"))
    assert done.steps == ()
    assert done.rest == 1.0
    assert done.state.fit.model.prefixes == NOMINAL.prefixes
    assert [name for name, _ in done.gone] == ["ripple"]


def test_terms_that_stay_but_make_worse_what_they_were_not_fitted_to_are_no_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """What has gone is tried in their place, once: steps that only got another name haven't gone."""
    audited = list[tuple[str, ...]]()

    def worse(track: Track, begin: Model, end: Model) -> float:
        audited.append(end.prefixes[len(NOMINAL.prefixes) :])
        return 2.0

    monkeypatch.setattr(settle, "audit", worse)
    track, begin, state = begun(DRAG, grown=(DRAG, SPRING))
    done = settled(track, begin, state, steps_for(begin, state, "quadratic_drag", "stiffness"))
    assert audited == [("quadratic_drag",), ("stiffness",)]
    assert (done.steps, done.rest, done.state) == ((), 1.0, done.begin)
    assert {name for name, _ in done.gone} == {"quadratic_drag", "stiffness"}


def test_a_single_term_is_not_compared_again() -> None:
    """It was compared with its rivals when it came, while nothing else was there either."""
    track, begin, state = begun(DRAG, grown=(SPRING,))
    done = Settled(begin, state, tuple(steps_for(begin, state, "stiffness")), 0.3, ())
    assert exchanged(track, done) is done


def test_a_term_gives_way_to_a_rival_that_explains_more() -> None:
    """Friction that levels off stood in for the drag while the ripple was missing: with both there it is compared again."""
    stand_in = term("shear_thinning", force=3.0, velocity=0.3)
    track, begin, state = begun(DRAG, RIPPLE, grown=(stand_in, RIPPLE))
    done = Settled(begin, state, tuple(steps_for(begin, state, "shear_thinning", "ripple")), 0.2, ())
    after = exchanged(track, done)
    assert {step.term for step in after.steps} == {"quadratic_drag", "ripple"}
    assert after.state.left < 0.5 * state.left
    assert after.state.fit.model.value("quadratic_drag.coefficient") == pytest.approx(15.0, rel=0.1)
    drag = next(step for step in after.steps if step.term == "quadratic_drag")
    assert drag.before > drag.after  # what is left without it and with it
    assert all(rival.effect.id != "quadratic_drag" for rival in drag.rivals)
    assert "shear_thinning" in [rival.effect.id for rival in drag.rivals], "what gave way is held against it"


def test_what_leaves_much_is_not_exchanged() -> None:
    track, begin, state = begun(DRAG, RIPPLE, grown=(SPRING, term("bias", force=0.1)))
    done = Settled(begin, state, tuple(steps_for(begin, state, "stiffness", "bias")), 0.9, ())
    assert exchanged(track, done) is done


@pytest.mark.parametrize(
    ("held", "nothing"),
    [
        (term("quadratic_drag", coefficient=0.0), True),
        (term("quadratic_drag", coefficient=1e-9), False),
        (term("stribeck", force=0.0, velocity=0.1), True),
        (term("ripple", cosine=0.0, sine=0.0, period=0.3), True),
        (term("ripple", cosine=0.0, sine=0.1, period=0.3), False),
        (term("backlash", gap=1e-12), False),  # bodies that are parted are parted
    ],
)
def test_a_term_whose_amplitudes_are_zero_is_nothing(held: Term, nothing: bool) -> None:
    assert is_nothing(held) is nothing


def test_a_step_keeps_its_term_where_another_of_its_effect_goes() -> None:
    model = with_terms(RIPPLE, replace(RIPPLE, values=(0.5, 0.5, 0.1)), DRAG)
    names = ("ripple", "ripple#2", "quadratic_drag")
    place = list(model.prefixes).index("ripple")
    one = Step("", 0.0, 0.0, 0.0, 0.0, (), ())
    now = [renamed(replace(one, term=name), model, place).term for name in names[1:]]
    assert now == ["ripple", "quadratic_drag"]


@pytest.fixture(scope="module")
def loose() -> tuple[Track, State, State]:
    """Two bodies with a play of a tenth of a millimetre and stops that give, recorded at the motor."""
    stops = term("impact_backlash", gap=1e-3, stiffness=2e4, damping=40.0)
    axis = build_model("rigid", {"mass": 2.0, "load_share": 0.5}, [*NOMINAL.terms, stops])
    time = STEP * np.arange(3000)
    effort = 18.0 * np.sin(5.0 * time) + 9.0 * np.sin(17.0 * time)
    moved = simulate(axis, effort, STEP, n_substeps=8)
    position = moved.position + 1e-7 * np.random.default_rng(1).standard_normal(time.size)
    track = Track.of([Record(time, position, effort, effort_hold="following")], 140.0, NOMINAL)
    apart = (term("backlash", gap=1e-3), term("compliance", stiffness=2e4, damping=40.0))
    return track, refit(track, NOMINAL), refit(track, axis.with_terms((*NOMINAL.terms, *apart)))


def test_a_play_and_a_spring_beside_each_other_are_stops_that_give(loose: tuple[Track, State, State]) -> None:
    track, begin, state = loose
    steps = [*steps_for(begin, state, "backlash", "compliance")]
    one, kept = merged(track, begin, state, steps)
    assert [step.term for step in kept] == ["impact_backlash"]
    assert {held.effect.id for held in one.fit.model.terms} == {"coulomb", "viscous", "impact_backlash"}
    assert one.fit.model.value("impact_backlash.gap") == pytest.approx(1e-3, rel=0.05)
    assert kept[0].before == steps[0].before


def test_without_a_play_a_spring_stays_what_it_is(loose: tuple[Track, State, State]) -> None:
    track, begin, state = loose
    springs = (term("compliance", stiffness=2e4), term("compliance", stiffness=4e4))
    two = replace(state, fit=replace(state.fit, model=state.fit.model.with_terms((*NOMINAL.terms, *springs))))
    steps = steps_for(begin, two, "compliance", "compliance#2")
    assert merged(track, begin, two, steps) == (two, steps)
