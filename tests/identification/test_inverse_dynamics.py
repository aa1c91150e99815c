"""Inverse dynamics on an axis simulated elsewhere: values, standard errors, and what it says when a recording can't tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fric.identification import METHODS
from fric.identification.equations import equations, nominal_conditions, surroundings
from fric.identification.filter_bias import residual_of_filters
from fric.identification.methods import inverse_dynamics
from fric.identification.result import Identification, IdentificationError, Options
from fric.identification.scoring import force_along, score
from fric.model import Model, Term, build_model, term
from fric.record import Record, RecordError
from scipy import signal

FIT = METHODS["inverse-dynamics"].fit


def structure(*more: Term, asymmetry: bool = True) -> Model:
    terms = [term("coulomb", force=1.0), term("viscous", coefficient=1.0), term("bias", force=0.0), *more]
    return build_model("rigid", {"mass": 1.0}, [*terms, term("asymmetry")] if asymmetry else terms)


TRUE = {"mass": 2.0, "coulomb.force": 8.0, "viscous.coefficient": 15.0, "bias.force": 0.8, "asymmetry.coefficient": 2.0}


def assert_near(found: Identification, expected: dict[str, float], percent: float, errors: float = 4.0) -> None:
    for name, value in expected.items():
        got, error = found.model.value(name), found.model.standard_errors[name]
        assert abs(got - value) <= errors * error + 5e-3 * abs(value), (name, got, value, error)
        assert abs(got - value) <= 0.01 * percent * abs(value), (name, got, value)


def test_parameters_come_back_from_quantised_and_noisy_signals(slider: Any) -> None:
    found = FIT(structure(), [slider.record(noise=0.3, resolution=1e-7)], Options(cutoff=100.0, decimation=2))
    assert_near(found, TRUE, percent=4.0)
    assert found.model.value("mass") == pytest.approx(2.0, rel=0.005)
    assert found.model.value("coulomb.force") == pytest.approx(8.0, rel=0.005)
    assert found.train.relative_force_error_percent < 10.0
    assert found.status.startswith("converged")


def test_least_squares_is_what_numpy_finds_on_equations_built_here(monkeypatch: pytest.MonkeyPatch) -> None:
    # What errors of the position do is taken off afterwards (tests/bench/test_dirt.py).
    monkeypatch.setattr(inverse_dynamics, "noise_bias", lambda model, found, free, *_: np.zeros(free.index.shape[0]))
    # A motion that never stands still, where the sign of the velocity would be a matter of rounding.
    rng, time = np.random.default_rng(4), 1e-3 * np.arange(12_000)
    position = 0.05 * np.sin(4.0 * time) + 0.01 * np.sin(11.0 * time + 1.0) + 1e-6 * rng.standard_normal(time.size)
    velocity = 0.2 * np.cos(4.0 * time) + 0.11 * np.cos(11.0 * time + 1.0)
    acceleration = np.gradient(velocity, time)
    effort = 2.0 * acceleration + 8.0 * np.sign(velocity) + 15.0 * velocity + 0.8 + 2.0 * np.abs(velocity)
    record = Record(time, position, effort + 0.3 * rng.standard_normal(time.size), effort_hold="following")
    cutoff, keep, h = 100.0, 10, 1e-3
    found = FIT(structure(), [record], Options(cutoff=cutoff, decimation=keep, rest_velocity=0.0, held=("asymmetry.force",)))
    # The published recipe: zero-phase Butterworth on both sides, differences, zero-phase decimation of both sides.
    sos = signal.butter(4, cutoff, fs=1.0 / h, output="sos")
    q = signal.sosfiltfilt(sos, record.position)
    a = np.r_[0.0, np.diff(q, 2) / h**2, 0.0]
    v = signal.savgol_filter(q, 9, 8, deriv=1, delta=h)
    v = np.convolve(v, np.array([1.0, 10.0, 1.0]) / 12.0, "same")
    u = record.effort
    force = signal.sosfiltfilt(sos, 0.5 * (u + np.r_[u[0], u[:-1]]))  # held from sample to sample: the mean around the instant
    x = np.abs(np.arange(-keep, keep + 1)) / (keep + 0.5)
    window = np.where(x < 0.5, 1.0 - 6.0 * x**2 + 6.0 * x**3, 2.0 * (1.0 - x) ** 3)
    edge = 50  # five periods of the cutoff
    columns = [np.sign(v), v, np.ones_like(v), np.abs(v), a, force]
    thin = np.stack([np.convolve(column, window / np.sum(window), "same")[edge:-edge:keep] for column in columns], axis=1)
    rows, target = thin[:, :5], thin[:, 5]
    # Without a limit nothing rests but what stands still to the last digit.
    expected, *_ = np.linalg.lstsq(rows, target, rcond=None)
    names = ("coulomb.force", "viscous.coefficient", "bias.force", "asymmetry.coefficient", "mass")
    np.testing.assert_allclose([found.model.value(name) for name in names], expected, rtol=1e-5)


def test_rests_between_strokes_leave_no_trace_in_the_values(slider: Any) -> None:
    """The axis sticks at most reversals, for some ten milliseconds: exact signals have to give exact values all the same."""
    found = FIT(structure(), [slider.record()], Options(cutoff=50.0))
    for name, value, rel in (
        ("mass", 2.0, 0.002),
        ("coulomb.force", 8.0, 0.005),
        ("viscous.coefficient", 15.0, 0.01),
        ("bias.force", 0.8, 0.01),
    ):
        assert found.model.value(name) == pytest.approx(value, rel=rel), name


def test_rows_that_a_rest_reaches_into_are_told_from_the_others() -> None:
    # There, a rest of 0.2 s, and back: known to the sample. It accelerates between its reversals too.
    h, speed = 1e-3, 0.1
    velocity = np.concatenate([np.full(2000, speed), np.zeros(200), np.full(2000, -speed), np.full(1000, speed)])
    time = h * np.arange(velocity.shape[0])
    velocity *= 1.0 + 0.5 * np.sin(2.0 * np.pi * 3.0 * time)
    found = equations([Record(time, h * np.cumsum(velocity), np.sign(velocity))], Options(cutoff=50.0))
    rested = (found.time > 1.995) & (found.time < 2.205)
    assert not np.any(found.clear[rested])
    # Two row times on either side: the window, and what the filter on the position carries.
    far = (found.time < 1.95) | (found.time > 2.25)
    turned = (found.time > 4.15) & (found.time < 4.25)
    assert np.all(found.clear[far & ~turned])
    assert not np.any(found.clear[(found.time > 4.19) & (found.time < 4.21)]), "a filter of 50 Hz turns late"
    quick = equations([Record(time, h * np.cumsum(velocity), np.sign(velocity))], Options(cutoff=100.0))
    assert np.all(quick.clear[(quick.time > 4.15) & (quick.time < 4.25)]), "a reversal without a rest is clear"
    assert np.sum(found.sliding & ~found.clear) >= 2


def test_what_filters_take_from_bristles_is_known_from_a_simulation(bristled: Any) -> None:
    """The equations of exact signals miss at the true values what the simulation of the same motion says they must."""
    truth = build_model(
        "rigid",
        {"mass": 2.0},
        [
            term("coulomb", force=8.0),
            term("viscous", coefficient=15.0),
            term("bias", force=0.8),
            term("asymmetry", coefficient=2.0),
            term("presliding", stiffness=2e5, damping=400.0),
        ],
    )
    found = equations([bristled.record()], Options(cutoff=120.0, decimation=5), truth)
    measured = found.force - found.rows(lambda stretch: force_along(truth, stretch))
    expected = residual_of_filters(truth, found)
    assert np.corrcoef(measured, expected)[0, 1] > 0.8
    assert np.linalg.norm(measured - expected) < 0.6 * np.linalg.norm(measured)


def test_ninety_percent_intervals_hold_what_they_promise_under_coloured_noise(slider: Any) -> None:
    # 0.9 per sample: a correlation time of 10 ms, noise that a filter at 100 Hz lets through.
    estimates, errors = [], []
    names = [name for name in TRUE if name != "asymmetry.coefficient"]
    shorter = slice(0, 8000)
    for seed in range(60):
        record = slider.record(noise=1.0, seed=seed, colour=0.9)
        record = Record(record.time[shorter], record.position[shorter], record.effort[shorter], effort_hold="following")
        found = FIT(structure(), [record], Options())
        estimates.append([found.model.value(name) for name in names])
        errors.append([found.model.standard_errors[name] for name in names])
    # Around the mean of the estimates: coverage is about the spread; bias has tests of its own.
    off = np.array(estimates) - np.mean(estimates, axis=0)
    inside = np.abs(off) <= 1.645 * np.array(errors)
    assert 0.80 <= np.mean(inside) <= 0.97, np.mean(inside, axis=0)
    assert np.all(np.mean(inside, axis=0) >= 0.75), np.mean(inside, axis=0)


def test_estimates_are_unbiased_over_noise(slider: Any) -> None:
    estimates = [
        [FIT(structure(), [slider.record(noise=0.5, seed=seed)], Options()).model.value(name) for name in TRUE]
        for seed in range(8)
    ]
    off = np.abs(np.mean(estimates, axis=0) / np.array(list(TRUE.values())) - 1.0)
    assert np.all(off < [0.01, 0.015, 0.03, 0.15, 0.15]), off


def test_a_bias_and_an_asymmetric_level_are_named_and_one_is_held(slider: Any) -> None:
    found = FIT(structure(), [slider.record(noise=0.3)], Options())
    assert "asymmetry.force" not in found.fitted
    assert found.model.value("asymmetry.force") == 0.0
    assert "asymmetry.force" not in found.model.standard_errors
    (message,) = [line for line in found.warnings if line.startswith("asymmetry.force")]
    assert "bias.force" in message
    assert "held at 0" in message
    assert "push the resting body from both sides" in message


def test_motion_in_one_direction_only_is_recognised() -> None:
    # 10 s, never below 0.05 m/s.
    t = 1e-3 * np.arange(10_000)
    v = 0.15 + 0.1 * np.sin(2 * np.pi * 0.7 * t)
    a = 0.1 * 2 * np.pi * 0.7 * np.cos(2 * np.pi * 0.7 * t)
    q = np.cumsum(v) * 1e-3
    u = 2.0 * a + 8.0 + 15.0 * v + 0.8 + 0.1 * np.random.default_rng(1).standard_normal(t.shape[0])
    found = FIT(structure(asymmetry=False), [Record(t, q, u)], Options())
    text = " ".join(found.warnings)
    assert "coulomb.force" in text
    assert "bias.force" in text
    assert {"coulomb.force", "bias.force"} - set(found.fitted), "a constant can't be split into two"
    held = ({"coulomb.force", "bias.force"} - set(found.fitted)).pop()
    total = found.model.value("coulomb.force") + found.model.value("bias.force")
    assert total == pytest.approx(8.8, rel=0.02), held


def test_phases_at_rest_do_not_enter(pauser: Any) -> None:
    record = pauser.record(noise=0.3, resolution=1e-6)
    found = FIT(structure(), [record], Options())
    assert_near(found, TRUE, percent=15.0)
    (note,) = [note for note in found.notes if "at rest" in note]
    assert 4.5 < float(note.split(" s at rest")[0].split()[-1]) < 8.0


def test_a_recording_of_a_resting_joint_is_refused() -> None:
    t = 1e-3 * np.arange(5000)
    rng = np.random.default_rng(1)
    still = np.full(5000, 0.123)
    encoder = still + 1e-6 * np.round(rng.standard_normal(5000))
    for position in (still, encoder):
        with pytest.raises(IdentificationError, match="hardly moves"):
            FIT(structure(), [Record(t, position, rng.standard_normal(5000))], Options())


def test_spikes_in_the_force_hardly_touch_a_robust_fit(slider: Any) -> None:
    record = slider.record(noise=0.3)
    rng = np.random.default_rng(2)
    spiked = record.effort.copy()
    spiked[rng.choice(spiked.shape[0], 40, replace=False)] += 400.0
    bad = replace(record, effort=spiked)
    robust = FIT(structure(), [bad], Options(robust=True)).model
    plain = FIT(structure(), [bad], Options()).model
    assert robust.value("coulomb.force") == pytest.approx(8.0, rel=0.02)
    assert robust.value("bias.force") == pytest.approx(0.8, rel=0.15)
    assert abs(plain.value("bias.force") - 0.8) > 3 * abs(robust.value("bias.force") - 0.8)


def test_the_stribeck_curve_comes_back(creeper: Any) -> None:
    found = FIT(structure(term("stribeck", force=0.0, velocity=0.3)), [creeper.record(noise=0.2, resolution=1e-7)], Options())
    assert found.model.value("stribeck.velocity") == pytest.approx(0.02, rel=0.08)
    assert found.model.value("stribeck.force") == pytest.approx(4.0, rel=0.06)
    assert found.model.value("coulomb.force") == pytest.approx(8.0, rel=0.03)
    for name, value in (("stribeck.velocity", 0.02), ("stribeck.force", 4.0)):
        assert abs(found.model.value(name) - value) < 5 * found.model.standard_errors[name]


def test_a_stribeck_effect_that_is_not_there_is_reported_as_such(slider: Any) -> None:
    options = Options(cutoff=100.0, decimation=2)
    found = FIT(structure(term("stribeck", force=1.0, velocity=0.01)), [slider.record(noise=0.3)], options)
    assert found.model.value("stribeck.force") < 0.2
    assert found.model.value("coulomb.force") == pytest.approx(8.0, rel=0.02)
    assert "stribeck" in found.status


def test_the_stiffness_of_the_bristles_comes_back(bristled: Any) -> None:
    found = FIT(
        structure(term("presliding", stiffness=1e4)),
        [bristled.record(noise=0.2, resolution=1e-8)],
        Options(cutoff=200.0, decimation=1),
    )
    assert found.model.value("presliding.stiffness") == pytest.approx(2e5, rel=0.2)
    assert found.model.value("coulomb.force") == pytest.approx(8.0, rel=0.03)
    assert found.model.value("mass") == pytest.approx(2.0, rel=0.03)


def test_several_recordings_count_together(slider: Any, mover: Callable[..., Any]) -> None:
    other = mover(duration=8.0, seed=9)
    both = FIT(structure(), [slider.record(noise=0.5), other.record(noise=0.5, seed=2)], Options())
    one = FIT(structure(), [other.record(noise=0.5, seed=2)], Options())
    assert both.model.standard_errors["mass"] < one.model.standard_errors["mass"]
    assert both.model.value("mass") == pytest.approx(2.0, rel=0.01)


def test_invalid_samples_are_left_out(slider: Any) -> None:
    record = slider.record(noise=0.3)
    valid = np.ones(record.n_samples, dtype=bool)
    valid[9000:10_000] = False
    broken = replace(record, effort=np.where(valid, record.effort, 1e4), valid=valid)
    found = FIT(structure(), [broken], Options())
    assert_near(found, TRUE, percent=15.0)


def test_held_parameters_stay_and_unknown_names_are_refused(slider: Any) -> None:
    record = slider.record(noise=0.3)
    start = structure().with_value("mass", 1.7)
    found = FIT(start, [record], Options(held=("mass",)))
    assert found.model.value("mass") == 1.7
    assert "mass" not in found.fitted
    with pytest.raises(Exception, match="no parameter 'masss'"):
        FIT(start, [record], Options(held=("masss",)))


@pytest.mark.parametrize("cutoff", [0.0, -1.0, 501.0, 1e4])
def test_a_cutoff_outside_the_band_is_refused(slider: Any, cutoff: float) -> None:
    with pytest.raises(IdentificationError, match="cutoff"):
        FIT(structure(), [slider.record()], Options(cutoff=cutoff))


def test_a_recording_that_is_too_short_is_refused(slider: Any) -> None:
    with pytest.raises(IdentificationError, match="record for longer"):
        FIT(structure(), [slider.record().slice(0, 60)], Options())


def test_what_a_load_is_relative_to_is_the_model_s_and_not_each_recording_s() -> None:
    time = np.arange(200) * 1e-3
    records = [
        Record(time, 0.0 * time, 0.0 * time, extra={"normal_load": np.full(200, load), "temperature": np.full(200, 20.0)})
        for load in (80.0, 120.0)
    ]
    nominal = nominal_conditions(records)
    assert nominal == {"normal_load": 100.0, "temperature": 20.0}
    load, temperature = surroundings(records[1])
    assert load[0] == 1.0
    load, temperature = surroundings(replace(records[1], nominal=nominal | {"temperature": 15.0}))
    assert load[0] == pytest.approx(1.2)
    assert temperature[0] == 5.0
    with pytest.raises(RecordError, match="mean of 'normal_load' is 0"):
        nominal_conditions([replace(records[0], extra={"normal_load": 0.0 * time})])


@pytest.mark.parametrize(
    "path",
    [term("input_deadzone", width=3.0), term("delay", time=0.02), term("actuator_lag", time=0.03)],
    ids=["dead zone", "delay", "lag"],
)
def test_a_command_path_stands_between_the_recorded_effort_and_the_force(path: Term) -> None:
    # A motion in closed form: the force that it needs is worked out here, and so is the command that gives this force.
    # A lag can't follow the jump of Coulomb friction; there is none behind it.
    step, mass, viscous = 1e-3, 2.0, 15.0
    coulomb = 0.0 if path.effect.id == "actuator_lag" else 8.0
    time = np.arange(30_000) * step
    lines = [(0.31, 0.05, 0.0), (0.83, 0.02, 1.0), (1.7, 0.006, 2.0)]

    def motion(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        w = [2.0 * np.pi * f for f, _, _ in lines]
        position = sum(a * np.sin(k * t + p) for k, (_, a, p) in zip(w, lines, strict=True))
        velocity = sum(a * k * np.cos(k * t + p) for k, (_, a, p) in zip(w, lines, strict=True))
        acceleration = sum(-a * k * k * np.sin(k * t + p) for k, (_, a, p) in zip(w, lines, strict=True))
        return np.asarray(position), np.asarray(velocity), np.asarray(acceleration)

    def force(t: np.ndarray) -> np.ndarray:
        _, v, a = motion(t)
        return np.asarray(mass * a + viscous * v + coulomb * np.sign(v))

    if path.effect.id == "input_deadzone":
        effort = force(time) + 3.0 * np.sign(force(time))
    elif path.effect.id == "delay":
        effort = force(time + 0.02)
    else:
        effort = force(time) + 0.03 * np.gradient(force(time), step)
    record = Record(time, motion(time)[0], effort, effort_hold="linear")
    held = tuple(f"{path.effect.id}.{p.name}" for p in path.effect.parameters)
    found = FIT(structure(path, asymmetry=False), [record], Options(held=(*held, "bias.force")))
    assert found.model.value("mass") == pytest.approx(mass, rel=0.01)
    assert found.model.value("coulomb.force") == pytest.approx(coulomb, abs=0.1)
    assert found.model.value("viscous.coefficient") == pytest.approx(viscous, rel=0.02)
    without = FIT(structure(asymmetry=False), [record], Options(held=("bias.force",)))
    if path.effect.id == "input_deadzone":
        # What a dead zone takes looks like Coulomb friction for as long as the joint moves.
        assert without.model.value("coulomb.force") == pytest.approx(coulomb + 3.0, abs=0.3)
    else:
        assert without.train.noe > 2.0 * found.train.noe


def test_a_free_motion_is_scored_against_its_inertial_force() -> None:
    time = np.arange(8000) * 1e-3
    decay, omega = 0.2, 6.0
    position = 0.1 * np.exp(-decay * time) * np.cos(omega * time)
    stiffness, viscous = 2.0 * (omega**2 + decay**2), 2.0 * 2.0 * decay
    terms = [term("stiffness", stiffness=stiffness), term("viscous", coefficient=viscous)]
    found = score(build_model("rigid", {"mass": 2.0}, terms), [Record(time, position, 0.0 * time)], Options(cutoff=50.0))
    assert found.relative_force_error_percent < 1.0
    off = score(build_model("rigid", {"mass": 2.2}, terms), [Record(time, position, 0.0 * time)], Options(cutoff=50.0))
    # A mass that is 10 % off leaves 10 % of the true inertial force, which is 1/1.1 of the model's own.
    assert off.relative_force_error_percent == pytest.approx(100.0 * 0.2 / 2.2, rel=0.02)
