"""What terms are credited with on blocks that they haven't seen, and what is told beside something unknown."""

from __future__ import annotations

import numpy as np
import pytest
from fric.diagnosis.at_once import helped
from fric.diagnosis.exchange import exchanged_at
from fric.diagnosis.fitting import free_names, left_beside, refit, unseen, without_term
from fric.diagnosis.growth import Growth
from fric.diagnosis.track import Track
from fric.model import Model, build_model, term
from fric.record import Record
from fric.simulation import simulate

H = 1e-3
TRUTH = build_model("rigid", {"mass": 60.0}, [term("coulomb", force=20.0), term("viscous", coefficient=120.0)])
NOMINAL = build_model("rigid", {"mass": 57.0}, [term("coulomb", force=21.0), term("viscous", coefficient=110.0)])


def recording(truth: Model, seed: int, unseen_force: float = 0.0, duration: float = 12.0) -> Record:
    """Back and forth at up to 0.4 m/s under a force that a speed loop would give; some of what acts isn't recorded."""
    random = np.random.default_rng(seed)
    time = H * np.arange(round(duration / H))
    speed = 0.3 * np.sin(2 * np.pi * 0.5 * time + seed) + 0.1 * np.sin(2 * np.pi * 1.3 * time)
    effort = 60.0 * np.gradient(speed, H) + 20.0 * np.tanh(speed / 1e-3) + 120.0 * speed
    moved = simulate(truth, effort, H, n_substeps=4)
    position = np.round((moved.position + 2e-8 * random.standard_normal(time.size)) / 2e-8) * 2e-8
    # A force that forgets itself within 5 ms.
    kernel = np.exp(-H * np.arange(50) / 5e-3)
    restless = np.convolve(random.standard_normal(time.size + kernel.size - 1), kernel, "valid") / np.linalg.norm(kernel)
    recorded = effort + unseen_force * restless + 0.05 * random.standard_normal(time.size)
    return Record(time, position, recorded, source=f"bag {seed}")


def test_a_term_that_comes_out_at_nothing_is_credited_with_nothing() -> None:
    """Friction falls short where a drag would add to it: a drag of less than nothing would explain it, and there is none."""
    held = recording(TRUTH, 1)
    speed = np.gradient(held.position, H)
    less = Record(held.time, held.position, held.effort - 150.0 * speed * np.abs(speed), source="bag")
    track = Track.of([less], 140.0, NOMINAL)
    without = track.fit(NOMINAL, free_names(NOMINAL))
    dragged = NOMINAL.with_terms([*without.model.terms, term("quadratic_drag", coefficient=1.0)])
    fit = track.fit(dragged, free_names(dragged))
    assert fit.model.value("quadratic_drag.coefficient") == 0.0
    assert unseen(track, fit, fit.residual) == pytest.approx(unseen(track, without, without.residual), rel=0.01)
    # What a drag of less than nothing would be credited with at first order, all columns free, is far more than that.
    answer = np.linalg.lstsq(fit.jacobian, -fit.residual, rcond=None)[0]
    freely = fit.residual + fit.jacobian @ answer
    assert float(freely @ freely) < 0.5 * float(fit.residual @ fit.residual)


@pytest.mark.long
def test_what_helps_is_told_beside_something_unknown() -> None:
    """A restless force of 3 N holds many times a ripple's energy: the ripple takes too little to explain it, and helps."""
    truth = TRUTH.with_terms([*TRUTH.terms, term("ripple", cosine=0.7, sine=-0.55, period=0.031)])
    track = Track.of([recording(truth, 1, 3.0), recording(truth, 2, 3.0)], 140.0, NOMINAL)
    state = refit(track, NOMINAL)
    nothing = Growth(track, state, state, (), (), 1.0)
    found = helped([track], nothing, lambda _: None)
    assert found.unhelped is nothing
    assert found.rest < 1.0
    ripple = dict(zip(found.end.fit.model.prefixes, found.end.fit.model.terms, strict=True))["ripple"]
    cosine, sine, period = ripple.values
    assert period == pytest.approx(0.031, rel=0.01)
    assert np.hypot(cosine, sine) == pytest.approx(0.89, rel=0.15)


def test_what_hung_on_a_body_is_part_of_it_again_without_the_spring() -> None:
    hanging = term("compliance", "appendage", mass=1.5, frequency=300.0, damping=0.05)
    grown = build_model("rigid", {"mass": 2.5}, [hanging, term("coulomb", force=3.0)])
    assert without_term(grown, "compliance").values.tolist() == [4.0, 3.0]
    assert without_term(grown, "coulomb").value("mass") == 2.5
    # Behind a transmission it hung on the load: motor and load keep their masses.
    between = term("impact_backlash", gap=1e-5, stiffness=2e5, damping=80.0)
    driven = build_model("rigid", {"mass": 2.5, "load_share": 0.2}, [hanging, between])
    left = without_term(driven, "compliance")
    assert left.value("mass") * (1.0 - left.value("load_share")) == pytest.approx(2.5 * 0.8)
    assert left.value("mass") * left.value("load_share") == pytest.approx(2.5 * 0.2 + 1.5)


def test_what_is_led_otherwise_counts_alike() -> None:
    """Without dry friction a model lacks it: pushed, it shows all of that, and less where its position is set."""
    smooth = build_model("rigid", {"mass": 60.0}, [term("viscous", coefficient=120.0)])
    bristles = term("presliding", "lugre", stiffness=1e8, damping=1e4)
    track = Track.of([recording(TRUTH, 1)], 140.0, smooth)
    pushed, put = refit(track, smooth), refit(track, smooth.with_terms((*smooth.terms, bristles)))
    assert left_beside(track, pushed, False) == pushed.left
    assert left_beside(track, put, True) == put.left
    # Bristles without a level carry no force: both are the same model, led in two ways.
    assert pushed.left > 1.05 * put.left
    assert left_beside(track, pushed, True) == pytest.approx(put.left, rel=0.05)


def test_a_term_by_another_law_is_found_where_the_order_of_terms_puts_it() -> None:
    """What depends on the direction stands behind what lags, so that another law changes the places of terms."""
    model = NOMINAL.with_terms(
        [*NOMINAL.terms, term("stribeck", force=5.0, velocity=0.01), term("frictional_lag", law="first_order", time=0.01)]
    )
    place = [held.effect.id for held in model.terms].index("stribeck")
    directional = term("stribeck", law="directional", force=5.0, difference=3.0, velocity=0.01)
    other, now = exchanged_at(model, place, directional)
    assert now != place
    assert other.terms[now] is directional
    assert sorted(held.effect.id for held in other.terms) == sorted(held.effect.id for held in model.terms)
