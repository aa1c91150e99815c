"""Logs that don't say how a force is held, or hold only some of the controller's samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric.diagnosis import diagnose
from fric.diagnosis.prove import draw
from fric.diagnosis.start import lateness
from fric.identification.innovations import runs_of
from fric.instrument import inspect
from fric.record import Array, Record
from fric.signals.stamps import evened

pytestmark = pytest.mark.timeout(600)


@pytest.mark.parametrize("late", [-0.5, -0.2, 0.0, 0.3, 0.5])
def test_a_late_force_is_the_mean_of_the_curve_that_was_sampled(late: float) -> None:
    step, rate = 0.004, 2.0 * np.pi / 0.032  # eight samples in a cycle
    time = step * np.arange(400)
    run = runs_of(_record(np.sin(rate * time), "linear"), late)[0]
    begin = time[:-1] - late * step
    true = (np.cos(rate * begin) - np.cos(rate * (begin + step))) / (rate * step)
    np.testing.assert_allclose(run.effort[20:-20], true[20:-20], atol=2e-3)
    # A line through the samples cuts off a twentieth.
    line = 0.5 * np.sin(rate * time[1:]) + 0.5 * np.sin(rate * time[:-1])
    assert float(np.std(line)) / float(np.std(true)) == pytest.approx(0.95, abs=0.005)


def _record(effort: Array, hold: str) -> Record:
    time = 0.004 * np.arange(effort.shape[0])
    return Record(time, np.sin(time), effort, effort_hold=hold)


def test_white_noise_leaves_nothing_unsure_between_samples_and_a_jump_does_where_it_is() -> None:
    random = np.random.default_rng(2)
    noise: Array = 0.1 * random.standard_normal(4000)
    plain = runs_of(_record(noise, "linear"))[0]
    assert float(np.mean(plain.between**2)) < 0.1 * plain.effort_noise**2
    jump = noise + np.where(np.arange(4000) > 2000, 5.0, 0.0)
    stepped = runs_of(_record(jump, "linear"))[0]
    # Over the interval in which it jumps by 5 the mean force is unsure by 5/sqrt(12): as much, in all, as the intervals around.
    assert np.sqrt(np.sum(stepped.between[1980:2020] ** 2)) == pytest.approx(5.0 / np.sqrt(12.0), rel=0.5)
    assert float(np.max(stepped.between[:1980])) == pytest.approx(float(np.max(plain.between[:1980])), rel=0.05)
    assert not np.any(runs_of(_record(jump, "following"))[0].between)


@pytest.mark.long
def test_a_force_held_from_its_stamp_comes_half_a_sample_late_where_nobody_says_so() -> None:
    case = draw(4, "nothing")
    record = case.train[0]
    assert lateness([record], case.nominal) == 0.0
    untold = replace(record, effort_hold="linear")
    assert lateness([untold], case.nominal) == pytest.approx(0.5, abs=0.05)
    # A shift by a whole sample is no matter of how a force is held.
    shifted = replace(untold, effort=np.concatenate([untold.effort[1:], untold.effort[-1:]]))
    assert lateness([shifted], case.nominal) == 0.0
    earlier = [replace(each, effort_hold="linear") for each in (*case.train, *case.validation)]
    found = diagnose(earlier[:1], earlier[1:], case.nominal)
    assert not found.mismatch
    assert any("half a sample late" in note for note in found.notes)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_log_slower_than_the_controller_lacks_nothing(seed: int) -> None:
    case = draw(seed, "nothing", variant="slow-log")
    assert case.train[0].effort_hold == "linear"
    assert case.train[0].sample_time == pytest.approx(case.key["every"] * case.key["sample_time"])
    assert not diagnose(case.train, case.validation, case.nominal).findings


def test_in_a_slow_log_what_is_missing_is_still_named() -> None:
    case = draw(1, "moderate", "position_dependence", "slow-log")
    found = diagnose(case.train, case.validation, case.nominal)
    assert [each.effect for each in found.findings][:1] == ["position_dependence"]


def _jittering(record: Record, part: float, seed: int) -> Record:
    off = part * np.random.default_rng(seed).standard_normal(record.n_samples)
    time = record.time + record.sample_time * np.clip(off, -0.45, 0.45)
    return replace(record, time=time - time[0])


@pytest.mark.long
def test_stamps_that_jitter_where_the_motion_does_not_are_taken_as_even() -> None:
    case = draw(4, "nothing")
    train, validation = ([_jittering(each, 0.2, 3) for each in held] for held in (case.train, case.validation))
    found = diagnose(train, validation, case.nominal)
    assert not found.mismatch
    assert sum("jitter by" in note and "taken as even" in note for note in found.notes) == 2
    assert not diagnose(case.train, validation, case.nominal).mismatch


@pytest.mark.long
def test_uneven_stamps_of_an_uneven_log_are_left_as_they_are() -> None:
    case = draw(4, "nothing")
    apart = np.cumsum(np.random.default_rng(5).integers(2, 5, case.train[0].n_samples))
    logs = []
    for record in (*case.train, *case.validation):
        kept = apart[apart < record.n_samples]
        time = record.time[kept] - record.time[kept[0]]
        logs.append(
            replace(record, time=time, position=record.position[kept], effort=record.effort[kept], effort_hold="linear")
        )
    assert evened(logs[0]) is logs[0]
    assert not diagnose(logs[:1], logs[1:], case.nominal).findings


@pytest.mark.parametrize(("lost", "words"), [((), "jitter by"), ((2000,), "samples are missing")])
def test_jitter_is_not_taken_for_lost_samples_nor_one_lost_sample_for_jitter(lost: tuple[int, ...], words: str) -> None:
    whole = draw(4, "nothing").train[0]
    record = whole if lost else _jittering(whole, 0.2, 3)
    kept = np.delete(np.arange(record.n_samples), lost)
    logged = replace(record, time=record.time[kept], position=record.position[kept], effort=record.effort[kept])
    stamps = next(check for check in inspect([logged]) if check.check == "stamps")
    assert words in stamps.detail
    assert ("missing" in stamps.detail) == bool(lost)
    assert float(np.max(np.abs(np.diff(evened(logged).time) - np.diff(whole.time[kept])))) < 1e-3 * whole.sample_time


def test_even_stamps_are_found_beside_gaps() -> None:
    record = _jittering(draw(4, "nothing").train[0], 0.05, 3)
    kept = np.concatenate([np.arange(700), np.arange(900, 1500), np.arange(1503, 4000)])
    holed = replace(record, time=record.time[kept], position=record.position[kept], effort=record.effort[kept])
    even = evened(holed)
    assert float(np.max(np.abs(even.time - record.sample_time * kept))) < 0.2 * record.sample_time
