"""What every benchmark has in common, and the fit that stands beside ours."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from fric.bench import BENCHMARKS, Benchmark
from fric.bench.benchmarks import instrument
from fric.bench.by_scipy import fit_by_scipy
from fric.figure import Figure
from fric.record import Record
from fric_nodes.cli import bench
from typer import Typer
from typer.testing import CliRunner


def app() -> Typer:
    made = Typer()
    bench.register(made)
    made.command("other")(lambda: None)  # with one command alone typer leaves its name out
    return made


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    names: list[str] = []

    def made(name: str, long: bool) -> Benchmark:
        return Benchmark(name, name, lambda: (names.append(name), [Figure(name, 1.0, "s", "<= 2")])[1], long)

    fakes = {name: made(name, name == "slow") for name in ("quick", "slow")}
    monkeypatch.setattr("fric.bench.BENCHMARKS", fakes)
    return names


@pytest.mark.parametrize(
    ("arguments", "expected"), [([], ["quick"]), (["--all"], ["quick", "slow"]), (["slow"], ["slow"]), (["--list"], [])]
)
def test_a_long_benchmark_runs_only_when_asked_for(ran: list[str], arguments: list[str], expected: list[str]) -> None:
    done = CliRunner().invoke(app(), ["bench", *arguments])
    assert done.exit_code == 0, done.output
    assert ran == expected
    if arguments != ["slow"]:
        assert "slow" in done.output


def test_the_list_names_the_long_ones() -> None:
    done = CliRunner().invoke(app(), ["bench", "--list", "--json"])
    listed: list[dict[str, Any]] = json.loads(done.stdout)
    assert {each["name"] for each in listed} == set(BENCHMARKS)
    assert {each["name"] for each in listed if each["long"]} >= {"calibration"}
    assert not BENCHMARKS["fitting"].long


def test_the_fit_by_scipy_finds_the_values() -> None:
    # A mass of 2 kg with 10 N s/m under 6 N less 4 N of friction: v tends to 0.2 m/s with the time constant 0.2 s.
    h = 2e-3
    time = h * np.arange(200)
    tau, v_end = 0.2, 0.2
    position = v_end * (time - tau * (1.0 - np.exp(-time / tau)))
    record = Record(time, position, np.full(200, 6.0), effort_hold="following")
    start = np.array([2.1, 4.0, 0.0, 0.0, 10.0, 0.0])
    found = fit_by_scipy(record, start, 0.02)
    assert found.rmse < 1e-5
    assert found.n_evaluations >= 7
    # Under one force, in one direction, only ratios to the mass are known.
    mass, coulomb, _, asymmetry, viscous, bias = found.values
    assert (viscous + asymmetry) / mass == pytest.approx(1.0 / tau, rel=0.02)
    assert (6.0 - coulomb - bias) / mass == pytest.approx(v_end / tau, rel=0.02)


@pytest.mark.parametrize(
    ("count", "trials", "interval"), [(9, 10, "0.596 to 0.982"), (0, 60, "0.000 to 0.060"), (60, 60, "0.940 to 1.000")]
)
def test_shares_come_with_wilsons_interval(count: int, trials: int, interval: str) -> None:
    figure = instrument._share("found", count, trials, ">= 0.9")
    assert figure.name == f"found: {count} of {trials} (95 %: {interval})"
    assert figure.value == count / trials
