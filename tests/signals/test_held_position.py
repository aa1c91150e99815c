"""A position that is repeated until its next update, and motions that look like one and aren't."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric.identification import METHODS
from fric.identification.result import Options
from fric.model import build_model, term
from fric.record import Record
from fric.signals.conditioning import conditioned
from fric.signals.held_position import NOTE, updated

from .conftest import COULOMB, INERTIA, VISCOUS, turned


def held(record: Record, every: int) -> Record:
    """``record`` as a logger leaves it that reads a position of the bus ``every`` of its samples."""
    at = np.arange(record.n_samples) // every * every
    return replace(record, position=record.position[at], velocity=None, reference=None)


@pytest.mark.parametrize("every", [2, 4, 9])
def test_only_updates_are_kept(every: int) -> None:
    true = turned(rate=400.0)
    found = updated(held(true, every))
    assert found.n_samples == pytest.approx(true.n_samples / every, abs=2)
    assert found.sample_time == pytest.approx(every / 400.0)
    at = np.searchsorted(true.time, found.time - 1e-9)
    assert np.array_equal(found.position, true.position[at])
    # The mean force from each update to the next: none of the momentum is lost.
    assert float(np.sum(found.effort)) * every == pytest.approx(float(np.sum(true.effort)), rel=0.01, abs=every)
    assert found.hold == "following"
    assert any(note.startswith(NOTE) and f"every {every}" in note for note in found.notes)
    assert updated(found) is found


def test_a_fit_to_it_finds_the_axis() -> None:
    structure = build_model("rigid", {"mass": 0.01}, [term("coulomb", force=0.1), term("viscous", coefficient=0.01)])
    fitted = METHODS["inverse-dynamics"].fit(structure, [conditioned(held(turned(rate=400.0), 4))], Options()).model
    values = dict(zip(fitted.names, fitted.values.tolist(), strict=True))
    assert values["mass"] == pytest.approx(INERTIA, rel=0.1)
    assert values["coulomb.force"] == pytest.approx(COULOMB, rel=0.1)
    assert values["viscous.coefficient"] == pytest.approx(VISCOUS, rel=0.1)


def test_what_moves_at_every_sample_or_rests_by_itself_is_left() -> None:
    true = turned()
    assert updated(true) is true
    coarse = replace(true, position=0.05 * np.round(true.position / 0.05))
    assert updated(coarse) is coarse
    # Stick-slip: it rests for 90 ms, and slips through 10 samples on end.
    phase = np.arange(20_000) % 100
    slip = np.cumsum(np.where(phase >= 90, 1.0, 0.0)) * 1e-4
    jerky = Record(1e-3 * np.arange(20_000), slip, 5.0 + 1e-2 * phase)
    assert updated(jerky) is jerky
