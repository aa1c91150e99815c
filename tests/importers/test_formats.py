"""MATLAB's structs, cells and objects, Simulink's scopes, JSON and JSON lines: every signal has a name that can be mapped."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fric.errors import InputError
from fric.importers import TextOptions, importers, load_table
from fric.importers.mat_format import values_of
from scipy.io import savemat

N = 50
T = np.arange(N) * 0.01
Q = np.sin(T)
U = np.cos(T)


def packed(content: dict[str, Any], **options: Any) -> bytes:
    stream = io.BytesIO()
    savemat(stream, content, **options)
    return stream.getvalue()


def scope(*values: Any) -> Any:
    signals = np.empty(len(values), dtype=[("values", object), ("dimensions", object), ("label", object)])
    for k, value in enumerate(values):
        signals[k] = (value, 1, f"signal {k}")
    return {"time": T[:, None], "signals": signals, "blockName": "model/Scope"}


def by(time: str, position: str, effort: str) -> dict[str, Any]:
    names = {"time": (time, "s"), "position": (position, "m"), "effort": (effort, "N")}
    return {key: {"from": name, "unit": unit} for key, (name, unit) in names.items()}


def cells(*values: Any) -> Any:
    found = np.empty(len(values), dtype=object)
    for k, value in enumerate(values):
        found[k] = value
    return found


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize(
    ("content", "mapping"),
    [
        ({"S": scope(Q[:, None], U[:, None])}, by("S.time", "S.signals[0].values", "S.signals[1].values")),
        ({"S": scope(np.stack([Q, U], axis=1))}, by("S.time", "S.signals.values[0]", "S.signals[0].values[1]")),
        ({"c": cells(T, Q, cells(U, 1.0))}, by("c[0]", "c[1]", "c[2][0]")),
        ({"r": {"a": {"t": T}, "m": np.stack([Q, U])}}, by("r.a.t", "r.m[0]", "r.m[1]")),
        (
            {"t": (T * 1e4).astype(np.int16), "q": Q.astype(np.float32), "u": U},
            {**by("t", "q", "u"), "time": {"from": "t", "unit": "s", "scale": 1e-4}},
        ),
    ],
)
def test_matlab(imported: Any, content: Any, mapping: dict[str, Any], compressed: bool) -> None:
    record = imported(packed(content, do_compression=compressed), "run.mat", **mapping)
    np.testing.assert_allclose(record.time, T, atol=1e-9)
    np.testing.assert_allclose(record.position, Q, atol=1e-7)
    np.testing.assert_array_equal(record.effort, U)


def test_matlab_version_4(imported: Any) -> None:
    record = imported(packed({"t": T, "q": Q, "u": U}, format="4"), "run.mat")
    np.testing.assert_array_equal(record.position, Q)


def test_an_object_of_matlab_is_named_with_what_to_do(imported: Any) -> None:
    """A timetable: an array whose class is opaque. Written by hand after the format's own description."""
    name, system, kind = b"T", b"MCOS", b"timetable"

    def element(code: int, data: bytes) -> bytes:
        return np.array([code, len(data)], "<u4").tobytes() + data + b"\0" * (-len(data) % 8)

    flags = element(6, np.array([17, 0], "<u4").tobytes())
    opaque = element(14, flags + element(1, name) + element(1, system) + element(1, kind))
    content = packed({"u": U}) + opaque
    assert [found for found, _ in values_of(content)] == ["u", "T"]
    with pytest.raises(InputError, match=r"'T' is a MATLAB object of the class timetable.*store its columns in a struct first"):
        imported(content, "run.mat", **by("T.Time", "T.q", "u"))


def test_every_name_is_announced(imported: Any) -> None:
    content = packed({"S": scope(Q, U), "note": "words"})
    with pytest.raises(InputError, match=r"columns there: S.time, S.signals\[0\].values, S.signals\[1\].values"):
        imported(content, "run.mat", **by("S.time", "S.q", "S.u"))
    with pytest.raises(InputError, match="column 'note', holds text"):
        imported(content, "run.mat", **by("S.time", "note", "S.u"))


OBJECTS = [
    {"at": {"t": float(t)}, "axis": {"q": float(q)}, "u": [float(u), 0], "on": True} for t, q, u in zip(T, Q, U, strict=True)
]


@pytest.mark.parametrize(
    ("name", "content", "mapping"),
    [
        (
            "a.json",
            json.dumps({"log": {"t": T.tolist(), "q": Q.tolist()}, "u": U.tolist(), "rig": "x"}),
            by("log.t", "log.q", "u"),
        ),
        ("a.json", json.dumps(OBJECTS), by("at.t", "axis.q", "u[0]")),
        ("a.json", json.dumps({"rows": OBJECTS}), by("rows.at.t", "rows.axis.q", "rows.u[0]")),
        ("a.json", json.dumps({"m": np.stack([T, Q, U], axis=1).tolist()}), by("m[0]", "m[1]", "m[2]")),
        (
            "a.json",
            json.dumps({key: {str(k): v for k, v in enumerate(x.tolist())} for key, x in (("t", T), ("q", Q), ("u", U))}),
            by("t", "q", "u"),
        ),
        ("a.jsonl", "\n".join(map(json.dumps, OBJECTS)), by("at.t", "axis.q", "u[0]")),
        ("a.json", "\n".join(map(json.dumps, OBJECTS)), by("at.t", "axis.q", "u[0]")),
        (
            "a.ndjson",
            "\n\n".join(
                json.dumps({"t": f"2024-05-01T12:00:{t:06.3f}Z", "q": str(q), "u": u}) for t, q, u in zip(T, Q, U, strict=True)
            ),
            by("t", "q", "u"),
        ),
    ],
)
def test_json(imported: Any, name: str, content: str, mapping: dict[str, Any]) -> None:
    record = imported(content, name, **mapping)
    np.testing.assert_allclose(record.time, T, atol=1e-6)
    np.testing.assert_array_equal(record.position, Q)
    np.testing.assert_array_equal(record.effort, U)


def test_json_that_is_damaged(imported: Any) -> None:
    lines = [json.dumps({"t": float(t), "q": float(q), "u": float(u)}) for t, q, u in zip(T, Q, U, strict=True)]
    lines[20] = lines[20][:-5]
    with pytest.raises(InputError, match=r"line 21 is no JSON object.*\(1 line\(s\) in all\); drop such lines with --repair"):
        imported("\n".join(lines), "a.jsonl")
    assert any("dropped" in note for note in imported("\n".join(lines), "a.jsonl", repair=True).notes)
    with pytest.raises(InputError, match="line 1, column 7: not JSON"):
        imported('{"t": }', "a.json")
    with pytest.raises(InputError, match="column 'q', element 1: 'x' is not a number"):
        imported(json.dumps({"t": [1, 2], "q": [1, "x"], "u": [1, 2]}), "a.json")


def test_importers_are_found_by_being_there(tmp_path: Path) -> None:
    assert {".csv", ".txt", ".mat", ".npz", ".parquet", ".json", ".jsonl"} <= set(importers())
    (tmp_path / "a.csv").write_text("a,b\n1,x\n2,y\n3,z\n")
    table = load_table(tmp_path / "a.csv", TextOptions(), ())
    assert list(table.columns["a"]) == [1.0, 2.0, 3.0]
