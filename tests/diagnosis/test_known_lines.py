"""An encoder's error within its lines, shown by one recording, is taken off another that hardly shows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from fric.diagnosis.intake import without_faults
from fric.instrument import inspect
from fric.model import build_model, term
from fric.record import Record
from fric.simulation import simulate
from numpy.typing import NDArray

Array = NDArray[np.float64]

MODEL = build_model("rigid", {"mass": 3.0}, [term("coulomb", force=6.0), term("viscous", coefficient=200.0)])
PITCH, SIZE = 4e-4, 2e-6  # [m]


def error_at(position: Array, phase: float) -> Array:
    """Error of the sensor: of two harmonics, from wherever it was switched on."""
    angle = 2.0 * np.pi * position / PITCH + phase
    return SIZE * np.sin(angle) + 0.7 * SIZE * np.cos(2.0 * angle)


def pushed(seed: int, seconds: float, size: float) -> Record:
    """A slide pushed to and fro; what it is pushed by is ``size`` times 12 N and 6 N at two frequencies."""
    random = np.random.default_rng(seed)
    time = 2e-3 * np.arange(round(seconds / 2e-3))
    force = size * (12.0 * np.sin(2.0 * np.pi * 0.7 * time) + 6.0 * np.sin(2.0 * np.pi * 1.9 * time + 1.0))
    position = np.round(simulate(MODEL, force, 2e-3).position / 2e-7) * 2e-7
    return replace(Record(time, position, force + 0.02 * random.standard_normal(time.size)), source=f"run {seed}")


def erring(record: Record, phase: float) -> Record:
    return replace(record, position=record.position + error_at(record.position, phase))


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def corrected(clean: Record, phase: float) -> tuple[Record, list[str]]:
    """A recording held back of which only one learnt from tells the pitch, as the diagnosis takes it."""
    learnt, held = erring(pushed(8, 12.0, 1.0), 0.4), erring(clean, phase)
    own = next(each for each in inspect([held], MODEL) if each.check == "interpolation")
    assert own.correction is None, own.detail
    _, (found,), notes = without_faults([learnt], [held], MODEL, inspect([learnt], MODEL))
    return found, notes


def test_lines_known_from_one_recording_are_taken_off_another() -> None:
    clean = pushed(9, 1.3, 0.9)
    found, notes = corrected(clean, 2.0)
    moving = np.abs(np.gradient(clean.position, 2e-3)) > 2e-3
    before, after = rms(error_at(clean.position, 2.0)[moving]), rms((found.position - clean.position)[moving])
    assert after < 0.4 * before
    assert any("run 9, too" in note for note in notes)


def test_a_position_without_an_error_stays_nearly_as_it_is() -> None:
    clean = pushed(9, 1.3, 0.9)
    learnt = erring(pushed(8, 12.0, 1.0), 0.4)
    _, (found,), _ = without_faults([learnt], [clean], MODEL, inspect([learnt], MODEL))
    assert rms(found.position - clean.position) < 0.1 * SIZE
