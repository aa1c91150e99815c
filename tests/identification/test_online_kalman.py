"""Kalman filters on the friction state: the truth of another integrator, rest, bounds, bad samples, and their square root."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fric.identification.online import ESTIMATORS, Estimate, Estimator, State, make_estimator
from fric.identification.online.loops import carry, collapse, correct, scatter, tell
from fric.model import Model, build_model, term
from fric.record import Record

NAMES = ("mass", "coulomb.force", "viscous.coefficient", "bias.force")
KINDS = ("ekf", "ukf")


def structure(*more: Any) -> Model:
    terms = [term("coulomb", force=1.0), term("viscous", coefficient=1.0), term("bias", force=0.0), *more]
    return build_model("rigid", {"mass": 1.0}, terms)


def feed(estimator: Estimator, record: Record, start: float = 0.0) -> None:
    for t, q, u in zip((record.time + start).tolist(), record.position.tolist(), record.effort.tolist(), strict=True):
        estimator.update(t, q, u)


def begun(kind: str, record: Record, *more: Any) -> Estimator:
    estimator = make_estimator(kind, structure(*more), hold="following")
    feed(estimator, record)
    return estimator


def value(estimate: Estimate, name: str) -> float:
    return float(estimate.values[estimate.names.index(name)])


@pytest.fixture(scope="module")
def plain(mover: Callable[..., Any]) -> Record:
    """Mass 2, Coulomb 8, viscous 15, bias 0.8, under noise and an encoder of a micrometre."""
    return mover(duration=12.0, asymmetry=0.0).record(noise=0.3, resolution=1e-6)


@pytest.mark.parametrize("kind", [KINDS[0], *(pytest.param(each, marks=pytest.mark.long) for each in KINDS[1:])])
def test_it_finds_an_axis_that_another_integrator_moved(kind: str, plain: Record) -> None:
    found = begun(kind, plain).estimate()
    truth = dict(zip(NAMES, (2.0, 8.0, 15.0, 0.8), strict=True))
    for name in NAMES:
        error = found.standard_errors[found.names.index(name)]
        assert abs(value(found, name) - truth[name]) < 4.0 * error, name
        assert error < 0.05 * truth[name], name
    assert np.all(found.excited)
    assert found.covariance == pytest.approx(found.covariance.T)
    assert found.status.startswith("every parameter is determined")


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_bristles_are_found_from_a_start_half_as_stiff_again(kind: str, mover: Callable[..., Any]) -> None:
    run = mover(duration=12.0, travel=0.03, top=4.0, asymmetry=0.0, stiffness=2e5, damping=400.0)
    found = begun(kind, run.record(noise=0.1, resolution=1e-8), term("presliding", stiffness=3e5, damping=600.0)).estimate()
    assert value(found, "presliding.stiffness") == pytest.approx(2e5, rel=0.15)
    assert value(found, "coulomb.force") == pytest.approx(8.0, rel=0.03)
    # The mass is least seen: the bristles' ringing, which would tell it, is over within ten samples.
    assert value(found, "mass") == pytest.approx(2.0, rel=0.06)


@pytest.mark.parametrize("kind", KINDS)
def test_at_rest_it_holds_everything_and_says_so(kind: str, plain: Record) -> None:
    estimator = begun(kind, plain)
    random = np.random.default_rng(4)
    rest = np.arange(1, 6001)
    where = plain.position[-1] + 1e-6 * (random.uniform(size=rest.size) < 0.1)
    push = 4.0 * np.sin(2e-3 * rest) + 0.3 * random.standard_normal(rest.size)
    samples = list(zip((plain.time[-1] + 0.01 * rest).tolist(), where.tolist(), push.tolist(), strict=True))
    for sample in samples[:20]:
        estimator.update(*sample)
    before = estimator.estimate()
    for sample in samples[20:]:
        estimator.update(*sample)
    after = estimator.estimate()
    np.testing.assert_allclose(after.values, before.values, rtol=1e-9)
    np.testing.assert_allclose(after.standard_errors, before.standard_errors, rtol=1e-2)
    assert after.samples_used == before.samples_used
    assert "held, not excited by the present motion: every parameter" in after.status


@pytest.mark.parametrize("kind", KINDS)
def test_constant_speed_holds_the_mass_and_names_it(kind: str, plain: Record) -> None:
    estimator = begun(kind, plain)
    before = estimator.estimate()
    random = np.random.default_rng(5)
    # Steady sliding in one direction tells one combination of friction and bias, and nothing of the mass.
    estimator.freeze(True)  # how it got to that speed isn't shown
    estimator.freeze(False)
    for k in range(1, 6001):
        noise = 0.3 * float(random.standard_normal())
        estimator.update(plain.time[-1] + 1e-3 * k, float(plain.position[-1]) + 2e-4 * k, 8.0 + 15.0 * 0.2 + 0.8 + noise)
    after = estimator.estimate()
    held = after.status.split("not excited by the present motion: ")[1]
    assert "mass" in held or held == "every parameter"
    for name in NAMES:
        assert value(after, name) == pytest.approx(value(before, name), rel=0.05), name
    assert np.all(after.standard_errors > 0.3 * before.standard_errors)


@pytest.mark.parametrize("kind", ESTIMATORS)
def test_a_step_of_friction_is_followed_within_three_seconds(kind: str, mover: Callable[..., Any]) -> None:
    before = mover(duration=12.0, asymmetry=0.0).record(noise=0.3, resolution=1e-6)
    after = mover(duration=3.0, seed=5, asymmetry=0.0, coulomb=12.0).record(noise=0.3, resolution=1e-6)
    estimator = make_estimator(kind, structure(), hold="following")
    for record, start in ((before, 0.0), (after, 20.0)):
        mean = 0.5 * (record.effort + np.r_[record.effort[0], record.effort[:-1]])
        feed(estimator, replace(record, effort=mean) if estimator.averages_force else record, start)
    assert value(estimator.estimate(), "coulomb.force") == pytest.approx(12.0, rel=0.05)


@pytest.mark.parametrize("kind", KINDS)
def test_bad_samples_are_refused_and_change_nothing(kind: str, plain: Record) -> None:
    clean, dirty = begun(kind, plain), make_estimator(kind, structure(), hold="following")
    rows = zip(plain.time.tolist(), plain.position.tolist(), plain.effort.tolist(), strict=True)
    for k, (t, q, u) in enumerate(rows):
        if k % 500 == 250:
            for bad in ((math.nan, q, u), (t, math.nan, u), (t, q, math.inf), (t - 0.0015, q + 1.0, u), (t - 0.001, q, 1e9)):
                assert dirty.update(*bad) is False
        dirty.update(t, q, u)
    assert dirty.samples_rejected == 24 * 5
    np.testing.assert_array_equal(dirty.estimate().values, clean.estimate().values)


@pytest.mark.parametrize("kind", KINDS)
def test_finite_nonsense_leaves_a_finite_estimate_within_bounds(kind: str, plain: Record) -> None:
    estimator = begun(kind, plain)
    random = np.random.default_rng(6)
    for k in range(1, 400):
        q, u = (float(x) for x in random.standard_normal(2) * (1e6, 1e9))
        estimator.update(plain.time[-1] + 1e-3 * k, q, u)
    feed(estimator, plain, plain.time[-1] + 5.0)
    found = estimator.estimate()
    assert np.all(np.isfinite(found.values))
    assert value(found, "mass") > 0.0
    assert value(found, "coulomb.force") >= 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_a_gap_a_clock_set_back_a_freeze_and_a_reset(kind: str, plain: Record) -> None:
    estimator = begun(kind, plain)
    before = estimator.estimate()
    for start in (3600.0, -500.0):  # an hour ahead, then back behind the start
        feed(estimator, replace(plain, position=plain.position + start), start)
        assert value(estimator.estimate(), "coulomb.force") == pytest.approx(8.0, rel=0.02)
    assert estimator.estimate().samples_used > 2 * before.samples_used
    estimator.freeze(True)
    held = estimator.estimate()
    assert held.state is State.FROZEN
    feed(estimator, replace(plain, effort=3.0 * plain.effort), 1000.0)
    np.testing.assert_array_equal(estimator.estimate().values, held.values)
    estimator.reset()
    assert estimator.estimate().samples_used == 0
    assert np.all(np.isnan(estimator.estimate().standard_errors))
    assert estimator.estimate().status == "frozen: unfreeze to continue the estimation"


def test_the_correction_is_that_of_the_textbook() -> None:
    # Two parameters, position and force; by the covariance form, which the square root never uses.
    random = np.random.default_rng(1)
    n, seen, noise = 4, 2, 0.3
    root = np.tril(random.standard_normal((n, n))) + 2.0 * np.eye(n)
    mean = random.standard_normal(n)
    covariance = root @ root.T
    gain = covariance[:, seen] / (covariance[seen, seen] + noise**2)
    y = mean[seen] + 0.7
    expected_mean = mean + gain * 0.7
    expected = covariance - np.outer(gain, covariance[seen])
    held = np.zeros(2)
    most, news, work = np.full(2, 1e9), np.zeros((2, 2)), np.empty((n, 3 * n + 5))
    correct(
        mean,
        root,
        seen,
        -1,
        1.0,
        2,
        y,
        noise,
        1e9,
        held,
        0.0,
        most,
        news,
        1.0,
        np.zeros(2),
        1.0,
        work,
        np.empty(n),
        np.zeros(3),
    )
    np.testing.assert_allclose(mean, expected_mean, rtol=1e-12)
    np.testing.assert_allclose(root @ root.T, expected, atol=1e-12)
    assert np.all(np.triu(root, 1) == 0.0)
    # The information on the parameters has grown by what their covariance has lost.
    gained = np.linalg.inv(expected[:2, :2]) - np.linalg.inv(covariance[:2, :2])
    np.testing.assert_allclose(news, gained, rtol=1e-9)


def test_a_parameter_that_is_held_keeps_value_and_variance() -> None:
    random = np.random.default_rng(2)
    n = 4
    root = np.tril(random.standard_normal((n, n))) + 2.0 * np.eye(n)
    mean = random.standard_normal(n)
    before, covariance = mean.copy(), root @ root.T
    work = np.empty((n, 3 * n + 5))
    correct(
        mean, root, 2, -1, 1.0, 2, 3.0, 0.3, 1e9, np.array([1.0, 0.0]), 0.01, np.full(2, 1e9), np.zeros((2, 2)), 1.0,
        np.zeros(2), 1.0, work, np.empty(n), np.zeros(3),
    )  # fmt: skip
    after = root @ root.T
    assert mean[0] == before[0]
    assert after[0, 0] == pytest.approx(covariance[0, 0], rel=1e-12)
    assert after[1, 1] < covariance[1, 1]
    assert mean[1] != before[1]


@pytest.mark.parametrize("unscented", [False, True])
def test_points_of_a_linear_system_give_its_mean_and_covariance(unscented: bool) -> None:
    random = np.random.default_rng(3)
    n_theta, n = 1, 4
    root = np.tril(random.standard_normal((n, n))) + 2.0 * np.eye(n)
    mean, system = random.standard_normal(n), random.standard_normal((n, n))
    system[0] = [1.0, 0.0, 0.0, 0.0]  # a parameter stays, and so does the force
    system[3] = [0.0, 0.0, 0.0, 1.0]
    width = math.sqrt(3.0)
    points = np.concatenate([[mean], mean + width * root.T, mean - width * root.T])
    moved = points @ system.T
    found, led, columns = np.empty(n), np.empty((n, n)), np.empty((n, n))
    work = np.empty((n, 3 * n + 5))
    collapse(
        points, np.ascontiguousarray(moved[:, 1:3]), np.empty((points.shape[0], 0)), n_theta, width, unscented, np.zeros(n),
        np.eye(n), columns, np.zeros(n), found, work, led,
    )  # fmt: skip
    np.testing.assert_allclose(columns, system @ root, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found, system @ mean, rtol=1e-9)
    np.testing.assert_allclose(led @ led.T, system @ root @ root.T @ system.T, rtol=1e-9, atol=1e-9)


def test_an_unknown_estimator_is_refused() -> None:
    with pytest.raises(ValueError, match="ekf, rls, ukf"):
        make_estimator("magic", structure())


def test_later_samples_tell_of_the_beginning_what_the_joint_distribution_of_all_does() -> None:
    # A parameter, position and velocity, and a force that is another in each interval; by conditioning all of them at once.
    random = np.random.default_rng(5)
    n, noise, force_noise = 4, 0.3, 0.5
    begun = np.tril(random.standard_normal((n, n))) + 2.0 * np.eye(n)
    begun[3] = [0.0, 0.0, 0.0, force_noise]
    mean, system = random.standard_normal(n), np.eye(n)
    system[1], system[2] = [0.1, 1.0, 0.4, 0.2], [0.3, -0.2, 0.9, 0.7]
    forces, seen = random.standard_normal(3), random.standard_normal(3)
    # Over all that is unknown: the beginning, and the forces of the second and third interval.
    slope, joint_mean = np.hstack([np.eye(n), np.zeros((n, 2))]), np.concatenate([mean[:3], forces])
    joint = np.zeros((n + 2, n + 2))
    joint[:n, :n] = begun @ begun.T
    joint[range(n, n + 2), range(n, n + 2)] = force_noise**2
    rows = []
    for k in range(3):
        if k:
            slope[3] = np.eye(n + 2)[n - 1 + k]
        slope = system @ slope
        rows.append(slope[1].copy())
    looked = np.array(rows)
    gain = joint @ looked.T @ np.linalg.inv(looked @ joint @ looked.T + noise**2 * np.eye(3))
    expected_mean = joint_mean + gain @ (seen - looked @ joint_mean)
    expected = joint - gain @ looked @ joint
    now, root = mean.copy(), begun.copy()
    now[3] = forces[0]
    columns, later, work = np.empty((n, n)), np.empty((n, n)), np.empty((n, 3 * n + 5))
    shift, narrow, widen = np.zeros(n), np.eye(n), np.eye(n)
    points, values, given = np.empty((2 * n + 1, n)), np.empty((2 * n + 1, 1)), np.empty(2 * n + 1)
    states, none = np.empty((2 * n + 1, 2)), np.empty((2 * n + 1, 0))
    for k in range(3):
        before = root.copy()
        scatter(
            now, root, 1.0, forces[k], force_noise, np.zeros(n), np.eye(n), np.ones(1), np.array([0]), np.zeros(1),
            np.full(1, -1e9), np.full(1, 1e9), points, values, given, states, none, none,
        )  # fmt: skip
        states[:] = (points @ system.T)[:, 1:3]
        collapse(points, states, none, 1, 1.0, False, np.zeros(n), np.eye(n), later, np.zeros(n), now, work, root)
        if k:
            carry(columns, before, later, work)
        else:
            columns[:] = later
        assert tell(now, root, 1, seen[k], noise, 1e9, columns, shift, narrow, widen, work)
    start = np.append(mean[:3], forces[0])
    np.testing.assert_allclose(start + begun @ shift, expected_mean[:n], rtol=1e-9)
    left = begun @ narrow
    np.testing.assert_allclose(left @ left.T, expected[:n, :n], atol=1e-9)
    np.testing.assert_allclose(narrow @ widen, np.eye(n), atol=1e-9)
