"""The record: what it accepts, what it refuses, and what cutting and regridding keep."""

from __future__ import annotations

import numpy as np
import pytest
from fric.record import Record, RecordError


def record(**changes: object) -> Record:
    t = 0.01 * np.arange(100)
    fields: dict[str, object] = {"time": t, "position": np.sin(t), "effort": np.cos(t), "source": "bag"}
    return Record(**{**fields, **changes})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"position": np.zeros(99)}, "'position' has shape (99,)"),
        ({"effort": np.zeros((100, 1))}, "'effort' has shape (100, 1)"),
        ({"velocity": np.zeros(3)}, "'velocity' has shape (3,)"),
        ({"extra": {"normal_load": np.zeros(7)}}, "'normal_load' has shape (7,)"),
        ({"valid": np.ones(7, dtype=bool)}, "'valid' has shape (7,)"),
        ({"position": np.r_[np.zeros(99), np.nan]}, "'position' is not finite at 1 of 100 samples, first at sample 99"),
        ({"effort": np.r_[np.inf, np.zeros(99)]}, "'effort' is not finite at 1 of 100 samples, first at sample 0"),
        ({"time": np.r_[0.01 * np.arange(50), 0.01 * np.arange(50)]}, "time does not increase at sample 50"),
        ({"time": np.zeros(100)}, "time does not increase at sample 1"),
        ({"effort_hold": "sideways"}, "effort_hold is 'sideways'"),
    ],
)
def test_what_cannot_be_used_is_refused_with_file_cause_and_remedy(changes: dict[str, object], words: str) -> None:
    with pytest.raises(RecordError) as caught:
        record(**changes)
    message = str(caught.value)
    assert message.startswith("bag: ")
    assert words in message
    assert "; " in message
    assert "\n" not in message


@pytest.mark.parametrize("n", [0, 1])
def test_too_few_samples_are_refused(n: int) -> None:
    with pytest.raises(RecordError, match="record for longer"):
        Record(np.zeros(n), np.zeros(n), np.zeros(n))


def test_figures_of_an_uneven_record() -> None:
    uneven = record(time=np.r_[0.01 * np.arange(50), 0.6 + 0.01 * np.arange(50)])
    assert uneven.n_samples == 100
    assert uneven.sample_time == pytest.approx(0.01)
    assert uneven.duration == pytest.approx(1.09)
    assert not uneven.is_uniform()
    assert record().is_uniform()
    assert list(uneven.signals()) == ["time", "position", "effort"]


def test_a_slice_starts_at_zero_and_copies_nothing_but_time() -> None:
    whole = record(velocity=np.arange(100.0), extra={"temperature": np.arange(100.0)}, valid=np.arange(100) % 2 == 0)
    part = whole.slice(10, 30)
    assert part.time[0] == 0.0
    assert part.n_samples == 20
    assert np.shares_memory(part.position, whole.position)
    assert part.velocity is not None
    assert part.velocity[0] == 10.0
    assert part.extra["temperature"][-1] == 29.0
    np.testing.assert_array_equal(part.mask, whole.mask[10:30])
    with pytest.raises(RecordError, match="fewer than two"):
        whole.slice(10, 11)


def test_between_takes_both_ends() -> None:
    part = record().between(0.2, 0.4)
    assert part.n_samples == 21
    assert part.position[0] == pytest.approx(np.sin(0.2))
    assert record().between().n_samples == 100


def test_an_even_record_is_not_touched_and_an_uneven_one_is_interpolated() -> None:
    even = record()
    assert even.uniform() is even
    rng = np.random.default_rng(1)
    t = np.sort(np.r_[0.0, 1.0, rng.uniform(0.0, 1.0, 198)])
    line = Record(t, 3.0 * t - 1.0, 2.0 * t, velocity=0.0 * t + 3.0, valid=t < 0.5).uniform(0.01)
    assert line.is_uniform()
    assert line.n_samples == 101
    np.testing.assert_allclose(line.position, 3.0 * line.time - 1.0, atol=1e-12)
    np.testing.assert_allclose(line.effort, 2.0 * line.time, atol=1e-12)
    # Good only between two good samples.
    last_good = t[t < 0.5][-1]
    np.testing.assert_array_equal(line.mask, line.time <= last_good)
