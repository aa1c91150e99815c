"""A faint term is found by its form in noise as strong as itself, and none where there is none."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fric.diagnosis import conclusion
from fric.diagnosis.diagnose import diagnose
from fric.diagnosis.faint import faint_term
from fric.diagnosis.fitting import refit
from fric.diagnosis.growth import Growth
from fric.diagnosis.presence import Presence, presences
from fric.diagnosis.prove.cases import draw
from fric.diagnosis.track import Track
from fric.model import Term, term

from .small_axis import NOMINAL, recorded

NOISE = 3e-5  # [m]


def tracks(*lacks: Term, seed: int = 0) -> list[Track]:
    made = recorded(*lacks, seed=seed, duration=8.0, noise=NOISE)
    return [Track.of([made], bandwidth, NOMINAL) for bandwidth in (45.0, 140.0)]


def quietly(_: str) -> None:
    pass


def test_a_ripple_in_noise_is_found_by_the_observer_to_which_it_stands_out() -> None:
    period = 0.03
    followed = tracks(term("ripple", cosine=0.5, sine=0.0, period=period))
    states = [refit(track, NOMINAL) for track in followed]
    # About what the noise leaves to the slow observer, and next to nothing beside what it leaves to the fast one.
    assert states[0].excess < 2.0 * states[0].floor
    assert states[1].excess < 0.2 * states[1].floor
    growth = faint_term(followed, NOMINAL, quietly)
    assert growth is not None
    assert growth.track.bandwidth == 45.0
    assert [step.term for step in growth.steps] == ["ripple"]
    assert growth.end.fit.model.value("ripple.period") == pytest.approx(period, rel=0.02)
    size = np.hypot(growth.end.fit.model.value("ripple.cosine"), growth.end.fit.model.value("ripple.sine"))
    assert size == pytest.approx(0.5, rel=0.2)


@pytest.mark.parametrize("seed", range(2))
def test_noise_alone_is_no_term(seed: int) -> None:
    assert faint_term(tracks(seed=seed), NOMINAL, quietly) is None


def test_what_only_passes_less_of_the_noise_on_explains_nothing() -> None:
    """Hysteresis over acceleration seemed to explain the noise of an axis that lacks nothing: it does so on its twin, too."""
    case = draw(4023, "nothing", (), "events")
    assert not diagnose(case.train, case.validation, case.nominal).mismatch


def test_where_the_force_between_samples_is_unsure_nothing_faint_is_told() -> None:
    """What stands out may be that force then."""
    followed = tracks(term("ripple", cosine=0.5, sine=0.0, period=0.045))
    wide = [tuple(replace(run, between=0.0 * run.effort + 0.01) for run in track.runs) for track in followed]
    unsure = [replace(track, runs=runs) for track, runs in zip(followed, wide, strict=True)]
    assert all(track.unsure for track in unsure)
    assert faint_term(unsure, NOMINAL, quietly) is None


@pytest.mark.parametrize("probability", [0.3, 0.7])
def test_hardly_more_than_noise_is_a_mismatch_where_an_effect_is_likelier_there_than_not(
    probability: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    def less_sure(*args: Any, **kwargs: Any) -> dict[str, Presence]:
        return {name: replace(each, probability=probability) for name, each in presences(*args, **kwargs).items()}

    monkeypatch.setattr(conclusion, "presences", less_sure)
    monkeypatch.setattr(Growth, "stands_out", property(lambda growth: growth.begin.excess > 3.0 * growth.begin.floor))
    faint = term("ripple", cosine=0.5, sine=0.0, period=0.03)
    learnt, held_back = (recorded(faint, seed=seed, duration=8.0, noise=NOISE) for seed in (0, 1))
    found = diagnose([learnt], [held_back], NOMINAL)
    likely = probability > 0.5
    assert found.mismatch == likely
    assert [each.effect for each in found.findings] == (["ripple"] if likely else [])
    assert ("hardly more than noise" in " ".join(each.why for each in found.rejected)) == (not likely)
    names = {held.effect.id for held in found.model.terms}
    assert ("ripple" in names) == likely
