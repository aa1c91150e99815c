"""A search that has to end after a time that was asked for."""

from __future__ import annotations

import threading
import time
from dataclasses import replace

import fric
import numpy as np
import pytest
from fric.diagnosis.deadline import is_over, within
from fric.errors import InputError
from fric.model import build_model, term
from fric.record import Record

H = 2e-3
NOMINAL = build_model("rigid", {"mass": 5.0}, [term("coulomb", force=8.0), term("viscous", coefficient=30.0)])


@pytest.fixture(scope="module")
def record() -> Record:
    """An axis with two effects that the nominal model lacks."""
    t = H * np.arange(3000)
    force = 30.0 * np.sin(2.0 * np.pi * (0.3 + 0.06 * t) * t) + 12.0 * np.sin(2.0 * np.pi * 1.7 * t)
    lacks = [term("ripple", cosine=0.0, sine=3.0, period=0.02), term("stiffness", stiffness=60.0, position=0.0)]
    moved = fric.simulate(NOMINAL.with_terms((*NOMINAL.terms, *lacks)), force, period=H)
    noise = np.random.default_rng(2).standard_normal((2, t.shape[0]))
    return replace(moved, position=moved.position + 1e-7 * noise[0], effort=moved.effort + 0.05 * noise[1])


def test_a_time_ends_for_those_who_asked_for_it_alone() -> None:
    assert not is_over()
    seen = []
    with within(1e-3):
        time.sleep(2e-3)
        assert is_over()
        other = threading.Thread(target=lambda: seen.append(is_over()))
        other.start()
        other.join()
        with within(60.0):
            assert not is_over()
        assert is_over()
    assert not is_over()
    assert seen == [False]


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan")])
def test_no_time_is_refused(seconds: float, record: Record) -> None:
    with pytest.raises(InputError, match="is no time"):
        fric.diagnose(record, NOMINAL, blocks=4, at_most=seconds)


def test_what_was_found_by_then_is_told_with_a_note(record: Record) -> None:
    fric.diagnose(record, NOMINAL, blocks=4, at_most=1e-3)  # what is compiled is, then
    begun = time.perf_counter()
    ended = fric.diagnose(record, NOMINAL, blocks=4, at_most=1e-3)
    taken = time.perf_counter() - begun
    assert any("the search was ended" in note for note in ended.result.notes)
    assert ended.result.mismatch
    assert not ended.result.components  # weighing them takes longer than all else
    begun = time.perf_counter()
    whole = fric.diagnose(record, NOMINAL, blocks=4)
    assert {"ripple", "stiffness"} <= {each.effect for each in whole.findings}
    assert not any("the search was ended" in note for note in whole.result.notes)
    assert taken < time.perf_counter() - begun
