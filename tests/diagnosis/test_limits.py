"""Detection limits: at half of one an effect hardly shows, at one and a half of it it does, on recordings with that effect."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import fric
import numpy as np
import pytest
from fric.diagnosis.additive.residual import independent_values
from fric.diagnosis.candidates import candidates, scales_of
from fric.diagnosis.fitting import State, refit
from fric.diagnosis.limits import EVIDENCE, Limit, limits_of
from fric.diagnosis.screen import screen
from fric.diagnosis.start import started
from fric.diagnosis.track import Track
from fric.model import Term, build_model, term
from fric.record import Record, Units

H = 2e-3
NOMINAL = build_model("rigid", {"mass": 5.0}, [term("coulomb", force=8.0), term("viscous", coefficient=30.0)])


def recording(*added: Term) -> Record:
    """The axis of NOMINAL with what is ``added``, under one force, with the noise of its instruments."""
    t = H * np.arange(7000)
    force = 30.0 * np.sin(2.0 * np.pi * (0.3 + 0.06 * t) * t) + 12.0 * np.sin(2.0 * np.pi * 1.7 * t)
    moved = fric.simulate(NOMINAL.with_terms((*NOMINAL.terms, *added)), force, period=H)
    random = np.random.default_rng(2)
    n = t.shape[0]
    return replace(
        moved,
        position=moved.position + 2e-6 * random.standard_normal(n),
        effort=moved.effort + 0.3 * random.standard_normal(n),
    )


def followed(record: Record) -> tuple[Track, State]:
    tracks, start = started(NOMINAL, [record])
    track = tracks[len(tracks) // 2]
    return track, refit(track, start)


@pytest.fixture(scope="module")
def limits() -> dict[str, Limit]:
    track, state = followed(recording())
    tried = screen(track, state.fit, candidates(state.fit.model, scales_of(track)), state.chance, in_pairs=False).tried
    return {each.effect: each for each in limits_of(track, state, tried, Units(), anything=False)}


def evidence(added: Term) -> float:
    """What the term gains where it is there, fitted in full [nats]."""
    track, without = followed(recording(added))
    whole = refit(track, without.fit.model.with_terms((*without.fit.model.terms, added)))
    n = independent_values(track, whole.fit.residual)
    before, after = (float(each.fit.residual @ each.fit.residual) for each in (without, whole))
    return 0.5 * n * math.log(before / after)


@pytest.mark.parametrize("effect", ["bias", "stiffness", "quadratic_drag", "asymmetry", "delay"])
def test_an_effect_shows_above_its_limit_and_not_below_it(limits: dict[str, Limit], effect: str) -> None:
    limit = limits[effect]
    assert limit.size is not None
    assert not limit.softer
    strong, weak = (
        evidence(term(effect, **{**({"position": 0.0} if effect == "stiffness" else {}), limit.parameter: limit.size * by}))
        for by in (1.5, 0.5)
    )
    assert strong > EVIDENCE
    assert weak < EVIDENCE


def test_what_acts_alike_on_these_motions_is_named_with_the_limit(limits: dict[str, Limit]) -> None:
    # While it slides both ways at like speeds, a bias is another Coulomb level forward than backward.
    assert limits["asymmetry"].like == "bias"
    assert limits["bias"].like == "asymmetry"
    # What is slow beside the observer can't tell a delay from a lag.
    assert limits["delay"].like == "actuator_lag"
    assert limits["delay"].sentence.endswith("(time), perhaps as lag of the actuator")
    assert not limits["ripple"].like
    assert not limits["time_drift"].like
    assert limits["ripple"].sentence.endswith("(cosine)")


def test_the_limit_of_a_drive_shows_the_more_the_lower_it_is(limits: dict[str, Limit]) -> None:
    saturation = limits["saturation"]
    # The force reaches 42 N: a drive that is limited far above does nothing.
    assert (saturation.softer and 0.0 < (saturation.size or 0.0) < 42.0) or "command goes beyond" in saturation.why


def test_a_recording_without_any_noise_has_limits_too() -> None:
    t = H * np.arange(3000)
    moved = fric.simulate(NOMINAL, 30.0 * np.sin(2.0 * np.pi * (0.3 + 0.06 * t) * t), period=H)
    track, state = followed(moved)
    exact = replace(state, fit=replace(state.fit, solution=replace(state.fit.solution, residual=0.0 * state.fit.residual)))
    tried = screen(track, state.fit, candidates(state.fit.model, scales_of(track)), state.chance, in_pairs=False).tried
    found = {each.effect: each for each in limits_of(track, exact, tried, Units(), anything=False)}
    assert found["ripple"].size is not None
    assert 0.0 <= found["ripple"].size < 0.1


def test_what_is_not_recorded_has_no_limit_and_says_why(limits: dict[str, Limit]) -> None:
    assert limits["temperature"].size is None
    assert "hold nothing" in limits["temperature"].why
    assert "coulomb" not in limits


def test_a_force_larger_than_any_there_is_no_limit() -> None:
    track, state = followed(recording())
    loud = replace(state, fit=replace(state.fit, solution=_scaled(state, 3000.0)))
    tried = screen(track, state.fit, candidates(state.fit.model, scales_of(track)), state.chance, in_pairs=False).tried
    peak = max(float(np.max(np.abs(run.effort))) for run in track.runs)
    found = {each.effect: each for each in limits_of(track, loud, tried, Units(), anything=False)}
    assert "larger than any force" in found["bias"].why
    assert found["bias"].size is None
    forces = [each for each in found.values() if each.unit == "N" and not each.softer and each.size is not None]
    assert all((each.size or 0.0) <= peak for each in forces)


def _scaled(state: State, by: float) -> Any:
    return replace(state.fit.solution, residual=by * state.fit.residual)


def test_a_size_is_printed_in_full() -> None:
    assert Limit("bias", "offset", "force", 123.4, False, "N", "").sentence == "offset above 120 N (force)"
    assert Limit("ripple", "ripple", "cosine", 1.2e-5, False, "N", "").stated == "1.2e-05 N (cosine)"


@pytest.mark.parametrize(
    "hidden", [term("actuator_lag", time=4e-3), term("asymmetry", force=2.0), term("quadratic_drag", coefficient=60.0)]
)
def test_what_may_be_hidden_in_the_rest_would_not_have_shown(hidden: Term) -> None:
    track, state = followed(recording(hidden))  # nothing was found: all that is missing is left
    tried = screen(track, state.fit, candidates(state.fit.model, scales_of(track)), state.chance, in_pairs=False).tried
    limit = next(each for each in limits_of(track, state, tried, Units(), anything=False) if each.effect == hidden.effect.id)
    assert limit.size is not None
    there = dict(zip((p.name for p in hidden.effect.parameters), hidden.values, strict=True))
    assert limit.size > 0.9 * there[limit.parameter]
