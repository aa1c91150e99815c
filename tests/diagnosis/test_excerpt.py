"""Excerpts of long recordings: they must not begin where only what came before could tell the state of a contact."""

from __future__ import annotations

import itertools

import numpy as np
from fric_nodes.diagnosis.excerpt import excerpt
from fric_nodes.diagnosis.track import Track
from fric_nodes.model import build_model, term
from fric_nodes.record import Record

H, N = 0.001, 60_000
MASS, COULOMB = 2.0, 4.0


def _record() -> Record:
    """Moves of half a second, each after a rest of seven tenths; the force is that of the mass and of Coulomb friction."""
    time = np.arange(N) * H
    phase = np.mod(time, 1.2)
    direction = np.where(np.mod(np.floor(time / 1.2), 2.0) == 0.0, 1.0, -1.0)
    moving = phase > 0.7
    at = 2.0 * np.pi * (phase - 0.7) / 0.5
    velocity = np.where(moving, 0.1 * direction * (1.0 - np.cos(at)), 0.0)
    acceleration = np.where(moving, 0.1 * direction * (2.0 * np.pi / 0.5) * np.sin(at), 0.0)
    effort = MASS * acceleration + np.where(moving, COULOMB * direction, 0.0)
    effort += 0.05 * np.random.default_rng(4).standard_normal(N)
    return Record(time, np.cumsum(velocity) * H, effort, effort_hold="following")


def test_parts_begin_in_motion() -> None:
    model = build_model("rigid", {"mass": MASS}, [term("coulomb", force=COULOMB)])
    record = _record()
    parts = excerpt([Track.of([record], 45.0, model)], model, most=16_000)
    assert parts is not None
    assert 0.5 * 16_000 < parts.n_kept < 1.5 * 16_000
    speed = np.abs(np.gradient(record.position, H))
    track = parts.tracks[0]
    for run, time in zip(track.runs, track.time, strict=True):
        first = round(float(time[0] - run.step[0]) / H)
        assert np.array_equal(run.effort[5:50], record.effort[first + 5 : first + 50]), "time and force are of the same part"
        if first > 0:
            assert speed[first] > 0.1 * np.max(speed), f"a part begins at rest, at {first * H:.2f} s"
    spans = [(float(time[0]), float(time[-1])) for time in track.time]
    assert all(one[1] < other[0] for one, other in itertools.pairwise(spans)), "no sample counts twice"


def test_a_short_recording_is_taken_whole() -> None:
    model = build_model("rigid", {"mass": MASS}, [term("coulomb", force=COULOMB)])
    assert excerpt([Track.of([_record()], 45.0, model)], model, most=50_000) is None
