"""Signals with clocks of their own, values in some rows only, and repairs: the parameters of the axis stay true."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
from fric.errors import InputError
from scipy.io import savemat


def pairs(run: Any, every: int, late: float = 0.0, truncated: bool = False) -> str:
    """A scope's text: a time beside each signal, the shorter columns ending early."""
    own, force = run.t[::every] + late, run.u[::every]
    lines = ["Name\tActPos\tName\tActTorque", "SampleTime[ms]\t1\tSampleTime[ms]\t2", "Unit\tmm\tUnit\tN", ""]
    for k in range(len(own) if truncated else len(run.t)):
        right = f"{own[k] * 1e3:.4f}\t{force[k]:.4f}" if k < len(own) else "\t"
        lines.append(f"{run.t[k] * 1e3:.4f}\t{run.q[k] * 1e3:.5f}\t{right}")
    return "\n".join(lines).replace(".", ",")


SCOPE = {
    "time": {"from": 0, "unit": "ms"},
    "position": {"from": 1, "unit": "mm"},
    "effort": {"from": 3, "unit": "N"},
}
OWN = {**SCOPE, "effort": {"from": 3, "unit": "N", "time": {"from": 2, "unit": "ms"}}}


@pytest.mark.parametrize("truncated", [False, True])
@pytest.mark.parametrize("repair", [False, True])
def test_signals_with_clocks_of_their_own_are_not_taken_together(
    imported: Any, run: Any, repair: bool, truncated: bool
) -> None:
    """Whether the shorter columns end early or all are cut at one row: the rows don't belong together."""
    with pytest.raises(InputError, match="signals have different clocks") as refused:
        imported(pairs(run, 2, truncated=truncated), "scope.txt", repair=repair, **SCOPE)
    remedy = "effort: {from: 3, unit: N, time: {from: 2, unit: ms}}"
    assert remedy in str(refused.value)


@pytest.mark.parametrize(("every", "late"), [(2, 0.0), (5, 0.0), (1, 0.0004), (10, 0.0003)])
def test_a_signal_with_a_clock_of_its_own(imported: Any, fitted: Any, run: Any, every: int, late: float) -> None:
    """Logged more seldom than the controller ran, or between the position's samples.

    A force that is held from ``late`` after the stamps is late itself: the position is moved with it.
    """
    moved = run._replace(q=np.interp(run.t - late, run.t, run.q))
    record = imported(pairs(moved, every, late), "scope.txt", **OWN)
    assert any("effort has" in note and "time of its own" in note for note in record.notes)
    fitted(record)


def test_a_clock_given_as_a_period_and_a_position_at_the_lower_rate(imported: Any, fitted: Any, run: Any) -> None:
    """The sibling: the force at the full rate, the position at every fifth sample, on the force's times."""
    empty = [f"{q:.7f}" for q in run.q[::5]] + [""] * (len(run.u) - len(run.q[::5]))
    content = "u,q\n" + "\n".join(f"{u:.4f},{q}" for u, q in zip(run.u, empty, strict=True))
    position = {"from": "q", "unit": "m", "time": {"period": 5, "unit": "ms"}}
    record = imported(content, time={"period": 1, "unit": "ms"}, position=position)
    assert record.sample_time == pytest.approx(1e-3)
    fitted(record)


def test_two_scopes_of_different_rates(imported: Any, fitted: Any, run: Any) -> None:
    """Simulink logs each scope at the rate of its block."""
    stream = io.BytesIO()
    scopes = [(run.t, run.q), (run.t[::4], run.u[::4])]
    savemat(stream, {f"S{k}": {"time": t, "signals": {"values": x[:, None]}} for k, (t, x) in enumerate(scopes, 1)})
    mapping: dict[str, Any] = {
        "time": {"from": "S1.time", "unit": "s"},
        "position": {"from": "S1.signals.values", "unit": "m"},
        "effort": {"from": "S2.signals.values", "unit": "N"},
    }
    with pytest.raises(InputError, match="signals have different clocks") as refused:
        imported(stream.getvalue(), "run.mat", **mapping)
    assert "effort: {from: S2.signals.values, unit: N, time: {from: S2.time, unit: s}}" in str(refused.value)
    mapping["effort"] = {**mapping["effort"], "time": {"from": "S2.time", "unit": "s"}}
    fitted(imported(stream.getvalue(), "run.mat", **mapping))


def test_times_beside_each_signal_that_agree_are_fine(imported: Any, run: Any) -> None:
    assert imported(pairs(run, 1), "scope.txt", **SCOPE).n_samples == len(run.t)


def seldom(run: Any, q_every: int, u_every: int, u_from: int = 0) -> str:
    lines = ["t,q,u"]
    for k, (t, q, u) in enumerate(zip(run.t, run.q, run.u, strict=True)):
        lines.append(f"{t:.3f},{f'{q:.7f}' if k % q_every == 0 else ''},{f'{u:.4f}' if k % u_every == u_from else ''}")
    return "\n".join(lines)


