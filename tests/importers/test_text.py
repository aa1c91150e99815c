"""Text tables as drives, scopes, PLCs, serial loggers and spreadsheets write them: the same numbers come back."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from fric.errors import InputError
from fric.record import Record

N = 60
T = np.arange(N) * 0.001
Q = np.round(1.5 + 0.1 * np.sin(40.0 * T), 6)
U = np.round(1500.0 * np.cos(40.0 * T), 3)
BY_NUMBER = {
    "time": {"from": 0, "unit": "s"},
    "position": {"from": 1, "unit": "m"},
    "effort": {"from": 2, "unit": "N"},
}


def same(record: Record, samples: int = N) -> None:
    np.testing.assert_allclose(record.time, T[:samples], atol=1e-9)
    np.testing.assert_allclose(record.position, Q[:samples], atol=1e-9)
    np.testing.assert_allclose(record.effort, U[:samples], atol=1e-6)


def rows(write: Callable[[float, float, float, int], str], head: str = "t,q,u\n", end: str = "\n") -> str:
    return head + end.join(write(t, q, u, k) for k, (t, q, u) in enumerate(zip(T, Q, U, strict=True))) + end


def plain(t: float, q: float, u: float, k: int = 0) -> str:
    return f"{t:.3f},{q:.6f},{u:.3f}"


def comma(text: str) -> str:
    return text.replace(".", ",")


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(rows(lambda t, q, u, k: f"{t:.3f},run {k % 3},{q:.6f},{u:.3f}", "t,state,q,u\n"), id="words"),
        pytest.param(rows(lambda t, q, u, k: f"{t:.3f},{k % 2 == 0},{q:.6f},{u:.3f}", "t,on,q,u\n"), id="booleans"),
        pytest.param(rows(lambda t, q, u, k: f'{t:.3f},{q:.6f},"a, b ""c""",{u:.3f}', "t,q,say,u\n"), id="quoted words"),
        pytest.param(rows(lambda t, q, u, k: f'{t:.3f},{q:.6f},"two\nlines",{u:.3f}', "t,q,say,u\n"), id="quoted lines"),
        pytest.param(rows(lambda t, q, u, k: f"0x{k:04X},12:00:{t:06.3f},{t:.3f},{q:.6f},{u:.3f}", "w,c,t,q,u\n"), id="hex"),
        pytest.param(rows(lambda t, q, u, k: f"{t:.3f},{q:.6f},{u:.3f},", "t,q,u,\n"), id="trailing"),
        pytest.param(rows(lambda t, q, u, k: f"{t:.3f},{q:.6f},{u:.3f},"), id="trailing in data only"),
        pytest.param(rows(lambda t, q, u, k: f'"{t:.3f}","{q:.6f}","{u:.3f}"', '"t","q","u"\n'), id="quoted"),
        pytest.param(comma(rows(lambda t, q, u, k: f"{t:.3f};{q:.6f};{u:.3f}", "t;q;u\n")), id="decimal comma"),
        pytest.param(comma(rows(lambda t, q, u, k: f'"{t:.3f}"|"{q:.6f}"|"{u:.3f}"', "t|q|u\n")).replace("|", ","), id="both"),
        pytest.param(rows(lambda t, q, u, k: f'{t:.3f},{q:.6f},"{u:,.3f}"'), id="thousands"),
        pytest.param(rows(lambda t, q, u, k: f"{t:.3f};{q:.6f};{u:,.3f}".translate({44: 46, 46: 44}), "t;q;u\n"), id="points"),
        pytest.param(rows(lambda t, q, u, k: f"{t:.3f};{q:.6f};{u:,.3f}".replace(",", "'"), "t;q;u\n"), id="Swiss"),
        pytest.param(rows(plain, "# made by x\n# 2024\nt,q,u\n").replace("\n0.01", "\n% a word\n0.01"), id="comments"),
        pytest.param(rows(lambda t, q, u, k: f"  {t:8.3f}   {q:.6f}\t {u:12.3f}  ", "# t  q  u\n"), id="columns in blanks"),
        pytest.param(rows(plain, "Axis,,\nt,q,u\ns,m,N\n"), id="three header lines"),
        pytest.param(rows(plain, "t [s],q [m],u [N]\n"), id="units in names"),
        pytest.param(rows(plain, "Name,rig\nDate,2024-05-01\n\nt,q,u\n[s],[m],[N]\n\n"), id="preamble"),
        pytest.param(rows(plain, end="\r\n\r\n"), id="blank lines"),
        pytest.param(rows(plain, end="\r"), id="old Macintosh"),
        pytest.param("\ufeff" + rows(plain), id="mark"),
        pytest.param(rows(plain).encode("utf-16"), id="utf-16"),
        pytest.param(rows(plain).encode("utf-16-le"), id="utf-16 without mark"),
        pytest.param(rows(lambda t, q, u, k: f"{t:.3f},{q:.6f},{u:.3f},°", "t,q,u,µ\n").encode("cp1252"), id="cp1252"),
        pytest.param(rows(lambda t, q, u, k: f"{t:.3f},{q:.6E},{u:.6E}".replace("E", "D")), id="Fortran"),
        pytest.param(rows(lambda t, q, u, k: f"{t:.3f},{q:.6f},{u:.3f}".replace("-", "\u2212")), id="minus"),
        pytest.param(rows(lambda t, q, u, k: f"12:30:{10 + t:06.3f},{q:.6f},{u:.3f}"), id="clock"),
        pytest.param(rows(lambda t, q, u, k: f"2024-05-01T23:59:{59 + t:06.3f}Z,{q:.6f},{u:.3f}"), id="ISO 8601"),
        pytest.param(
            rows(lambda t, q, u, k: f"01.05.2024 12:30:{10 + t:06.3f}".replace(".0", ",0", 0) + f";{q:.6f};{u:.3f}", "t;q;u\n"),
            id="date",
        ),
        pytest.param(
            rows(lambda t, q, u, k: f"{'23:59:59' if k < 30 else '00:00:00'}.{(970 + k) % 1000:03d},{q:.6f},{u:.3f}"),
            id="midnight",
        ),
    ],
)
def test_the_same_numbers_however_they_are_written(imported: Any, content: str | bytes) -> None:
    same(imported(content))


