"""The soak of the graph: memory, growth and missing messages reckoned right, and measured on a real graph."""

from __future__ import annotations

import os

import numpy as np
import pytest
from fric_nodes.soak import anonymous_memory, growth, missing, soaked


def test_memory_that_is_written_counts_and_memory_that_is_given_back_does_not() -> None:
    before = anonymous_memory(os.getpid())
    held = np.ones(8_000_000)
    during = anonymous_memory(os.getpid())
    del held
    after = anonymous_memory(os.getpid())
    assert during - before == pytest.approx(64e6, rel=0.05)
    assert during - after == pytest.approx(64e6, rel=0.05)


def test_growth_leaves_the_warm_up_out_and_stands_single_peaks() -> None:
    flat = np.concatenate([np.linspace(10.0, 100.0, 100), np.full(500, 100.0)])
    flat[[150, 560]] = 900.0
    assert growth(flat) == 0.0
    # From the middle of the second sixth to that of the last one: 4/5 of the rise after the warm-up.
    rising = np.concatenate([np.full(100, 100.0), np.linspace(100.0, 110.0, 500)])
    assert growth(rising) == pytest.approx(100.0 * (109.0 / 101.0 - 1.0), rel=0.01)


def test_a_sample_is_missing_where_no_message_has_its_stamp() -> None:
    stamps = [2_000_000 * k for k in range(1000)]
    assert missing(stamps, 2_000_000) == 0
    assert missing([*stamps[:500], *stamps[501:]], 2_000_000) == 1
    assert missing(stamps[100:] + stamps[100:200], 2_000_000) == 0  # begun later, and some sent twice
    stamps[300] += 1  # of no sample
    assert missing(stamps, 2_000_000) == 1
    assert missing([], 2_000_000) == 0


@pytest.mark.long
@pytest.mark.parametrize("lock_step", [True, False])
def test_no_message_of_half_a_minute_is_missing(lock_step: bool) -> None:
    found = {each.name.partition(": ")[2]: each for each in soaked(0.5, lock_step)}
    assert found["messages in the bag"].value > 1000
    assert found["messages lost, as the recorder counts"].value == 0
    assert sum(name.startswith("growth of") for name in found) == 7
    in_step = [each for name, each in found.items() if ", missing of" in name]
    assert len(in_step) == (3 if lock_step else 0)
    assert all(each.value == 0 for each in in_step)
