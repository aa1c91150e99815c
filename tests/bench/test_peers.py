"""Ratios of ``fric bench peers``: how they are formed, what is printed of them, and that both ways of a pair do the same."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from fric.bench.benchmark import Benchmark
from fric.bench.benchmarks.recordings import write_bag
from fric.bench.peer import Pair, Peer, measure
from fric.bench.peers import bag_readers, mujoco_axis, naive_fits, solve_ivp_runs
from fric.figure import Figure
from fric.model import term
from fric.registry import discover
from fric.simulation import simulate
from fric_nodes.cli import bench
from fric_nodes.peers.hop import answers_per_second
from typer import Typer
from typer.testing import CliRunner


@pytest.mark.parametrize(
    ("goal", "expected", "reached"),
    [(">= 4", (3.2, 4.0, 4.8), True), ("<= 0.2", (0.21, 0.25, 0.3167), False), ("", (3.2, 4.0, 4.8), None)],
)
def test_a_ratio_is_the_median_of_its_turns_with_the_middle_of_them(
    goal: str, expected: tuple[float, float, float], reached: bool | None
) -> None:
    ours, theirs = iter([2.0, 1.0, 1.0]), iter([8.0, 5.0, 3.0])
    pair = Pair("work", lambda: next(ours), lambda: next(theirs), goal, turns=3, warm=False)
    ratio, mine, other = measure([pair])
    assert (ratio.low, ratio.value, ratio.high) == pytest.approx(expected, rel=1e-3)
    assert ratio.reached is reached
    assert (mine.value, other.value, mine.unit, other.unit) == (1.0, 5.0, "s", "s")


def test_turns_alternate_and_are_spread_over_the_rounds() -> None:
    order: list[str] = []

    def made(name: str, turns: int) -> Pair:
        def did(who: str) -> float:
            order.append(f"{name}{who}")
            return 1.0

        return Pair(name, lambda: did("+"), lambda: did("-"), turns=turns, warm=False)

    rounds: list[str] = []
    measure([made("a", 4), made("b", 2)], rounds.append)
    assert order == ["a+", "a-", "a-", "a+", "b-", "b+", "a+", "a-", "a-", "a+", "b-", "b+"]
    assert len(rounds) == 4


def test_the_first_turn_does_not_count() -> None:
    ours = iter([100.0, 1.0])
    ratio, *_ = measure([Pair("work", lambda: next(ours), lambda: 2.0, turns=1)])
    assert ratio.value == 2.0


def test_what_is_short_is_repeated_until_both_last_as_long() -> None:
    ours = iter([9.0, 0.5, 0.4, 0.6, 0.5, 0.5, 9.0])
    ratio, mine, _ = measure([Pair("work", lambda: next(ours), lambda: 2.0, turns=1, even=True)])
    assert mine.value == pytest.approx(0.5)  # four of them, after one to warm up and one to count by
    assert ratio.value == pytest.approx(4.0)
    assert next(ours) == 9.0


def _never() -> float:
    raise AssertionError("what is missing is not run")


def test_what_is_not_installed_is_said_to_be_skipped(monkeypatch: pytest.MonkeyPatch) -> None:
    pairs = [
        Pair("axis", _never, _never, ">= 50", needs="no_such_simulator"),
        Pair("law", _never, _never, ">= 0.9", without="there is no C compiler"),
        Pair("work", lambda: 1.0, lambda: 3.0, ">= 2", turns=2, beside=lambda: [Figure("error", 0.5, "%")]),
    ]
    monkeypatch.setattr("fric.bench.BENCHMARKS", {"peers": Benchmark("peers", "peers", lambda: measure(pairs), long=True)})
    app = Typer()
    bench.register(app)
    app.command("other")(lambda: None)  # with one command alone typer leaves its name out
    said = CliRunner().invoke(app, ["bench", "peers"])
    assert said.exit_code == 0, said.output
    assert "skipped: axis: no_such_simulator is not installed: pip install 'fric[peers]'" in said.stdout.splitlines()
    assert "skipped: law: there is no C compiler" in said.stdout.splitlines()
    assert "3 (3 to 3)" in said.stdout
    axis, law, ratio, *_, error = json.loads(CliRunner().invoke(app, ["bench", "peers", "--json"]).stdout)
    assert (axis["value"], axis["reached"], law["value"]) == (None, None, None)
    assert "no_such_simulator" in axis["skipped"]
    assert (ratio["value"], ratio["low"], ratio["high"], ratio["reached"]) == (3.0, 3.0, 3.0, True)
    assert error == {"name": "work: error", "value": 0.5, "unit": "%", "goal": "", "reached": None}


def test_all_tasks_are_found() -> None:
    found = {peer.id for peer in discover("fric.bench.peers", "PEER", Peer)}
    assert found == {"bag-readers", "c-loops", "mujoco", "naive-fits", "solve_ivp", "hop", "start-up"}


def test_solve_ivp_by_events_and_with_bristles_come_to_the_motion_of_fric() -> None:
    effort = np.array([solve_ivp_runs.push((k + 0.5) * 1e-3) for k in range(2001)])
    bristles = term("presliding", "lugre", stiffness=1e5, damping=100.0)
    for model, position in (
        (solve_ivp_runs.model(), solve_ivp_runs.with_events("RK45", 1e-6)),
        (solve_ivp_runs.model(bristles), solve_ivp_runs.with_bristles("LSODA", 1e-6)),
    ):
        motion = simulate(model, effort, 1e-3)
        assert np.sqrt(np.mean((motion.position - position) ** 2)) < 3e-4 * np.ptp(position)
    rests = np.diff(solve_ivp_runs.with_events("RK45", 1e-6)) == 0.0
    assert 0.02 < np.mean(rests) < 0.5


def test_the_simulator_in_python_follows_the_closed_form() -> None:
    # u - F_C = 2 on 1.2 kg with 10 N s/m: v tends to 0.2 with the time constant 0.12; and under 3 N nothing moves.
    h, values = 1e-4, np.array([1.2, 4.0, 0.0, 0.0, 10.0, 0.0])
    position = naive_fits.step_by_step(values, [6.0] * 4001, h, 0.5)
    t, tau = h * np.arange(4001), 0.12
    np.testing.assert_allclose(position - 0.5, 0.2 * (t - tau * (1.0 - np.exp(-t / tau))), atol=2e-5)
    assert np.all(naive_fits.step_by_step(values, [3.0] * 10, h, 0.5) == 0.5)


def test_all_readers_give_the_same_arrays(tmp_path: Path) -> None:
    for storage in ("mcap", "sqlite3"):
        write_bag(tmp_path / storage, storage, 500)  # type: ignore[arg-type]
    states, forces = bag_readers.by_rosbags(tmp_path / "sqlite3")
    assert states.shape == (500, 4)
    np.testing.assert_allclose(states[:, 0], np.arange(500) / 1e3, rtol=1e-12)
    np.testing.assert_array_equal(states[:, 1], np.sin(np.arange(500) * 1e-3))
    np.testing.assert_array_equal(forces, 10.0 * states[:, 1])
    pytest.importorskip("mcap_ros2", reason="in the extra peers")
    for again, kept in zip(bag_readers.by_mcap_ros2(tmp_path / "mcap"), (states, forces), strict=True):
        np.testing.assert_array_equal(again, kept)


def test_mujoco_simulates_the_same_axis() -> None:
    pytest.importorskip("mujoco", reason="in the extra peers")
    (apart,) = mujoco_axis.apart()
    assert apart.value < 0.01


@pytest.mark.long
@pytest.mark.parametrize("executor", ["default", "events"])
def test_two_bare_nodes_answer_each_other(executor: str) -> None:
    assert answers_per_second(executor, 200) > 20.0
