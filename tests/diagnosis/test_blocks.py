"""Every other block of a recording is held back: what becomes of its samples, and which recordings are refused."""

from __future__ import annotations

import numpy as np
import pytest
from fric.diagnosis.blocks import in_blocks, one_sided
from fric.record import Array, Record, RecordError


def record(position: Array, valid: Array | None = None) -> Record:
    mask = None if valid is None else valid.astype(np.bool_)
    return Record(0.01 * np.arange(position.shape[0]), position, np.ones_like(position), valid=mask, source="bag")


def swinging(n: int = 1000) -> Record:
    return record(np.sin(0.3 * np.arange(n)))


def test_each_sample_is_learnt_from_or_held_back_and_none_is_both() -> None:
    learnt, apart = in_blocks([swinging()], 4)
    assert np.array_equal(learnt[0].mask, ~apart[0].mask)
    assert np.flatnonzero(np.diff(learnt[0].mask.astype(int))).tolist() == [249, 499, 749]
    assert learnt[0].mask[0]
    # Time goes on, and no sample is lost: only the mask says which ones count.
    assert np.array_equal(apart[0].time, swinging().time)


def test_what_was_invalid_stays_invalid_in_both() -> None:
    valid = np.ones(1000)
    valid[100:400] = 0.0
    learnt, apart = in_blocks([record(swinging().position, valid)], 4)
    assert not np.any((learnt[0].mask | apart[0].mask)[100:400])
    assert int(np.sum(learnt[0].mask)) + int(np.sum(apart[0].mask)) == 700


@pytest.mark.parametrize(("n", "advice"), [(1000, "ask for 5 blocks"), (399, "record for longer")])
def test_blocks_that_are_too_short_are_refused_with_what_to_do(n: int, advice: str) -> None:
    with pytest.raises(RecordError, match=advice):
        in_blocks([swinging(n)], 6)


def test_one_block_leaves_nothing_to_judge_by() -> None:
    with pytest.raises(RecordError, match="1 blocks"):
        in_blocks([swinging()], 1)


def test_blocks_in_step_with_the_motion_are_refused() -> None:
    """Forward in the first and third block, back in the others: friction backward would be judged and never learnt."""
    there = np.linspace(0.0, 1.0, 250)
    with pytest.raises(RecordError, match=r"to learn from hardly moves backward \(0 % of its way\).*\(100 %\)"):
        in_blocks([record(np.concatenate([there, there[::-1], there, there[::-1]]))], 4)


def test_what_is_offered_instead_can_be_used() -> None:
    """Back and forth twice in 1000 samples: 2 and 4 blocks are in step with that, and there is room for 5."""
    there = np.linspace(0.0, 1.0, 250)
    whole = record(np.concatenate([there, there[::-1], there, there[::-1]]))
    for asked, offered in ((4, "3 or 5"), (6, "5"), (1, "2")):
        with pytest.raises(RecordError, match=f"ask for {offered} blocks"):
            in_blocks([whole], asked)
    for good in (2, 3, 5):
        in_blocks([whole], good)


def test_what_does_not_move_is_not_one_sided() -> None:
    assert one_sided([record(np.zeros(500))], [swinging()]) == ""


def test_a_jump_between_blocks_is_no_way() -> None:
    """What the axis does while the other half counts is none of this half's motion."""
    ahead = np.concatenate([np.linspace(0.0, 1.0, 100), np.linspace(1.0, -5.0, 100), np.linspace(-5.0, -4.0, 100)])
    valid = np.r_[np.ones(100), np.zeros(100), np.ones(100)]
    assert "backward (0 %" in one_sided([record(ahead, valid)], [swinging()])
