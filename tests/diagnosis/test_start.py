"""Where a diagnosis begins: values from which a fit starts, how a force is held, and which plant was recorded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric.diagnosis.start import (
    BANDWIDTHS,
    DiagnosisError,
    held_as,
    lateness,
    refuse_other_plant,
    spread_of,
    started,
    tracks_of,
)
from fric.diagnosis.track import Track
from fric.model import build_model, term
from fric.record import Record

from .small_axis import MASS, NOMINAL, STEP, followed, recorded


def test_the_spread_is_that_of_the_force_about_its_mean() -> None:
    """A slow force of 6 N beside one that is constant: the mean square of a sine is half of its square."""
    time = STEP * np.arange(5000)
    record = Record(time, 0.1 * np.sin(time), 100.0 + 6.0 * np.sin(2.0 * np.pi * time), effort_hold="following")
    track = Track.of([record], 400.0, NOMINAL)
    n = track.residual(NOMINAL).shape[0]
    assert spread_of(track) == pytest.approx(0.5 * 36.0 * n, rel=0.02)


def test_recordings_are_followed_as_fast_as_their_samples_allow() -> None:
    """No faster than one time constant per sample; slow samples get the one observer that they allow."""
    made = recorded(duration=10.0)
    assert [each.bandwidth for each in tracks_of([made], NOMINAL)] == list(BANDWIDTHS)
    for every, expected in ((3, [45.0, 140.0]), (4, [45.0]), (20, [25.0])):
        slow = Record(made.time[::every], made.position[::every], made.effort[::every])
        assert [each.bandwidth for each in tracks_of([slow], NOMINAL)] == pytest.approx(expected)
    contact = build_model("contact", {"mass": MASS}, NOMINAL.terms)
    assert [each.bandwidth for each in tracks_of([made], contact)] == [BANDWIDTHS[-1]]  # led along its motion, one is enough


def test_a_recording_without_two_hundred_good_samples_in_a_row_is_refused() -> None:
    made = recorded()
    gaps = np.arange(made.n_samples) % 150 != 0
    with pytest.raises(DiagnosisError, match="no valid part"):
        tracks_of([replace(made, valid=gaps)], NOMINAL)


def test_given_values_that_are_far_off_give_way_to_those_that_the_motion_tells() -> None:
    wrong = NOMINAL.with_values(np.array([3.0, 12.0, 5.0]))
    tracks, start = started(wrong, [recorded()])
    assert start.value("mass") == pytest.approx(2.0, rel=0.02)
    assert start.value("coulomb.force") == pytest.approx(4.0, rel=0.05)
    assert start.value("viscous.coefficient") == pytest.approx(20.0, rel=0.05)
    for track in tracks:
        # An axis of either mass is plausible: the one that was found and the one that was given.
        assert track.masses == (pytest.approx(2.0, rel=0.02), 3.0)


def test_what_is_noticeable_is_what_the_model_lacks_beside_what_noise_leaves() -> None:
    """Two newtons that the model can't have, beside noise of the position through two poles."""
    pull = term("bias", force=2.0)
    tracks, start = started(NOMINAL, [recorded(pull, noise=1e-6)])
    lacks, noise = tracks[0].noticeable or (0.0, 0.0)
    assert lacks == pytest.approx(2.0, rel=0.3)  # some of it in the friction's place
    again = Track.of([recorded(noise=1e-6)], 45.0, start)
    # What the true model leaves of a recording that lacks nothing.
    assert noise == pytest.approx(float(np.sqrt(np.mean(again.residual(NOMINAL) ** 2))), rel=0.5)


def test_values_that_are_to_be_taken_as_given_are_only_fitted_further() -> None:
    """The standard errors of the file belong to its values, and go."""
    given = replace(NOMINAL, standard_errors={"mass": 0.1})
    _, start = started(given, [recorded()], as_given=True)
    assert start.standard_errors == {}
    assert start.value("mass") == pytest.approx(2.0, rel=0.02)


@pytest.mark.parametrize("hold", ["following", "preceding"])
def test_a_force_whose_hold_is_stated_is_not_late(hold: str) -> None:
    assert lateness([replace(recorded(), effort_hold=hold)], NOMINAL) == 0.0


def test_a_force_whose_hold_nobody_states_comes_late_by_what_fits() -> None:
    """It was held from its stamp to the next, which is half a sample late; a delay of the model takes that in."""
    made = replace(recorded(), effort_hold="unknown")
    assert lateness([made], NOMINAL) == pytest.approx(0.5, abs=0.1)
    early = replace(made, effort=np.append(0.0, made.effort[:-1]))
    assert lateness([early], NOMINAL) == pytest.approx(-0.5, abs=0.1)
    late = NOMINAL.with_terms((*NOMINAL.terms, term("delay", time=1e-3)))
    assert lateness([made], late) == 0.0


def test_a_delay_of_several_samples_is_none_of_the_hold() -> None:
    made = replace(recorded(), effort_hold="unknown")
    delayed = replace(made, effort=np.concatenate([made.effort[4:], np.zeros(4)]))
    assert lateness([delayed], NOMINAL) == 0.0


def test_it_is_said_what_is_taken_for_the_hold() -> None:
    track = followed()
    assert held_as(track) == []
    (late,) = held_as(replace(track, late=0.5))
    assert "0.5 of a sample (1 ms) after its stamps" in late
    (early,) = held_as(replace(track, late=-0.25))
    assert "0.25 of a sample (0.5 ms) before its stamps" in early
    assert held_as(replace(track, late=0.05)) == []


def test_a_plant_that_cannot_move_like_the_recording_is_refused() -> None:
    """A cart with a pole shows the swing of the pole, which a plain mass has not."""
    made = recorded()
    terms = [term("coulomb", force=4.0), term("viscous", coefficient=20.0)]
    cart = build_model("cart_pendulum", {"cart_mass": 1.0, "pole_mass": 1.0, "length": 0.5, "pole_inertia": 0.08}, terms)
    with pytest.raises(DiagnosisError, match=r"is of no 'cart_pendulum'.*plant 'rigid'"):
        refuse_other_plant([made], Track.of([made], 140.0, cart), cart)


def test_a_plant_that_holds_the_recorded_one_as_a_case_is_none_other() -> None:
    """A pendulum whose weight comes out at nothing is a mass; where both lack much, neither plant is the reason."""
    made = recorded()
    terms = [term("coulomb", force=4.0), term("viscous", coefficient=20.0)]
    pendulum = build_model("pendulum", {"inertia": 2.0, "gravity": 1.0}, terms)
    refuse_other_plant([made], Track.of([made], 140.0, pendulum), pendulum)
    strange = recorded(term("ripple", cosine=8.0, sine=0.0, period=0.05))
    refuse_other_plant([strange], Track.of([strange], 140.0, pendulum), pendulum)
