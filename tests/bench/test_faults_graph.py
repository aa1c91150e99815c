"""Faults in the running graph, a few of each kind: no unsafe sample, causes named; and the judge does find what is unsafe."""

from __future__ import annotations

from pathlib import Path

import pytest
from fric.bench.fault_rig import LIMITS
from fric_nodes.benchmarks.faults_graph import BENCHMARK, inject
from fric_nodes.cli.main import build_app
from fric_nodes.fault_graph.faults import FAULTS
from fric_nodes.fault_graph.judge import Judge
from fric_nodes.fault_graph.judged_plant import ENTRY
from typer.testing import CliRunner

MS = 1_000_000  # [ns]
SHORT = [
    "command 1e308",
    "joint state frozen",
    "reference from a second publisher",
    "pid stopped",
    "parameters to nonsense in motion",
]


def expect_safe(names: list[str], times: int) -> None:
    lines: list[str] = []
    for name, outcomes in inject(names, times, lines.append).items():
        for each in outcomes:
            assert each.unsafe == 0, f"{name}: {each.why}"
            assert each.named, f"{name}: {sorted(each.said)}"
            assert each.slow_stops == 0, name
            assert each.moves, f"{name}: {sorted(each.said)}"
            assert each.samples > 20, name
    assert len(lines) == len(names)


@pytest.mark.long
@pytest.mark.alone
def test_a_few_faults_of_the_running_graph() -> None:
    expect_safe(SHORT, 1)


@pytest.mark.alone
@pytest.mark.long
@pytest.mark.timeout(1200)
def test_every_fault_of_the_running_graph() -> None:
    expect_safe(list(FAULTS), 3)


def record(folder: Path, *entries: tuple[float, float, float, int]) -> None:
    """Entries of time [ms], force [N], position [m] and state."""
    packed = [ENTRY.pack(10**18 + round(t * MS), force, position, state) for t, force, position, state in entries]
    (folder / "1.drive").write_bytes(b"".join(packed))


@pytest.mark.parametrize(
    ("entries", "found"),
    [
        ([(0, 0.0, 0.0, 1), (4, 20.0, 0.0, 1), (8, 40.0, 1e-3, 1)], ""),
        ([(0, 0.0, 0.0, 1), (4, 20.1, 0.0, 1)], "force from 0 to 20.1"),
        ([(0, 0.0, 0.0, 1), (100, 101.0, 0.0, 1)], "force 101"),
        ([(0, 0.0, 0.0, 1), (4, 0.0, 2.1e-3, 1)], "speed 0.525"),
        ([(0, 0.0, 0.1, 1), (4, 0.0, 0.1001, 1)], "position 0.1001"),
        ([(0, 0.0, 0.0, 1), (20, 50.0, 0.0, 1), (90, 0.0, 0.0, 1)], ""),  # the watchdog, in a process that was held up
        ([(0, 0.0, 0.0, 1), (20, 50.0, 0.0, 1), (29, 0.0, 0.0, 1)], "force from 50 to 0"),
        ([(0, float("nan"), 0.0, 1)], "force nan"),
    ],
)
def test_the_judge(tmp_path: Path, entries: list[tuple[float, float, float, int]], found: str) -> None:
    record(tmp_path, *entries)
    judge = Judge(tmp_path, LIMITS, 0.05)
    outcome = judge.look()
    assert outcome.samples == len(entries)
    assert outcome.why.startswith(found)
    assert (outcome.unsafe > 0) == bool(found)
    assert judge.look().samples == 0


def test_the_judge_finds_a_stop_that_takes_too_long(tmp_path: Path) -> None:
    stopping = [(4 * k, 0.0, 4e-4 * k, 1 if k < 5 else 2) for k in range(200)]
    record(tmp_path, *stopping)
    assert Judge(tmp_path, LIMITS, 0.05).look().slow_stops == 1


def test_the_command_line_offers_it() -> None:
    assert BENCHMARK.long
    runner = CliRunner()
    assert "faults-graph" in runner.invoke(build_app(), ["bench", "--list"]).output
    refused = runner.invoke(build_app(), ["bench", "laws", "--graph"])
    assert refused.exit_code != 0
