"""Errors within an encoder's lines: found with their pitch and size, told from motions of the same period, taken off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric.instrument import CHECKS, Evidence, Finding
from fric.instrument.lines import PositionError
from fric.model import build_model, term
from fric.record import Record
from fric.simulation import simulate
from numpy.typing import NDArray

Array = NDArray[np.float64]

PITCH, FIRST, SECOND = 4e-4, 2e-6, 1.5e-6


def erring(position: Array) -> Array:
    """Error of a sensor at ``position``, of two harmonics."""
    angle = 2.0 * np.pi * position / PITCH
    return FIRST * np.sin(angle + 0.4) + SECOND * np.cos(2.0 * angle)


def judged(record: Record) -> Finding:
    return CHECKS["interpolation"].run(Evidence((record,)))[0]


@pytest.fixture(scope="module")
def moved() -> Record:
    """A slide pushed to and fro by forces of several frequencies; its encoder is exact but for rounding to 0.2 um."""
    return pushed(ripple=0.0)


def pushed(ripple: float) -> Record:
    """The same with a force of amplitude ``ripple`` [N] that repeats with the lines."""
    random = np.random.default_rng(8)
    time = 2e-3 * np.arange(6000)
    force = 12.0 * np.sin(2.0 * np.pi * 0.7 * time) + 6.0 * np.sin(2.0 * np.pi * 1.9 * time + 1.0)
    terms = [term("coulomb", force=6.0), term("viscous", coefficient=200.0)]
    if ripple:
        terms.append(term("ripple", sine=ripple, cosine=0.0, period=PITCH))
    model = build_model("rigid", {"mass": 3.0}, terms)
    run = simulate(model, force, 2e-3)
    position = np.round(run.position / 2e-7) * 2e-7
    return Record(time, position, force + 0.02 * random.standard_normal(time.size))


def test_an_error_is_found_with_its_pitch_and_its_size(moved: Record) -> None:
    finding = judged(replace(moved, position=moved.position + erring(moved.position)))
    assert finding.verdict == "warning", finding.detail
    assert finding.value == pytest.approx(np.hypot(FIRST, SECOND), rel=0.05)
    assert finding.correction is not None
    assert finding.correction.position_error is not None
    assert finding.correction.position_error.pitch == pytest.approx(PITCH, rel=1e-3)
    assert "within lines of" in finding.correction.text


def test_what_is_taken_off_is_the_error(moved: Record) -> None:
    wrong = replace(moved, position=moved.position + erring(moved.position))
    correction = judged(wrong).correction
    assert correction is not None
    left = correction.apply(wrong).position - moved.position
    assert np.std(left) < 0.1 * np.std(erring(moved.position))
    again = judged(correction.apply(wrong))
    assert again.correction is None
    assert again.value < 0.03 * FIRST


def test_an_exact_encoder_has_no_error(moved: Record) -> None:
    assert judged(moved).verdict == "ok"


def test_a_force_of_the_same_period_moves_the_axis() -> None:
    finding = judged(pushed(ripple=3.0))
    assert finding.verdict == "ok", finding.detail
    assert "a motion of the axis" in finding.detail
    assert finding.correction is None


def test_what_does_not_move_has_no_lines(moved: Record) -> None:
    assert judged(replace(moved, position=np.zeros(moved.n_samples))).verdict == "unknown"


def test_an_error_is_a_function_of_the_true_position() -> None:
    # An error as large as a sixth of what would make the position ambiguous.
    error = PositionError(PITCH, (1e-5, 0.0), (0.0, 0.0))
    true = np.linspace(0.0, 3.0 * PITCH, 200)
    read = true + 1e-5 * np.sin(2.0 * np.pi * true / PITCH)
    assert error.taken_off(read) == pytest.approx(true, abs=4e-7)
    assert error.amplitude == pytest.approx(1e-5)
