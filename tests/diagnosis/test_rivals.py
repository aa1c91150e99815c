"""What speaks against a model before the data do."""

from __future__ import annotations

from dataclasses import replace

import fric
import numpy as np
import pytest
from fric.diagnosis.along import Along
from fric.diagnosis.candidates import candidates, scales_of
from fric.diagnosis.fitting import refit, with_room
from fric.diagnosis.other_forms import with_play
from fric.diagnosis.other_laws import laws_further, strained, told
from fric.diagnosis.price import FAR_OFF, mass_off, strange
from fric.diagnosis.result import listed
from fric.diagnosis.rival import rival_of
from fric.diagnosis.screen import Promise, screen
from fric.diagnosis.track import Track
from fric.model import Model, Term, build_model, term
from fric.record import Record
from scipy.integrate import solve_ivp


def _axis(mass: float, share: float) -> Model:
    terms = [term("coulomb", force=4.0), term("compliance", stiffness=3e4)]
    return build_model("rigid", {"mass": mass, "load_share": share}, terms)


def test_hardly_any_mass_behind_a_spring_counts_as_a_mass_that_is_off() -> None:
    """A spring without a body behind it is the first micrometres of a contact."""
    usual, light = strange([2.0], _axis(2.0, 0.4)), strange([2.0], _axis(2.0, 0.05))
    assert usual == 0.0
    assert light == pytest.approx(strange([2.0], _axis(4.0, 0.4)))  # half of the least share, twice the mass
    assert strange([2.0], _axis(2.0, 0.1)) == 0.0
    assert strange([2.0], build_model("rigid", {"mass": 2.0}, [term("coulomb", force=4.0)])) == 0.0


@pytest.mark.parametrize("ratio", [0.84, 1.0, 1.19])
def test_a_mass_near_the_given_one_speaks_against_nothing(ratio: float) -> None:
    assert mass_off([2.0], build_model("rigid", {"mass": 2.0 * ratio}, [])) == 0.0
    assert mass_off([2.0], build_model("rigid", {"mass": 4.0 * ratio}, [])) > 0.5 * FAR_OFF
    assert mass_off([2.0], build_model("rigid", {"mass": 4.0}, [])) == pytest.approx(FAR_OFF)


def test_what_has_passed_for_friction_leaves_it() -> None:
    axis = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=9.0), term("viscous", coefficient=1.0)])
    (start,) = with_room(axis, [term("input_deadzone", width=2.5)])
    assert (start.value("coulomb.force"), start.value("input_deadzone.width")) == (6.5, 2.5)
    assert with_room(axis, [term("input_deadzone", width=9.5)]) == []  # more than there was
    assert with_room(axis, [term("bias", force=2.5)]) == []
    frictionless: list[Term] = [term("viscous", coefficient=1.0)]
    assert with_room(build_model("rigid", {"mass": 2.0}, frictionless), [term("input_deadzone", width=1.0)]) == []


@pytest.mark.long
def test_a_mode_that_holds_most_of_the_mass_is_the_best_candidate() -> None:
    """First order sees little of it, where the trial rings long at another frequency than the machine does."""
    body, hung, frequency, damping, viscous = 0.8, 1.2, 55.0, 0.03, 40.0
    w, step, shift = 2.0 * np.pi * frequency, 1e-3, 0.4

    def push(t: float) -> float:
        return 30.0 * float(np.sin(2.0 * np.pi * 1.3 * t)) + (12.0 if int(t / 0.37 + shift) % 2 else -12.0)

    def rates(t: float, x: np.ndarray) -> list[float]:
        given = push(step * np.floor(t / step + 1e-9))
        spring = hung * (w**2 * (x[2] - x[0]) + 2.0 * damping * w * (x[3] - x[1]))
        return [x[1], (given - viscous * x[1] + spring) / body, x[3], -spring / hung]

    time = np.arange(9000) * step
    found = solve_ivp(rates, (0.0, time[-1]), np.zeros(4), t_eval=time, max_step=0.5 * step, rtol=1e-8, atol=1e-11)
    position = found.y[0] + 1e-6 * np.random.default_rng(2).standard_normal(time.shape[0])
    record = Record(time, position, np.array([push(float(t)) for t in time]), effort_hold="following")
    start = build_model("rigid", {"mass": body + hung}, [term("viscous", coefficient=viscous)])
    track = Track.of([record], 400.0, start)
    state = refit(track, start)
    screened = screen(track, state.fit, candidates(state.fit.model, scales_of(track)), state.chance, in_pairs=False)
    assert screened.tried[0].column.term.effect.key == "compliance/appendage"
    assert screened.tried[0].gain > 0.2 * state.excess


