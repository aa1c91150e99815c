"""What a diagnosis tries: sizes that a recording makes sensible, against motions whose figures are known in closed form."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from fric.diagnosis.candidates import FRICTION, Candidate, Scales, candidates, fewest_cycles, place_of, scales_of
from fric.diagnosis.track import Track
from fric.model import Model, Term, build_model, term
from fric.record import Record
from fric.simulation import simulate

from .small_axis import NOMINAL

SCALES = Scales(
    level=10.0, range=40.0, most=20.0, speed=0.5, slow=1e-3, low=-0.1, high=0.3, duration=4.0, step=2e-3, mass=2.0,
    temperature=5.0, grain=1e-6, fastest=30.0,
)  # fmt: skip
DRIVEN = build_model("rigid", {"mass": 2.0, "load_share": 0.5}, [*NOMINAL.terms, term("backlash", gap=1e-4)])


def of(model: Model, effect_id: str, law: str = "") -> Candidate:
    return next(each for each in candidates(model, SCALES) if (each.effect.id, each.effect.law) == (effect_id, law))


def offered(model: Model) -> set[str]:
    return {each.effect.key for each in candidates(model, SCALES)}


@pytest.fixture(scope="module")
def swing() -> Scales:
    """A sine of 0.1 m at 6 rad/s about 0.2 m, under a force of 9 N at the same rate in phase with the velocity."""
    time = 2e-3 * np.arange(6283)  # twelve periods
    noise = 3e-5 * np.random.default_rng(0).standard_normal(time.size)
    warm = {"temperature": 20.0 + 7.0 * time / time[-1]}
    record = Record(time, 0.2 + 0.1 * np.sin(6.0 * time) + noise, 9.0 * np.cos(6.0 * time), extra=warm)
    return scales_of(Track.of([record], 45.0, NOMINAL))


def test_the_scales_of_a_sine_are_those_of_its_formula(swing: Scales) -> None:
    assert (swing.low, swing.high) == pytest.approx((0.1, 0.3), abs=1.5e-4)
    assert swing.travel == pytest.approx(0.2, abs=3e-4)
    assert swing.range == pytest.approx(18.0, rel=1e-3)
    assert swing.most == pytest.approx(9.0, rel=1e-3)
    assert swing.level == pytest.approx(9.0 / math.sqrt(2.0), rel=0.02)  # |cos| is below this half of the time
    # |cos| is above cos(0.02 pi / 2) for 2 % of the time.
    assert swing.speed == pytest.approx(0.6 * math.cos(0.01 * math.pi), rel=5e-3)
    assert (swing.step, swing.mass) == (pytest.approx(2e-3), 2.0)
    assert swing.duration == pytest.approx(2e-3 * 6282)
    assert swing.temperature == pytest.approx(7.0, rel=1e-3)
    # What the sensor can't tell: its noise, and a speed that is that noise over the time of the observer.
    assert swing.grain == pytest.approx(3e-5, rel=0.1)
    assert swing.slow == pytest.approx(3e-5 * 45.0, rel=0.1)


def test_of_several_recordings_the_scales_are_those_of_all() -> None:
    time = 2e-3 * np.arange(2000)
    near, far = (Record(time, centre + 0.1 * np.sin(6.0 * time), 9.0 * np.cos(6.0 * time)) for centre in (0.0, 1.0))
    both = scales_of(Track.of([near, far], 45.0, NOMINAL))
    assert (both.low, both.high) == pytest.approx((-0.1, 1.1), abs=1e-4)
    assert both.duration == pytest.approx(2.0 * 2e-3 * 1999)


def test_no_value_is_tried_that_its_parameter_refuses() -> None:
    for model in (NOMINAL, DRIVEN, build_model("rigid", {"mass": 2.0}, [])):
        for candidate in candidates(model, SCALES):
            for trial in candidate.trials:
                for p, value in zip(candidate.effect.parameters, trial.values, strict=True):
                    assert p.refusal(value) is None, (candidate.effect.key, p.name, value)


def test_every_trial_can_be_simulated_in_the_model() -> None:
    """A trial that the model can't be built with would stop a diagnosis."""
    for candidate in candidates(NOMINAL, SCALES):
        for trial in (candidate.trials[0], candidate.trials[-1]):
            grown = NOMINAL.with_terms((*NOMINAL.terms, trial))
            assert np.all(np.isfinite(simulate(grown, np.full(20, 30.0), 2e-3).position))


