"""Stamps of known kinds: late, rounded, with losses, wandering; the motion known in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric.record import Array, Record
from fric.signals.stamps import evened, grid_of, jitter_of, rounded_grid

RATE = 1000.0
N = 8000


def motion(time: Array) -> Array:
    """Position [m] of a slide that swings at two frequencies."""
    return np.asarray(0.05 * np.sin(2.0 * np.pi * 0.7 * time) + 0.01 * np.sin(2.0 * np.pi * 2.3 * time + 1.0))


def record(stamps: Array, read: Array, step: float = 1e-7) -> Record:
    """What is recorded where the position is read at the times ``read``."""
    return Record(stamps - stamps[0], step * np.round(motion(read) / step), np.cos(read))


@pytest.fixture
def even() -> Array:
    """Instants of an even clock [s]."""
    return np.arange(N, dtype=np.float64) / RATE


@pytest.mark.parametrize("jitter", [1.5e-5, 1e-4, 5e-4, 9e-4])
def test_late_stamps_of_an_even_motion_are_taken_as_even(even: Array, jitter: float) -> None:
    late = np.random.default_rng(1).uniform(0.0, jitter, N)
    given = record(even + late, even)
    grid = grid_of(given.time)
    assert 1.0 / grid.period == pytest.approx(RATE, rel=1e-4)
    assert grid.n_lost == 0
    found = jitter_of(given, grid)
    assert abs(found.share) < 3.0 * found.error + 0.05
    mended = evened(given)
    assert mended.is_uniform(1e-9)
    assert np.array_equal(mended.position, given.position)
    assert "the motion doesn't" in mended.notes[-1]


@pytest.mark.parametrize("jitter", [1e-4, 3e-4])
def test_a_motion_that_was_read_late_follows_its_stamps(even: Array, jitter: float) -> None:
    late = np.random.default_rng(2).uniform(0.0, jitter, N)
    given = record(even + late, even + late)
    found = jitter_of(given, grid_of(given.time))
    assert found.follows
    assert found.share == pytest.approx(1.0, abs=3.0 * found.error + 0.02)
    assert evened(given) is given
    # Brought onto an even grid it is the true motion, to a part of what the jitter would have made of it.
    uniform = given.uniform()
    true = motion(uniform.time + (even + late)[0])
    assert float(np.std(uniform.position - true)) < 0.05 * 0.25 * jitter


@pytest.mark.parametrize("noise", [1e-6, 1e-5, 5e-5])
@pytest.mark.parametrize("followed", [0.0, 1.0])
def test_noise_of_the_position_favours_neither(even: Array, noise: float, followed: float) -> None:
    rng = np.random.default_rng(6)
    late = rng.uniform(0.0, 9e-4, N)
    given = record(even + late, even + followed * late)
    given = replace(given, position=given.position + noise * rng.standard_normal(N))
    found = jitter_of(given, grid_of(given.time))
    assert abs(found.share - followed) < 4.0 * found.error + 0.05


def test_samples_that_were_read_unevenly_are_left_where_they_are() -> None:
    """A loop that takes 15 to 100 ms, as over a serial line; the axis sticks and slips."""
    rng = np.random.default_rng(7)
    stamps = np.cumsum(0.015 + rng.exponential(0.02, 3000))
    given = Record(
        stamps - stamps[0], 0.06 * np.floor(stamps / 1.3) + 0.06 * np.clip(np.mod(stamps, 1.3) / 0.4, 0.0, 1.0), stamps
    )
    grid = grid_of(given.time)
    assert grid.spread > grid.period
    assert jitter_of(given, grid).follows
    assert evened(given) is given


def test_one_stamp_that_is_off_decides_nothing(even: Array) -> None:
    """As in a block of samples that begins with the first one of a late timer."""
    stamps = even[:500].copy()
    stamps[0] += 1.2e-4
    given = record(stamps, even[:500])
    assert not np.isfinite(jitter_of(given, grid_of(given.time)).error)
    assert evened(given) is given


def test_where_the_motion_says_nothing_steps_that_make_up_for_each_other_are_jitter(even: Array) -> None:
    rng = np.random.default_rng(8)
    late = even + rng.uniform(0.0, 9e-4, N)
    mended = evened(Record(late - late[0], np.zeros(N), even))
    assert mended.is_uniform(1e-9)
    assert "the motion doesn't decide it" in mended.notes[-1]
    unevenly = np.cumsum(rng.uniform(5e-4, 1.5e-3, N))
    given = Record(unevenly - unevenly[0], np.zeros(N), even)
    assert evened(given) is given


def test_lost_samples_are_counted_whatever_the_jitter(even: Array) -> None:
    rng = np.random.default_rng(3)
    kept = np.sort(rng.permutation(N)[: N - 60])
    grid = grid_of(even[kept] + rng.uniform(0.0, 4e-4, kept.size))
    assert grid.n_lost == kept[-1] - kept[0] + 1 - kept.size
    # Which of two neighbours was lost, stamps that are late by up to 0.4 of a sample can't tell.
    assert np.max(np.abs(grid.number - (kept - kept[0]))) <= 1.0


@pytest.mark.parametrize(
    ("start", "rounded"),
    [
        (3000.0, lambda t: t.astype(np.float32).astype(np.float64)),  # single precision
        (0.0, lambda t: np.round(t, 2)),  # two decimals of a second at 1 kHz
        (5.0, lambda t: np.floor(1e3 * t * 2.5) * 1e-3),  # whole milliseconds of a clock at 400 Hz
    ],
)
def test_rounded_stamps_are_the_even_grid(even: Array, start: float, rounded: object) -> None:
    stamps = rounded(even + start)  # type: ignore[operator]
    found = rounded_grid(stamps)
    assert found is not None
    step = np.diff(found[0])
    true = RATE / 2.5 if start == 5.0 else RATE
    assert 1.0 / float(np.mean(step)) == pytest.approx(true, rel=1e-3)
    assert float(np.ptp(step)) < 1e-9


def test_stamps_that_are_no_rounding_of_a_grid_are_left(even: Array) -> None:
    rng = np.random.default_rng(4)
    assert rounded_grid(even) is None
    assert rounded_grid(np.cumsum(rng.exponential(1e-3, N))) is None
    stalled = even.copy()
    stalled[3000:3100] = stalled[3000]
    assert rounded_grid(np.sort(stalled)) is None


def test_even_stamps_stay_as_they_are(even: Array) -> None:
    given = record(even, even)
    assert evened(given) is given


def test_a_clock_that_wanders_is_followed(even: Array) -> None:
    wander = 2e-3 * np.sin(2.0 * np.pi * even / 6.0)
    late = np.random.default_rng(5).uniform(0.0, 2e-4, N)
    given = record(even + wander + late, even)
    mended = evened(given)
    off = mended.time - (even + wander - wander[0])
    assert float(np.std(off)) < 1.5e-4
    assert mended.n_samples == replace(given).n_samples
    assert evened(mended) is mended  # what still wanders about a line is no jitter, and is told once