@pytest.mark.long
def test_beside_a_transmission_a_period_is_told_along_the_motion() -> None:
    """Where the load's motion isn't measured, the motor's tells well enough which of many periods to follow up."""
    motor, load, stiffness, damping, viscous, period, step = 0.9, 1.1, 8e4, 20.0, 40.0, 0.021, 1e-3

    def push(t: float) -> float:
        return 12.0 * float(np.sin(2.0 * np.pi * 0.9 * t)) + 8.0 * float(np.sin(2.0 * np.pi * 2.3 * t))

    def rates(t: float, x: np.ndarray) -> list[float]:
        given = push(step * np.floor(t / step + 1e-9))
        spring = stiffness * (x[2] - x[0]) + damping * (x[3] - x[1])
        ripple = 2.5 * float(np.cos(2.0 * np.pi * x[0] / period))
        return [x[1], (spring - viscous * x[1] - ripple) / load, x[3], (given - spring) / motor]

    time = np.arange(9000) * step
    found = solve_ivp(rates, (0.0, time[-1]), np.zeros(4), t_eval=time, max_step=0.5 * step, rtol=1e-8, atol=1e-11)
    position = found.y[2] + 1e-7 * np.random.default_rng(2).standard_normal(time.shape[0])
    record = Record(time, position, np.array([push(float(t)) for t in time]), effort_hold="following")
    terms = [term("viscous", coefficient=viscous), term("compliance", stiffness=stiffness, damping=damping)]
    start = build_model("rigid", {"mass": motor + load, "load_share": 0.55}, terms)
    track = Track.of([record], 140.0, start)
    state = refit(track, start, 6)
    ripple = next(each for each in candidates(state.fit.model, scales_of(track)) if each.effect.id == "ripple")
    periods = np.array([trial.values[2] for trial in ripple.trials])
    kept = [trial.values[2] for trial in Promise(Along(track), state.fit).narrowed(ripple)]
    assert len(kept) <= 2 < periods.shape[0]
    assert float(periods[np.argmin(np.abs(np.log(periods / period)))]) in kept
    best = screen(track, state.fit, candidates(state.fit.model, scales_of(track)), state.chance, in_pairs=False).tried[0]
    assert best.column.term.effect.id == "ripple"


def test_a_spring_is_taken_further_by_as_much_as_the_force_would_show() -> None:
    time = np.arange(4000) * 1e-3
    record = Record(time, 0.1 * np.sin(3.0 * time), 5.0 * np.cos(3.0 * time), source="swings")
    scales = scales_of(Track.of([record], 45.0, build_model("rigid", {"mass": 2.0}, [])))
    (further,) = laws_further(term("compliance", stiffness=3e4, damping=7.0), scales)
    assert (further.effect.id, further.effect.law) == ("compliance", "hardening")
    given = dict(zip([p.name for p in further.effect.parameters], further.values, strict=True))
    assert (given["stiffness"], given["damping"]) == (3e4, 7.0)
    deflection = scales.level / 3e4
    assert given["hardening"] * deflection**3 == pytest.approx(scales.level)
    assert list(laws_further(term("coulomb", force=4.0), scales)) == []


def test_many_effects_are_told_one_after_another() -> None:
    assert [listed(names) for names in ([], ["a"], ["a", "b"], ["a", "b", "c"])] == ["", "a", "a and b", "a, b and c"]


def test_any_of_several_masses_is_plausible() -> None:
    light = build_model("rigid", {"mass": 0.5}, [])
    assert mass_off([2.0, 0.55], light) == 0.0
    assert mass_off([2.0], light) == mass_off([2.0, 9.0], light) > FAR_OFF


def test_a_law_at_the_end_of_its_form_is_strained() -> None:
    assert not strained(term("saturation", "soft", limit=3.0, softness=0.3))
    assert strained(term("saturation", "soft", limit=3.0, softness=1.0))
    assert strained(term("saturation", "soft", limit=3.0, softness=1e-4))  # which is a corner
    assert not strained(term("saturation", "hard", limit=3.0))
    # How strong an effect is doesn't bend it.
    assert not strained(term("position_dependence", "periodic", cosine=1.0, sine=0.0, period=0.1))
    assert not strained(term("load_dependence", "power", exponent=0.0))


def test_tails_of_a_place_that_was_not_visited_tell_of_no_other_law() -> None:
    time = np.arange(4000) * 1e-3
    record = Record(time, 0.1 * np.sin(time), np.cos(time), source="swing")
    scales = scales_of(Track.of([record], 140.0, build_model("rigid", {"mass": 2.0}, [])))
    for place, seen in ((0.05, True), (0.3, False)):
        spot = term("position_dependence", "peak", amplitude=0.5, position=place, width=0.02, exponent=1.0)
        assert told(spot, scales) is seen


def test_a_spring_in_place_of_closed_stops_keeps_what_was_offered_beside_them() -> None:
    """Else a term of the model would be told by nobody."""
    period, nominal = 2e-3, build_model("rigid", {"mass": 5.0}, [term("coulomb", force=8.0), term("viscous", coefficient=30.0)])
    t = period * np.arange(3000)
    force = 30.0 * np.sin(2.0 * np.pi * (0.3 + 0.06 * t) * t)
    ripple = term("ripple", cosine=0.0, sine=2.0, period=0.02)
    moved = fric.simulate(nominal.with_terms((*nominal.terms, ripple)), force, period=period)
    noise = np.random.default_rng(2).standard_normal((2, t.shape[0]))
    record = replace(moved, position=moved.position + 1e-6 * noise[0], effort=moved.effort + 0.05 * noise[1])
    track = Track.of([record], 140.0, nominal)
    state, scales = refit(track, nominal), scales_of(track)
    found = screen(track, state.fit, candidates(state.fit.model, scales), state.chance)
    beside = next(each for each in found.tried if each.column.term.effect.id == "ripple")
    closed = term("impact_backlash", gap=1e-12, stiffness=1e6, damping=100.0)
    spring = term("compliance", stiffness=1e6, damping=100.0)
    stops, springs = (replace(beside, column=replace(beside.column, term=each)) for each in (closed, spring))
    found = replace(found, tried=(*found.tried, springs))
    fit = track.fit(nominal.with_terms((*nominal.terms, closed, ripple)), ["mass"], 1)
    rival = rival_of(track, state, (stops, beside), fit, found)
    given = with_play(track, state, [rival], found, scales)
    assert given
    for each in given:
        brought = {held.effect.id for held in each.fit.model.terms} - {held.effect.id for held in nominal.terms}
        assert sorted(name.split("#")[0] for name in each.names) == sorted(brought)
    assert ["compliance", "ripple"] in [sorted(each.names) for each in given]