@pytest.mark.parametrize(
    ("write", "head", "effort"),
    [
        (lambda t, q, u, k: f"{t:.3f},{q:.6f},{k},{u:.3f}", "t,q,count,u\n", "u"),
        (lambda t, q, u, k: f"{t:.3f},{q:.6f},{u:.3f},{'overrun' if k == 50 else ''}", "t,q,u,message\n", "u"),
        (lambda t, q, u, k: f"{t:.3f},{q:.6f},{u:.3f},0,0", "Time,Axis1,,Axis2,\nt,q,u,q,u\n", "Axis1.u"),
    ],
)
def test_what_stands_beside_the_signals(imported: Any, write: Any, head: str, effort: str) -> None:
    """A counter that isn't a clock, words in a few rows only, titles over several columns."""
    by_group = {"position": {"from": "Axis1.q", "unit": "m"}} if "." in effort else {}
    same(imported(rows(write, head), effort={"from": effort, "unit": "N"}, **by_group))


def test_names_that_do_not_fit_the_columns_are_said(imported: Any) -> None:
    with pytest.raises(InputError, match=r"'t', which is not there \(the line above the data has 3 names for 4 columns\)"):
        imported(rows(lambda t, q, u, k: f"{k},{t:.3f},{q:.6f},{u:.3f}"))


def test_a_large_file_is_read_as_a_small_one(imported: Any) -> None:
    lines = [f"{k * 1e-3:.3f},{'on' if k % 2 else 'off'},{np.sin(k * 1e-3):.6f},{k % 7}.5" for k in range(50_000)]
    record = imported("t,state,q,u\n" + "\n".join(lines))
    assert record.n_samples == 50_000
    np.testing.assert_allclose(record.position, np.sin(record.time), atol=1e-6)
    lines.insert(40_000, "Warn: current limit")
    with pytest.raises(
        InputError, match="line 40002 is a message between the data: 'Warn: current limit'; drop such lines with --repair"
    ):
        imported("t,state,q,u\n" + "\n".join(lines))
    repaired = imported("t,state,q,u\n" + "\n".join(lines), repair=True)
    np.testing.assert_array_equal(repaired.effort, record.effort)
    assert any("line 40002" in note and "dropped" in note for note in repaired.notes)