@pytest.mark.parametrize(
    ("effect", "at"), [("viscous", "velocity"), ("quadratic_drag", "velocity"), ("stiffness", "position"), ("bias", "")]
)
def test_what_is_linear_is_tried_with_a_tenth_of_the_typical_force(effect: str, at: str) -> None:
    """At the fastest speed, or at the end of the travel; the simulation tells the force, as what accelerates the mass."""
    free = build_model("rigid", {"mass": 2.0}, [])
    law = "quadratic" if effect == "quadratic_drag" else ""
    (trial,) = of(free, effect, law).trials
    named = trial.by_name | ({"position": 0.0} if effect == "stiffness" else {})  # of the spring's rest
    place, speed = SCALES.travel * (at == "position"), SCALES.speed * (at == "velocity")
    alone = simulate(free.with_terms([term(effect, law, **named)]), np.zeros(3), 1e-6, position=place, velocity=speed)
    force = -2.0 * float(alone.velocity[1] - alone.velocity[0]) / 1e-6
    assert force == pytest.approx(0.1 * SCALES.level, rel=1e-3)


def test_what_is_there_is_offered_again_only_where_a_model_may_hold_several() -> None:
    assert "coulomb" not in offered(NOMINAL)
    assert "viscous" not in offered(NOMINAL)
    assert {"coulomb", "viscous"} <= offered(build_model("rigid", {"mass": 2.0}, []))
    with_ripple = NOMINAL.with_terms((*NOMINAL.terms, term("ripple", cosine=1.0, sine=0.0, period=0.02)))
    assert "ripple" in offered(with_ripple)  # another of another period


def test_one_contact_has_one_law_of_presliding() -> None:
    bristles = NOMINAL.with_terms((*NOMINAL.terms, term("presliding", "dahl", stiffness=1e6)))
    assert not any(each.effect.slip is not None for each in candidates(bristles, SCALES))
    assert any(each.effect.slip is not None for each in candidates(NOMINAL, SCALES))


def test_behind_a_measured_contact_there_is_no_drive() -> None:
    """Its force is measured behind the command path and the transmission."""
    contact = build_model("contact", {"mass": 2.0}, NOMINAL.terms)
    places = {place_of(each.effect) for each in candidates(contact, SCALES)}
    assert not places & {"command path", "transmission"}
    assert FRICTION in places


def test_what_friction_gains_at_rest_needs_friction() -> None:
    frictionless = build_model("rigid", {"mass": 2.0}, [term("viscous", coefficient=1.0)])
    assert any(name.startswith("dwell_time") for name in offered(NOMINAL))
    assert not any(name.startswith("dwell_time") for name in offered(frictionless))


def test_beside_a_play_only_stops_come_and_no_second_play() -> None:
    """A spring beyond a play is the same as elastic stops."""
    parts = [each.effect for each in candidates(DRIVEN, SCALES) if each.effect.link is not None or each.effect.play is not None]
    assert [each.key for each in parts] == ["impact_backlash/viscoelastic"]
    assert {"backlash", "compliance/linear"} <= offered(NOMINAL)


def test_stops_at_a_play_that_is_there_are_tried_from_soft_to_hard_with_hardly_more_play() -> None:
    trials = of(DRIVEN, "impact_backlash", "viscoelastic").trials
    assert all(trial.by_name["gap"] < 1e-4 * SCALES.travel for trial in trials)
    stiffness = np.array([trial.by_name["stiffness"] for trial in trials])
    assert np.all(np.diff(stiffness) > 0.0)
    # Two halves of the mass on a spring swing with the reduced mass, a quarter of it.
    rates = np.sqrt(stiffness / (0.25 * SCALES.mass)) / (2.0 * np.pi)
    assert (rates[0], rates[-1]) == pytest.approx((8.0, 60.0))


