"""The fault table, a few of each: no unsafe sample, causes named; and the judge does find what is unsafe."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fric.bench import BENCHMARKS
from fric.bench.benchmarks.faults import trial
from fric.bench.fault_rig import LIMITS, FaultRig
from fric.bench.faults import FAULTS, inject


@pytest.mark.parametrize("name", FAULTS)
def test_no_fault_makes_an_unsafe_sample(name: str, tmp_path: Path) -> None:
    fault = FAULTS[name]
    ports = [tmp_path / "drive"] if fault.serial_only else [None, tmp_path / "drive"]
    for number, port in enumerate(ports):
        outcome, named, moves = trial(name, fault, number, port)
        assert outcome.unsafe == 0, outcome.why
        assert named, outcome.names
        assert outcome.stopped
        assert moves


def test_without_a_fault_nothing_happens() -> None:
    rig = FaultRig(None, np.random.default_rng(0))
    rig.enable()
    rig.run(6.0)
    outcome = rig.conclude()
    assert outcome.unsafe == 0
    assert outcome.names <= {"force rate limit"}
    assert max(abs(rig._position), 0.0) <= 0.031


@pytest.mark.parametrize(
    ("name", "removed", "found"),
    [
        ("joint state frozen", {"inertia_min": 0.0}, ("speed", "position")),
        ("command burst", {"force": 1e4, "force_rate": 1e9}, ("force",)),
        ("command from a second source", {"force_rate": 1e6}, ("force rate",)),
    ],
)
def test_the_judge_finds_what_a_weaker_layer_lets_through(name: str, removed: dict[str, float], found: tuple[str, ...]) -> None:
    whys = []
    for number in range(6):
        random = np.random.default_rng(number)
        rig = FaultRig(None, random, replace(LIMITS, **removed))
        inject(rig, FAULTS[name], random)
        whys.append(rig.outcome.why)
    assert any(why.startswith(found) for why in whys), whys


def test_the_benchmark_is_there_and_long() -> None:
    assert BENCHMARKS["faults"].long


@pytest.mark.long
@pytest.mark.timeout(1800)
def test_the_whole_table() -> None:
    missed = [figure for figure in BENCHMARKS["faults"].run() if figure.reached is False]
    assert not missed