def test_messages_of_a_serial_log(imported: Any, run: Any, fitted: Any) -> None:
    """No header, blanks or tabs, messages before, between (with numbers in them, too) and after: none is a sample."""
    lines = [f"{q:.7f}\t{u:.4f}" for q, u in zip(run.q, run.u, strict=True)]
    for at, text in ((9000, "MOT: 3 faults, 12 A"), (5000, "MOT: Warn: current limit"), (5000, "#"), (2500, "heap 20480")):
        lines.insert(at, text)
    content = "\n".join(["boot v1.2", "MOT: Ready.", *lines, "EOF"])
    by_period = {"time": {"period": 1, "unit": "ms"}, "position": {"from": 0, "unit": "m"}, "effort": {"from": 1, "unit": "N"}}
    with pytest.raises(InputError, match=r"line 2503 is a message between the data: 'heap 20480' .3 in all."):
        imported(content, "log.txt", **by_period)
    record = imported(content, "log.txt", repair=True, **by_period)
    np.testing.assert_array_equal(record.position, run.q)
    assert any("3 in all" in note for note in record.notes)
    fitted(record)


def test_a_damaged_sample_keeps_its_place(imported: Any) -> None:
    """Cells that are no number, or missing: with a period for time the others must not move up."""
    lines = [f"{q:.6f};{u:.3f}" for q, u in zip(Q, U, strict=True)]
    lines[20], lines[33] = "1.5x;12", lines[33][:4]
    by_period = {"time": {"period": 1, "unit": "ms"}, "position": {"from": 0, "unit": "m"}, "effort": {"from": 1, "unit": "N"}}
    with pytest.raises(
        InputError, match=r"column '0', line 21: '1.5x' is not a number; take such values as missing with --repair"
    ):
        imported("\n".join(lines), **by_period)
    record = imported("\n".join(lines), repair=True, **by_period)
    assert record.n_samples == N
    np.testing.assert_allclose(record.position, Q, atol=2e-5)
    assert sum("taken as missing" in note for note in record.notes) == 2


def test_a_file_that_was_cut_within_a_number(imported: Any) -> None:
    record = imported(rows(plain).rstrip("\n")[:-2])
    same(record, N - 1)
    assert any("ends within a number" in note for note in record.notes)


@pytest.mark.parametrize(
    ("content", "changed", "message"),
    [
        (
            rows(lambda t, q, u, k: f"{t:.3f},{q:.6f},off"),
            {},
            r"column 'u'.*no column of numbers: 60 of 60 cells, such as 'off'",
        ),
        (
            rows(lambda t, q, u, k: f"{t:.3f},{q:.6f},{u:.3f}" if k != 30 else f"{t:.3f},{q:.6f},n.a.5"),
            {},
            r"column 'u', line 32: 'n\.a\.5' is not a number",
        ),
        (
            rows(lambda t, q, u, k: f"{k + 1},000;{k + 1},{k:03d};{k + 1},5{k:02d}", "t;q;u\n"),
            {},
            "comma in '1,000' may be a decimal sign or stand between thousands; say which in the mapping: decimal",
        ),
        (comma(rows(plain, "t q u\n")), {}, "'time' is to come from 't', which is not there"),
        (
            rows(lambda t, q, u, k: f"12:30:{t:06.3f},12:30:00.5,{u:.3f}"),
            {},
            "'position' is to come from 'q', which holds clock times",
        ),
        ("t,q,u\n" + "1e400,1,1\n" * 40, {}, "time is not finite .* at any sample"),
    ],
)
def test_what_cannot_be_read_is_named(imported: Any, content: str, changed: dict[str, Any], message: str) -> None:
    for repair in (False, True) if "n.a.5" not in content else (False,):
        with pytest.raises(InputError, match=message) as refused:
            imported(content, repair=repair, **changed)
        assert "\n" not in str(refused.value)


def test_numbers_beyond_all_numbers_are_said(imported: Any) -> None:
    content = rows(lambda t, q, u, k: f"{t:.3f},{q:.6f},{'1e400' if k == 30 else u}")
    with pytest.raises(InputError, match=r"effort is not finite \(NaN or inf\) at 1 of 60 samples, first at 0\.030 s"):
        imported(content)
    assert imported(content, repair=True).n_samples == N


def test_a_line_of_numbers_apart_from_the_data_is_said(imported: Any) -> None:
    lines = rows(plain).splitlines()
    record = imported("\n".join([lines[0], lines[1], "Warn: 12, 13, x", *lines[2:]]))
    assert record.n_samples == N - 1
    assert any("line 2 above the data" in note for note in record.notes)
