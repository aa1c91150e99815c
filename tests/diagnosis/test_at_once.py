"""A model that was grown by several terms at once: when it is taken for the better one, on an axis that lacks three effects."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from fric.diagnosis.additive import together as growing
from fric.diagnosis.at_once import by_parts, helped, surpassing, together
from fric.diagnosis.fitting import State, refit
from fric.diagnosis.growth import Growth
from fric.diagnosis.settle import Step
from fric.diagnosis.track import Track
from fric.model import Model, Term, term

from .small_axis import NOMINAL, recorded, with_terms

DRAG = term("quadratic_drag", coefficient=15.0)
RIPPLE = term("ripple", cosine=2.0, sine=0.0, period=0.03)
PULL = term("bias", force=2.0)
LACKS = (DRAG, RIPPLE, PULL)


def quietly(_: str) -> None:
    pass


def followed(*lacks: Term) -> list[Track]:
    made = recorded(*lacks, duration=3.0, noise=1e-6)
    return [Track.of([made], bandwidth, NOMINAL) for bandwidth in (45.0, 140.0)]


def grown(track: Track, model: Model, rest: float = 0.0) -> Growth:
    """The nominal axis grown to ``model``."""
    begin, end = refit(track, NOMINAL), refit(track, model)
    names = [name for name in end.fit.model.prefixes if name not in NOMINAL.prefixes]
    steps = tuple(Step(name, begin.left, end.left, end.floor, begin.excess, (), ()) for name in names)
    return Growth(track, begin, end, steps, (), rest)


@pytest.fixture(scope="module")
def tracks() -> list[Track]:
    return followed(*LACKS)


@pytest.fixture(scope="module")
def proposed(tracks: list[Track]) -> Growth:
    """All three, as growing together would end."""
    true = grown(tracks[1], with_terms(*LACKS))
    return replace(true, ended=True, together=true.end)


def test_where_nothing_is_missing_no_law_comes() -> None:
    found = together(followed(), NOMINAL, quietly)
    assert found.steps == ()
    assert found.end.fit.model.prefixes == NOMINAL.prefixes


def test_a_proposal_without_terms_changes_nothing(tracks: list[Track]) -> None:
    nothing = grown(tracks[1], NOMINAL, 1.0)
    other = grown(tracks[1], with_terms(DRAG), 0.5)
    assert by_parts(tracks, nothing, quietly, other) is other
    assert by_parts(tracks, nothing, quietly) is None


def test_alone_it_is_taken_only_where_it_is_complete(tracks: list[Track], proposed: Growth) -> None:
    """Three effects that leave nothing; two of them leave the third."""
    taken = by_parts(tracks, proposed, quietly)
    assert taken is not None
    assert {step.term for step in taken.steps} == {"quadratic_drag", "ripple", "bias"}
    two = grown(proposed.track, with_terms(DRAG, RIPPLE))
    assert by_parts(tracks, two, quietly) is None


def test_of_two_models_the_one_that_leaves_less_is_taken(tracks: list[Track], proposed: Growth) -> None:
    one = grown(proposed.track, with_terms(DRAG), 0.4)
    taken = by_parts(tracks, proposed, quietly, one)
    assert taken is not None
    assert {step.term for step in taken.steps} == {"quadratic_drag", "ripple", "bias"}
    assert taken.end.fit.model.value("quadratic_drag.coefficient") == pytest.approx(15.0, rel=0.05)
    true = grown(proposed.track, with_terms(*LACKS))
    assert by_parts(tracks, grown(proposed.track, with_terms(DRAG), 0.4), quietly, true) is true


def test_it_surpasses_what_leaves_more_to_a_fast_observer_and_nothing_else(tracks: list[Track], proposed: Growth) -> None:
    worse, true = grown(proposed.track, with_terms(DRAG), 0.4), grown(proposed.track, with_terms(*LACKS))
    better = surpassing(tracks, proposed, worse)
    assert better is not None
    assert better.end is proposed.end
    assert better.last  # what else could come is told
    assert better.rest < 0.05
    three = grown(proposed.track, with_terms(DRAG, PULL, term("stiffness", stiffness=0.5, position=0.0)))
    assert surpassing(tracks, three, true) is None
    assert surpassing(tracks, grown(proposed.track, with_terms(DRAG, RIPPLE)), worse) is None  # too few of them


def test_what_growing_together_came_to_is_not_helped_once_more(tracks: list[Track], proposed: Growth) -> None:
    """At the observer that was the fastest it would come to the same."""
    assert helped([proposed.track], proposed, quietly) is proposed


def test_what_came_before_does_not_go_for_what_does_not_make_up_for_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Drag has come; ripple helps beside it. Flexible functions that could be the drag, too, speak against its law alone."""
    beside_functions = growing._beside_functions

    def against_drag(track: Track) -> growing.Weighed:
        def of(state: State) -> Callable[[int], tuple[float, Model]]:
            weigh = beside_functions(track)(state)

            def weighed(place: int) -> tuple[float, Model]:
                nats, without = weigh(place)
                return (-1.0 if state.fit.model.prefixes[place] == "quadratic_drag" else nats), without

            return weighed

        return of

    monkeypatch.setattr(growing, "_beside_functions", against_drag)
    track = followed(DRAG, term("ripple", cosine=0.5, sine=0.0, period=0.03))[1]
    begin, state = refit(track, NOMINAL), refit(track, with_terms(DRAG))
    end = growing.grown_together(track, begin, quietly, beside_unknown=True, state=state)
    assert {"quadratic_drag", "ripple"} <= set(end.fit.model.prefixes)
    assert end.left < state.left


def test_where_nothing_helps_the_growth_stays_what_it_is() -> None:
    tracks = followed(DRAG)
    true = grown(tracks[1], with_terms(DRAG))
    assert helped(tracks, true, quietly) is true
