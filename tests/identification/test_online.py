"""Online identification: what offline finds, held at rest, following a change, undisturbed by bad samples and clocks."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fric.identification import METHODS
from fric.identification.calibration import AXES, recording
from fric.identification.online import Estimate, OnlineIdentifier, State
from fric.identification.result import Options
from fric.model import Model, build_model, term
from fric.record import Record

NAMES = ("mass", "coulomb.force", "viscous.coefficient", "bias.force")


def structure() -> Model:
    terms = [term("coulomb", force=1.0), term("viscous", coefficient=1.0), term("bias", force=0.0)]
    return build_model("rigid", {"mass": 1.0}, terms)


def feed(identifier: OnlineIdentifier, record: Record, start: float = 0.0) -> None:
    force = 0.5 * (record.effort + np.r_[record.effort[0], record.effort[:-1]])
    for t, q, u in zip((record.time + start).tolist(), record.position.tolist(), force.tolist(), strict=True):
        identifier.update(t, q, u)


def value(estimate: Estimate, name: str) -> float:
    return float(estimate.values[estimate.names.index(name)])


def error(estimate: Estimate, name: str) -> float:
    return float(estimate.standard_errors[estimate.names.index(name)])


def test_for_ever_remembering_it_ends_where_offline_ends(mover: Callable[..., Any]) -> None:
    record = mover(asymmetry=0.0).record(noise=0.3, resolution=1e-6)
    options = Options(rest_velocity=0.005)
    identifier = OnlineIdentifier(structure(), math.inf, options)
    feed(identifier, record)
    found = identifier.estimate()
    offline = METHODS["inverse-dynamics"].fit(structure(), [replace(record, effort_hold="following")], options).model
    for name in NAMES:
        assert value(found, name) == pytest.approx(offline.value(name), rel=0.02 if name == "bias.force" else 0.01), name
        assert error(found, name) == pytest.approx(offline.standard_errors[name], rel=0.6), name
    assert np.all(found.excited)
    assert found.status == "every parameter is determined"


@pytest.mark.parametrize("encoder", [0.0, 1e-6])
def test_ten_minutes_of_rest_change_nothing(mover: Callable[..., Any], encoder: float) -> None:
    record = mover(duration=15.0, asymmetry=0.0).record(noise=0.3, resolution=1e-6)
    identifier = OnlineIdentifier(structure(), 20.0)
    feed(identifier, record)
    before = identifier.estimate()
    rng = np.random.default_rng(7)
    # 100 Hz would do for a rest; 250 Hz keeps the blocks like those before. The encoder flickers by a count, the drive pushes.
    n = 600 * 250
    where = record.position[-1] + encoder * (rng.uniform(size=n) < 0.1)
    push = 4.0 * np.sin(2 * np.pi * 0.05 * np.arange(n) / 250) + 0.3 * rng.standard_normal(n)
    for k in range(n):
        identifier.update(20.0 + k / 250, float(where[k]), float(push[k]))
    after = identifier.estimate()
    for name in NAMES:
        assert value(after, name) == pytest.approx(value(before, name), rel=1e-3), name
        assert error(after, name) == pytest.approx(error(before, name), rel=0.05), name


def test_it_follows_a_step_of_friction(mover: Callable[..., Any]) -> None:
    first = mover(duration=15.0, asymmetry=0.0).record(noise=0.3, resolution=1e-6)
    second = mover(duration=30.0, seed=5, asymmetry=0.0, coulomb=12.0).record(noise=0.3, resolution=1e-6)
    identifier = OnlineIdentifier(structure(), 5.0)
    feed(identifier, first)
    assert value(identifier.estimate(), "coulomb.force") == pytest.approx(8.0, rel=0.02)
    feed(identifier, second, start=20.0)
    found = identifier.estimate()
    assert value(found, "coulomb.force") == pytest.approx(12.0, rel=0.02)
    assert value(found, "mass") == pytest.approx(2.0, rel=0.02)


@pytest.mark.parametrize("delay", np.arange(8) / 8 * 0.65)
def test_wherever_in_a_block_the_step_falls_it_is_followed_within_two_seconds(delay: float) -> None:
    """An axis with a Coulomb force of 6 N, from ``delay`` after 10 s on of 9 N, by an integrator of its own."""
    step, fine = 0.002, 20
    time = step * np.arange(7000)
    force = sum(a * np.sin(2 * np.pi * f * time + p) for a, f, p in ((14, 0.7, 0.0), (9, 1.9, 1.0), (7, 4.3, 2.0)))
    position, x, v = np.zeros(time.size), 0.0, 0.0
    for k in range(1, time.size):
        level = 6.0 if time[k] < 10.0 + delay else 9.0
        for _ in range(fine):
            free = v + step / fine * (force[k - 1] - 40.0 * v - 2.0) / 2.0
            v = math.copysign(max(abs(free) - step / fine * level / 2.0, 0.0), free)
            x += step / fine * v
        position[k] = x
    noise = np.random.default_rng(7)
    record = Record(time, np.round(position / 1e-7) * 1e-7, force + noise.normal(0.0, 0.3, time.size), effort_hold="following")
    identifier = OnlineIdentifier(structure(), 60.0)
    n = int((10.0 + delay) / step)
    feed(identifier, record.slice(0, n))
    assert value(identifier.estimate(), "coulomb.force") == pytest.approx(6.0, rel=0.02)
    feed(identifier, record.slice(n, n + 1000))
    assert value(identifier.estimate(), "coulomb.force") == pytest.approx(9.0, rel=0.05)


def test_bad_samples_are_refused_counted_and_do_no_harm(mover: Callable[..., Any]) -> None:
    record = mover(duration=15.0, asymmetry=0.0).record(noise=0.3, resolution=1e-6)
    clean = OnlineIdentifier(structure(), 30.0)
    feed(clean, record)
    dirty = OnlineIdentifier(structure(), 30.0)
    force = 0.5 * (record.effort + np.r_[record.effort[0], record.effort[:-1]])
    for k, (t, q, u) in enumerate(zip(record.time.tolist(), record.position.tolist(), force.tolist(), strict=True)):
        if k % 500 == 250:
            for bad in ((math.nan, q, u), (t, math.nan, u), (t, q, math.inf), (t - 0.0015, q + 1.0, u), (t - 0.001, q, 1e9)):
                assert dirty.update(*bad) is False
        dirty.update(t, q, u)
    assert dirty.samples_rejected == 30 * 5
    np.testing.assert_allclose(dirty.estimate().values, clean.estimate().values, rtol=1e-9)


def test_a_clock_that_jumps_costs_a_block_and_no_more(mover: Callable[..., Any]) -> None:
    record = mover(duration=30.0, asymmetry=0.0).record(noise=0.3, resolution=1e-6)
    identifier = OnlineIdentifier(structure(), math.inf)
    force = 0.5 * (record.effort + np.r_[record.effort[0], record.effort[:-1]])
    for k, (t, q, u) in enumerate(zip(record.time.tolist(), record.position.tolist(), force.tolist(), strict=True)):
        # An hour ahead after 10 s, then back behind the start after 20 s.
        jump = 0.0 if k < 10_000 else 3600.0 if k < 20_000 else -500.0
        identifier.update(t + jump, q, u)
    found = identifier.estimate()
    assert value(found, "mass") == pytest.approx(2.0, rel=0.02)
    assert value(found, "coulomb.force") == pytest.approx(8.0, rel=0.02)
    assert found.samples_used > 18_000


@pytest.mark.long
@pytest.mark.parametrize("forgetting_time", [60.0, 5.0])
def test_standard_errors_are_the_spread_of_the_estimates_under_coloured_noise(
    mover: Callable[..., Any], forgetting_time: float
) -> None:
    run = mover(duration=12.0, asymmetry=0.0)
    values, errors = [], []
    for seed in range(14):
        identifier = OnlineIdentifier(structure(), forgetting_time)
        feed(identifier, run.record(noise=1.0, seed=seed, colour=0.9))
        found = identifier.estimate()
        values.append([value(found, name) for name in NAMES])
        errors.append([error(found, name) for name in NAMES])
    ratio = np.mean(errors, axis=0) / np.std(values, axis=0, ddof=1)
    # The spread of 14 runs is itself known to a fifth; textbook errors for white noise would come out four times too small.
    assert np.all((ratio > 0.5) & (ratio < 2.5)), ratio


def test_rests_between_reversals_do_not_shift_the_estimates() -> None:
    # Slow reversals with rests at the start, then a multisine: the friction that holds the joint is carried into rows nearby.
    axis = AXES["rigid"]
    scores = []
    for seed in range(400, 416):
        identifier = OnlineIdentifier(axis.start)
        feed(identifier, recording(axis, seed))
        found = identifier.estimate()
        scores.append([(value(found, name) - axis.truth.value(name)) / error(found, name) for name in NAMES])
    # The mean of sixteen has a standard deviation of a quarter.
    assert np.all(np.abs(np.mean(scores, axis=0)) < 0.75), np.mean(scores, axis=0)


def test_before_motion_nothing_is_known_and_it_says_so() -> None:
    identifier = OnlineIdentifier(structure())
    for k in range(5000):
        identifier.update(1e-3 * k, 0.3, 1.0)
    found = identifier.estimate()
    assert found.samples_used == 0
    assert np.all(np.isnan(found.standard_errors))
    assert not np.any(found.excited)
    assert found.status == "waiting for motion"
    np.testing.assert_allclose(found.values, structure().values)


def test_one_direction_at_constant_speed_determines_nothing_alone() -> None:
    identifier = OnlineIdentifier(structure())
    rng = np.random.default_rng(1)
    for k in range(8000):
        identifier.update(1e-3 * k, 2e-4 * k, 8.0 + 15.0 * 0.2 + 0.8 + 0.1 * float(rng.standard_normal()))
    found = identifier.estimate()
    assert not np.any(found.excited)
    assert "not determined yet" in found.status


def test_freeze_holds_and_reset_forgets(mover: Callable[..., Any]) -> None:
    record = mover(duration=15.0, asymmetry=0.0).record(noise=0.3)
    identifier = OnlineIdentifier(structure(), 30.0)
    feed(identifier, record)
    before = identifier.estimate().values
    identifier.freeze(True)
    assert identifier.estimate().state is State.FROZEN
    feed(identifier, replace(record, effort=3.0 * record.effort), start=100.0)
    np.testing.assert_array_equal(identifier.estimate().values, before)
    identifier.freeze(False)
    feed(identifier, record, start=200.0)
    assert identifier.estimate().samples_used > 20_000
    identifier.reset()
    assert identifier.estimate().samples_used == 0
    np.testing.assert_array_equal(identifier.estimate().values, structure().values)


def test_slip_dynamics_stay_as_given_in_the_model(mover: Callable[..., Any]) -> None:
    whole = structure().with_terms([*structure().terms, term("presliding", stiffness=1e6, damping=500.0)])
    identifier = OnlineIdentifier(whole, 30.0)
    feed(identifier, mover(duration=15.0, asymmetry=0.0).record(noise=0.3))
    model = identifier.model()
    assert model.value("presliding.stiffness") == 1e6
    assert model.value("coulomb.force") == pytest.approx(8.0, rel=0.02)
    assert set(model.standard_errors) == set(NAMES)
