"""Ripples of hundreds of cycles over the travel: told by the spectrum over position, found by a diagnosis."""

from __future__ import annotations

import numpy as np
import pytest
from fric.diagnosis import diagnose
from fric.diagnosis.fine import fine_periods
from fric.model import build_model, term
from fric.record import Record
from fric.simulation import simulate

PITCH = 2.5e-3
H = 1e-3


def test_lines_are_found_between_the_grid() -> None:
    random = np.random.default_rng(7)
    position = 0.2 * np.sin(np.cumsum(random.uniform(0.0, 2e-3, 12_000)))
    noise = random.standard_normal(position.shape[0])
    missing = 0.4 * np.cos(2 * np.pi * position / PITCH + 0.3) + 0.35 * np.sin(2 * np.pi * position / 4.1e-3) + noise
    found = fine_periods(position, missing, 24.0, 400.0)
    assert found == pytest.approx([PITCH, 4.1e-3], rel=2e-4)  # a tenth of a cycle over the travel is 6e-4


def test_a_line_just_beyond_the_grid_is_found_where_hardly_more_is_seen() -> None:
    random = np.random.default_rng(4)
    position = 0.2 * np.sin(np.cumsum(random.uniform(0.0, 2e-3, 8_000)))
    period = 0.4 / 27.3  # 27.3 cycles over the travel, where 60 are seen
    missing = 2.0 * np.cos(2 * np.pi * position / period) + np.sin(8.0 * position) + random.standard_normal(position.shape[0])
    assert fine_periods(position, missing, 24.0, 60.0) == pytest.approx([period], rel=2e-3)
    assert fine_periods(position, missing, 24.0, 26.0) == []


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("seen", [60.0, 400.0])
def test_noise_has_no_lines(seen: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    position = 0.2 * np.sin(np.cumsum(random.uniform(0.0, 2e-3, 6_000)))
    slow = np.convolve(random.standard_normal(6_200), np.exp(-np.arange(201) / 40.0), "valid")
    assert fine_periods(position, slow, 24.0, seen) == []


def test_an_axis_that_hardly_moves_has_none() -> None:
    assert fine_periods(np.full(100, 0.3), np.ones(100), 24.0, 400.0) == []
    assert fine_periods(np.linspace(0.0, 1.0, 100), np.ones(100), 24.0, 30.0) == []
    moved = np.linspace(0.0, 1.0, 100)
    assert fine_periods(moved, np.sin(30.0 * moved), 0.4, 0.8) == []  # less than a cycle is seen


@pytest.mark.long
def test_the_balls_of_a_screw_are_found() -> None:
    """80 cycles over the travel, beyond every period that is tried one by one."""
    known = [term("coulomb", force=20.0), term("viscous", coefficient=120.0)]
    truth = build_model("rigid", {"mass": 60.0}, [*known, term("ripple", cosine=1.2, sine=-0.9, period=PITCH)])
    nominal = build_model("rigid", {"mass": 57.0}, [term("coulomb", force=21.0), term("viscous", coefficient=110.0)])

    def recording(seed: int) -> Record:
        random = np.random.default_rng(seed)
        time = H * np.arange(12_000)
        # Back and forth at 20 to 80 mm/s under a force that a speed loop would give, worked out from the nominal motion.
        speed = 0.05 * np.sin(2 * np.pi * 0.09 * time + seed) + 0.03 * np.sin(2 * np.pi * 0.31 * time)
        effort = 60.0 * np.gradient(speed, H) + 20.0 * np.tanh(speed / 1e-3) + 120.0 * speed
        moved = simulate(truth, effort, H, n_substeps=4)
        position = np.round((moved.position + 2e-8 * random.standard_normal(time.size)) / 2e-8) * 2e-8
        return Record(time, position, effort + 0.05 * random.standard_normal(time.size), source=f"bag {seed}")

    found = diagnose([recording(1), recording(2)], [recording(3)], nominal)
    assert [each.effect for each in found.findings] == ["ripple"]
    ripple = {name.split(".")[-1]: each.value for name, each in found.findings[0].parameters.items()}
    assert ripple["period"] == pytest.approx(PITCH, rel=1e-3)
    assert np.hypot(ripple["cosine"], ripple["sine"]) == pytest.approx(1.5, rel=0.05)
    assert found.findings[0].confidence > 0.8
