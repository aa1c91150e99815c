"""Excerpts of long recordings: they must not begin where only what came before could tell the state of a contact."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from fric.diagnosis.excerpt import excerpt
from fric.diagnosis.track import Track
from fric.model import Term, build_model, term
from fric.record import Record
from fric.simulation import simulate

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
    counts = [time[lead:] for time, lead in zip(track.time, track.lead, strict=True)]
    for run, time, lead in zip(track.runs, counts, track.lead, strict=True):
        first = round(float(time[0] - run.step[0]) / H)
        of_part, recorded = run.effort[lead + 5 : lead + 50], record.effort[first + 5 : first + 50]
        assert np.array_equal(of_part, recorded), "time and force are of the same part"
        if first > 0:
            assert speed[first] > 0.1 * np.max(speed), f"a part begins at rest, at {first * H:.2f} s"
    spans = [(float(time[0]), float(time[-1])) for time in counts]
    assert all(one[1] < other[0] for one, other in itertools.pairwise(spans)), "no sample counts twice"


@pytest.mark.parametrize(
    "remembering",
    [
        (term("stribeck", force=6.0, velocity=0.03), term("frictional_lag", time=0.2)),
        (term("compliance", law="appendage", mass=0.8, frequency=6.0, damping=0.04),),
        (term("impact_backlash", gap=2e-4, stiffness=4e4, damping=10.0),),
        (term("presliding", stiffness=2e4, damping=50.0),),
        (term("actuator_lag", time=0.02),),
    ],
    ids=lambda terms: terms[-1].effect.id,
)
def test_what_a_part_remembers_is_what_there_was(remembering: tuple[Term, ...]) -> None:
    """What the model lacks in a part is what it lacks there when it is led through everything."""
    model = build_model("rigid", {"mass": MASS}, [term("coulomb", force=COULOMB), *remembering])
    h = H / 2.0
    time = h * np.arange(24_000)
    effort = 14.0 * np.sin(2 * np.pi * 0.9 * time) + 5.0 * np.sin(2 * np.pi * 4.3 * time + 1.0)
    simulated = simulate(model, effort, h)
    whole = Track.of([Record(time, simulated.position, effort)], 140.0, model)
    other = model.with_terms(each for each in model.terms if each.effect.id == "coulomb")
    spans = [(0, 6_300, 7_300), (0, 15_100, 16_100)]
    parts = whole.parts(spans)
    for lacking in (model, other):
        expected = whole.padded(whole.residual(lacking))[0]
        for (_, first, last), found in zip(spans, parts.split(parts.residual(lacking)), strict=True):
            assert found.shape == (last - first,)
            assert np.max(np.abs(found - expected[first:last])) < 0.02 * COULOMB
    assert np.std(whole.residual(other)) > 0.05 * COULOMB, "it is seen where it is left out"


def test_a_short_recording_is_taken_whole() -> None:
    model = build_model("rigid", {"mass": MASS}, [term("coulomb", force=COULOMB)])
    assert excerpt([Track.of([_record()], 45.0, model)], model, most=50_000) is None
