"""The dirty recordings themselves, and intervals on a few of them (all of them: ``fric bench dirt``)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric.bench.benchmarks.dirt import CASES, _Guarded, figures
from fric.bench.dirty_axis import Axis, Dirt, drawn, recorded
from fric.identification import METHODS
from fric.identification.result import Options
from fric.identification.start import start_model
from fric.record import Record, Units
from fric.signals.conditioning import conditioned
from scipy.integrate import solve_ivp

AXIS = Axis(2.0, 5.0, 12.0, 0.0)
CLEAN = Dirt(1000.0, 1, 1e6, 0.0, 0.0, False, "following", 0.0, 0.0, 0.0, 0.0, 0, False, False)
KINDS = {
    "4096 steps": replace(CLEAN, steps=4096.0),
    "300 steps": replace(CLEAN, steps=300.0),
    "late stamps": replace(CLEAN, jitter=5e-4, steps=1e5),
    "late reading": replace(CLEAN, jitter=3e-4, sampled_late=True, steps=1e5),
    "slow log": replace(CLEAN, every=10, steps=1e5),
    "mean force": replace(CLEAN, every=4, hold="mean", steps=1e5),
    "single precision": replace(CLEAN, single=True, steps=1e5),
    "start in motion": replace(CLEAN, in_motion=True, steps=1e5),
    "pink force noise": replace(CLEAN, pink=0.02, steps=1e5),
    "mains": replace(CLEAN, mains=0.05, steps=1e5),
    "coarse current": replace(CLEAN, force_step=0.05, steps=1e5),
}


def test_the_truth_is_what_an_integrator_of_scipy_gives() -> None:
    """Along the recorded force, from the first sample on, within each held interval."""
    record = recorded(AXIS, replace(CLEAN, steps=1e8), 7, 2.0)
    # From the first sample that moves on, the equation of motion without sticking holds until the next reversal.
    velocity = np.gradient(record.position, record.sample_time)
    first = int(np.argmax(np.abs(velocity) > 0.02))
    last = first + int(np.argmax(np.sign(velocity[first:]) != np.sign(velocity[first]))) - 5
    sign = float(np.sign(velocity[first]))
    q, v = float(record.position[first]), float((record.position[first + 1] - record.position[first]) / record.sample_time)
    held = record.effort[first]
    v -= 0.5 * record.sample_time * (held - AXIS.coulomb * sign - AXIS.viscous * v) / AXIS.mass
    for k in range(first, last):
        u = float(record.effort[k])
        span = (record.time[k], record.time[k + 1])
        slope = lambda t, x, u=u: [x[1], (u - AXIS.coulomb * sign - AXIS.viscous * x[1]) / AXIS.mass]  # noqa: E731
        answer = solve_ivp(slope, span, [q, v], rtol=1e-10, atol=1e-13)
        q, v = (float(x) for x in answer.y[:, -1])
    assert last - first > 100
    assert q == pytest.approx(float(record.position[last]), abs=2e-7)


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_dirt_leaves_the_values_within_their_intervals(kind: str) -> None:
    record: Record = conditioned(recorded(AXIS, KINDS[kind], 11))
    structure = start_model(["coulomb", "viscous", "bias"], "axis", Units())
    found = METHODS["inverse-dynamics"].fit(structure, [record], Options()).model
    for name, true in AXIS.named().items():
        off = abs(found.value(name) - true)
        assert off < max(0.01 * abs(true), 3.0 * found.standard_errors[name]), (kind, name, found.value(name))


def test_dirt_is_drawn_from_the_whole_range() -> None:
    draws = [drawn(seed)[1] for seed in range(300)]
    assert min(d.steps for d in draws) < 400.0
    assert max(d.steps for d in draws) > 6e5
    assert min(d.rate / d.every for d in draws) < 90.0
    assert {d.hold for d in draws} == {"following", "preceding", "mean"}
    assert {d.every for d in draws} >= {1, 2, 5, 10}


@pytest.mark.parametrize("method", ["inverse-dynamics"])
def test_a_few_dirty_recordings(method: str) -> None:
    shares = {figure.name: figure.value for figure in figures(method, range(12), 1)}
    # Of 48 intervals of 90 %: 43 +- 2.
    assert shares[f"{method}: 90 % intervals that hold the truth"] > 0.72


def test_every_method_has_a_trial() -> None:
    assert set(CASES) == set(METHODS)


@pytest.mark.parametrize("method", ["forced-oscillation", pytest.param("two-stage", marks=pytest.mark.long), "tensor-product"])
def test_methods_that_need_motions_of_their_own(method: str) -> None:
    names = {"forced-oscillation": "mass", "two-stage": "presliding.stiffness_1", "tensor-product": "speeding up at 10 mm/s"}
    answers = [_Guarded(CASES[method])(seed) for seed in range(3)]
    found = [finding[names[method]] for finding, _ in (answer for answer in answers if answer is not None)]
    assert found, answers
    assert all(abs(off) < 5.0 * error or np.isnan(error) for off, error in found), found
