"""Positions that fold: unfolded where it can be known how, refused where it can't, left alone where nothing folds."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from fric.identification import METHODS
from fric.identification.result import Options
from fric.identification.screen import screened
from fric.identification.start import start_model
from fric.instrument import CHECKS, Evidence
from fric.record import Record, RecordError, Units
from fric.signals.folds import fold_of, unfolded
from numpy.typing import NDArray

Array = NDArray[np.float64]
Turn = Callable[..., Record]
FoldTo = Callable[[Array, float, float], Array]
TURN = 2.0 * math.pi


def off(found: Record, true: Array) -> float:
    """Largest distance from the true position, but for a constant."""
    error = found.position - true
    return float(np.max(np.abs(error - error[0])))


@pytest.mark.parametrize("low", [-math.pi, 0.0, 1.3])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_angle_within_one_turn_is_unfolded(turn: Turn, fold: FoldTo, low: float, seed: int) -> None:
    true = turn(seed=seed)
    found = unfolded(replace(true, position=fold(true.position, TURN, low), reference=fold(true.position, TURN, low)))
    assert off(found, true.position) < 1e-9
    assert found.reference is not None
    assert np.max(np.abs(found.reference - found.position)) < 1e-9
    assert found.notes[-1].startswith("position jumps by 6.283 rad ")
    assert found.notes[-1].endswith("taken as one turn")


@pytest.mark.parametrize("rate", [1000.0, 20.0, 8.0, 5.0])
@pytest.mark.parametrize("noise", [1e-6, 0.02])
def test_slow_logs_and_noise_at_the_end_of_the_range(turn: Turn, fold: FoldTo, rate: float, noise: float) -> None:
    true = turn(rate=rate, noise=noise, duration=30.0)
    assert off(unfolded(replace(true, position=fold(true.position, TURN, 0.0))), true.position) < 1e-9


def test_degrees_rounded_to_a_tenth(turn: Turn, fold: FoldTo) -> None:
    true = turn()
    position = np.radians(np.round(np.degrees(fold(true.position, TURN, 0.0)), 1))
    assert off(unfolded(replace(true, position=position)), true.position) < np.radians(0.11)


@pytest.mark.parametrize("bits", [12, 16])
def test_a_counter(turn: Turn, bits: int) -> None:
    true = turn()
    counts = np.floor(true.position * 2.0**bits / 8.0)
    found = unfolded(replace(true, position=1e-6 * (counts % 2**bits), units=Units("m", "N")))
    assert off(found, 1e-6 * counts) < 1e-12
    assert f"2^{bits} steps of the encoder" in found.notes[-1]


def test_a_fold_of_unknown_size(turn: Turn, fold: FoldTo) -> None:
    true = replace(turn(), units=Units("m", "N"))
    found = unfolded(replace(true, position=fold(true.position, 3.7, -1.0)))
    assert off(found, true.position) < 1e-3
    assert "a fold of 3.7 m" in found.notes[-1] or "a fold of 3.69" in found.notes[-1]


def test_one_crossing_of_a_known_fold_is_enough(turn: Turn, fold: FoldTo) -> None:
    true = turn(duration=0.6)
    found = unfolded(replace(true, position=fold(true.position, TURN, float(true.position[300]) + 1e-4)))
    assert off(found, true.position) < 1e-9
    assert " 1 time:" in found.notes[-1]


def test_a_velocity_made_from_the_folded_angle(turn: Turn, fold: FoldTo) -> None:
    true = turn(noise=0.0)
    position = fold(true.position, TURN, 0.0)
    for made in (np.gradient(position, true.time), np.diff(position, prepend=position[0]) / true.sample_time):
        found = unfolded(replace(true, position=position, velocity=made))
        assert found.velocity is not None
        assert np.max(np.abs(found.velocity - np.gradient(true.position, true.time))[1:]) < 0.5


@pytest.mark.parametrize("rate", [4.0, 3.0, 2.0])
def test_nearly_half_a_turn_between_samples_is_refused(turn: Turn, fold: FoldTo, rate: float) -> None:
    true = turn(rate=rate, duration=60.0)
    with pytest.raises(RecordError, match="the direction can't be determined; record at"):
        unfolded(replace(true, position=fold(true.position, TURN, -math.pi)))


@pytest.mark.parametrize("jump", [3.0, -0.7])
def test_a_jump_in_the_middle_of_a_motion_is_refused(turn: Turn, jump: float) -> None:
    true = turn()
    at = int(np.argmax(np.abs(true.velocity)))
    position = true.position + np.where(np.arange(true.n_samples) >= at, jump, 0.0)
    with pytest.raises(RecordError, match=r"position jumps by [+-][\d.]+ rad at .*--end .* or --start"):
        unfolded(replace(true, position=position))


def test_a_sensor_that_is_set_anew_at_rest_is_left_out(turn: Turn) -> None:
    true = turn(noise=0.0)
    still = np.concatenate([true.position[:4000], np.full(2000, true.position[4000]), true.position[4000:-2000]])
    position = still + np.where(np.arange(true.n_samples) >= 5000, 40.0, 0.0)
    found = unfolded(replace(true, position=position))
    assert found.valid is not None
    assert np.flatnonzero(~found.valid).tolist() == [4999, 5000]
    assert "set anew" in found.notes[-1]


def slipping(rate: float, stiffness: float, seed: int) -> Record:
    """Stick-slip: a body drawn by a spring at constant velocity, to and fro."""
    fine, h = 40, 1.0 / rate
    random = np.random.default_rng(seed)
    q = v = pull = 0.0
    positions, forces = [], []
    for k in range(2000):
        pull += 0.02 * h * (1.0 if (k // 500) % 2 == 0 else -1.0)
        positions.append(q)
        forces.append(stiffness * (pull - q))
        for _ in range(fine):
            push = v + h / fine / 2.0 * (stiffness * (pull - q) - 2.0 * v)
            level = 3.0 + 3.0 * math.exp(-abs(v) / 0.005)
            v = math.copysign(max(abs(push) - h / fine / 2.0 * level, 0.0), push)
            q += h / fine * v
    position = np.array(positions) + 1e-7 * random.standard_normal(len(positions))
    return Record(h * np.arange(len(positions)), position, np.array(forces), units=Units("m", "N"))


@pytest.mark.parametrize("rate", [1000.0, 100.0, 20.0])
@pytest.mark.parametrize("stiffness", [300.0, 3000.0])
def test_stick_slip_is_no_fold(rate: float, stiffness: float) -> None:
    record = slipping(rate, stiffness, 1)
    assert fold_of(record) is None
    assert unfolded(record).valid is None


@pytest.mark.parametrize("step", [1e-4, 0.003, 0.02])
@pytest.mark.parametrize("rate", [500.0, 10.0, 2.0])
def test_coarse_encoders_steps_and_hops_are_no_folds(rate: float, step: float) -> None:
    time = np.arange(600) / rate
    for motion in (
        0.128 * (np.floor(time * rate / 20.0) % 2),  # hops from end to end
        0.05 * np.sin(2.0 * np.pi * time * rate / 37.0),
        0.05 * np.cumsum(np.random.default_rng(1).standard_normal(600)) / 10.0,
        0.1 * np.abs((time * rate / 50.0) % 2.0 - 1.0),
    ):
        record = Record(time, np.round(motion / step) * step, np.ones(600), units=Units("m", "N"))
        assert fold_of(record) is None


def test_play_is_no_fold() -> None:
    time = np.arange(4000) / 1000.0
    motor = 0.05 * np.sin(2.0 * np.pi * time)
    load = np.empty_like(motor)
    load[0] = 0.0
    for k in range(1, motor.size):
        load[k] = np.clip(load[k - 1], motor[k] - 0.02, motor[k] + 0.02)
    assert unfolded(Record(time, load, np.cos(time), units=Units("m", "N"))).notes == ()


@pytest.mark.parametrize("low", [-math.pi, 0.0])
def test_the_axis_is_identified_as_if_nothing_had_folded(turn: Turn, fold: FoldTo, low: float) -> None:
    true = turn()
    record = screened(replace(true, position=fold(true.position, TURN, low), velocity=None, reference=None))
    model = start_model(("coulomb", "viscous", "bias"), record.joint, record.units)
    found = METHODS["inverse-dynamics"].fit(model, [record], Options()).model
    for name, value in (("mass", 0.02), ("coulomb.force", 0.4), ("viscous.coefficient", 0.06)):
        assert abs(found.value(name) - value) < max(0.01 * value, 3.0 * found.standard_errors[name])


def test_the_check_names_the_jumps(turn: Turn, fold: FoldTo) -> None:
    true = turn()
    finding = CHECKS["position_steps"].run(Evidence([replace(true, position=fold(true.position, TURN, 0.0))]))[0]
    assert finding.verdict == "warning"
    assert "6.283 rad" in finding.detail
    assert CHECKS["position_steps"].run(Evidence([true]))[0].verdict == "ok"