@pytest.mark.parametrize(("q_every", "u_every", "u_from"), [(1, 10, 0), (1, 4, 1), (10, 1, 0), (5, 1, 0), (2, 2, 1), (4, 2, 1)])
def test_values_in_some_rows_only_are_filled_not_dropped(
    imported: Any, fitted: Any, run: Any, q_every: int, u_every: int, u_from: int
) -> None:
    """The force logged more seldom than it acted, the position more seldom than the force, and rows of one or the other."""
    content = seldom(run, q_every, u_every, u_from)
    with pytest.raises(InputError, match="with --repair"):
        imported(content)
    record = imported(content, repair=True)
    assert record.sample_time == pytest.approx(1e-3)
    assert record.n_samples > 0.99 * len(run.t)
    assert any("a value every" in note for note in record.notes)
    fitted(record)


def test_a_force_that_was_held_between_its_samples_is_held(imported: Any, fitted: Any, simulate: Any) -> None:
    """The controller runs at 100 Hz and is logged when it does, the position at 1 kHz: the line would be five steps early."""
    run = simulate(rate=1000.0, loop=100.0)
    record = imported(seldom(run, 1, 10), repair=True)
    assert any("as held between its samples" in note for note in record.notes)
    np.testing.assert_allclose(record.effort, run.u[: record.n_samples], atol=1e-9)
    fitted(record)


def test_single_missing_values_are_filled_and_long_gaps_marked(imported: Any, fitted: Any, run: Any) -> None:
    random = np.random.default_rng(4)
    q, u = [f"{x:.7f}" for x in run.q], [f"{x:.4f}" for x in run.u]
    for k in random.choice(np.arange(10, len(q) - 10), 200, replace=False):
        (q if k % 2 else u)[k] = "nan"
    q[4000:4400] = ["NA"] * 400
    u[:30] = [""] * 30
    content = "t,q,u\n" + "\n".join(map(",".join, zip((f"{t:.3f}" for t in run.t), q, u, strict=True)))
    record = imported(content, repair=True)
    notes = " ".join(record.notes)
    assert record.n_samples == len(q) - 30
    assert record.valid is not None
    assert 400 <= np.count_nonzero(~record.valid) < 420
    assert "400 in longer gaps marked as not to be used" in notes
    assert "30 at the ends left out" in notes
    fitted(record)


def test_a_recording_of_which_most_is_lost_is_refused(imported: Any, run: Any) -> None:
    u = [f"{x:.4f}" if 3000 < k < 5000 else "nan" for k, x in enumerate(run.u)]
    content = "t,q,u\n" + "\n".join(f"{t:.3f},{q:.7f},{x}" for t, q, x in zip(run.t, run.q, u, strict=True))
    with pytest.raises(InputError, match=r"effort is not finite .* too many to repair"):
        imported(content, repair=True)
    # Repeated as it happens: evenly repeated ones are those of a clock with too few digits, which are even underneath.
    new = np.random.default_rng(1).random(run.t.shape[0]) < 0.1
    held = run.t[np.maximum.accumulate(np.where(new, np.arange(run.t.shape[0]), 0))]
    stamps = "t,q,u\n" + "\n".join(f"{t:.3f},{q:.7f},{x:.4f}" for t, q, x in zip(held, run.q, run.u, strict=True))
    with pytest.raises(InputError, match=r"(89|90|91) % of the stamps go back or repeat an earlier one: too many to drop"):
        imported(stamps, repair=True)


def test_a_hold_that_a_repair_breaks_is_withdrawn(imported: Any, run: Any) -> None:
    """With every fourth stamp twice, a quarter of the forces act over two steps once the others are dropped."""
    t = [run.t[k - (k % 4 == 3)] for k in range(len(run.t))]
    content = "t,q,u\n" + "\n".join(f"{a:.3f},{q:.7f},{u:.4f}" for a, q, u in zip(t, run.q, run.u, strict=True))
    record = imported(content, repair=True)
    assert record.effort_hold == "unknown"
    print(record.notes)
    assert any("no longer is" in note for note in record.notes)


def test_missing_stamps_between_even_ones_are_filled(imported: Any, run: Any) -> None:
    t = ["" if k in {50, 51, 700} else f"{a:.3f}" for k, a in enumerate(run.t)]
    content = "t,q,u\n" + "\n".join(f"{a},{q:.7f},{u:.4f}" for a, q, u in zip(t, run.q, run.u, strict=True))
    record = imported(content, repair=True)
    np.testing.assert_allclose(record.time, run.t, atol=1e-9)
    assert any("3 filled between even stamps" in note for note in record.notes)


def test_clocks_that_do_not_meet_are_refused(imported: Any, run: Any) -> None:
    wrong = {**OWN, "effort": {"from": 3, "unit": "N", "time": {"from": 2, "unit": "us"}}}
    with pytest.raises(InputError, match=r"cover only .* samples of the others; map times of one clock, in the right unit"):
        imported(pairs(run, 2), "scope.txt", **wrong)