def test_springs_are_tried_over_the_frequencies_that_the_recording_holds_hardly_damped() -> None:
    trials = of(NOMINAL, "compliance", "linear").trials
    reduced = 0.25 * SCALES.mass
    stiffness = np.array([trial.by_name["stiffness"] for trial in trials])
    damping = np.array([trial.by_name["damping"] for trial in trials])
    rates = np.sqrt(stiffness / reduced) / (2.0 * np.pi)
    assert (rates[0], rates[-1]) == pytest.approx((4.0, 30.0))
    assert np.diff(np.log(rates)) == pytest.approx(np.log(7.5) / 5.0)
    assert damping / (2.0 * np.sqrt(stiffness * reduced)) == pytest.approx(0.05)


def test_periods_are_half_a_cycle_over_the_travel_apart() -> None:
    """Two that are nearer can't be told apart; less than a whole cycle of a force is a spring, of friction half of one."""
    for effect, law, fewest in (("ripple", "", 1.0), ("position_dependence", "periodic", 0.5)):
        candidate = of(NOMINAL, effect, law)
        cycles = np.unique(SCALES.travel / np.array([trial.by_name["period"] for trial in candidate.trials]))
        assert cycles == pytest.approx(np.arange(fewest, 24.1, 0.5))
        assert fewest_cycles(candidate.effect) == fewest


def test_friction_at_a_place_is_tried_inside_the_travel() -> None:
    places = np.unique([trial.by_name["position"] for trial in of(NOMINAL, "position_dependence", "local").trials])
    assert places == pytest.approx(np.linspace(-0.1, 0.3, 13)[1:-1])


def test_limits_are_tried_below_the_largest_force() -> None:
    limits = np.array([trial.by_name["limit"] for trial in of(NOMINAL, "saturation", "hard").trials])
    assert np.all(np.diff(limits) > 0.0)
    assert 0.25 * SCALES.most < limits[0] < limits[-1] < SCALES.most


def test_twice_the_force_is_tried_with_twice_the_amplitudes() -> None:
    """Whatever the unit of force is, the same terms are tried."""
    louder = replace(SCALES, level=20.0, range=80.0, most=40.0, mass=4.0)
    for one, other in zip(candidates(NOMINAL, SCALES), candidates(NOMINAL, louder), strict=True):
        assert one.effect is other.effect
        for k, p in enumerate(one.effect.parameters):
            if p.dimension.startswith("F") and p.default is None and not p.shape:
                values = np.array([[trial.values[k] for trial in each.trials] for each in (one, other)])
                assert values[1] == pytest.approx(2.0 * values[0])


@pytest.mark.parametrize(
    ("held", "place"),
    [
        (term("saturation", limit=5.0), "command path"),
        (term("backlash", gap=1e-4), "transmission"),
        (term("coulomb", force=5.0), FRICTION),
        (term("presliding", "dahl", stiffness=1e6), FRICTION),
        (term("bias", force=1.0), "load"),
    ],
    ids=lambda each: each if isinstance(each, str) else each.effect.id,
)
def test_a_technician_is_told_the_component(held: Term, place: str) -> None:
    assert place_of(held.effect) == place


@pytest.mark.parametrize("zero", [0.0, 1.5])
def test_a_spring_is_looked_for_where_the_axis_is_however_far_off_its_sensor_counts_from(zero: float) -> None:
    """Relaxed 1.4 m off a travel of 0.4 m, any spring would be a constant force within a seventh."""
    scales = replace(SCALES, low=SCALES.low + zero, high=SCALES.high + zero)
    for effect_id in ("stiffness", "nonlinear_stiffness"):
        offers = [each for each in candidates(NOMINAL, scales) if each.effect.id == effect_id]
        places = {trial.by_name["position"] for offer in offers for trial in offer.trials}
        assert sorted(places) == pytest.approx([0.0 if zero == 0.0 else 1.6])
