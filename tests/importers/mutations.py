"""Small files of every format, and drawn damage to them: of bytes, of cells and of lines."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.io import savemat

N = 40
TIME = np.arange(N) * 0.01
POSITION = np.round(0.1 * np.sin(3.0 * TIME), 6)
EFFORT = np.round(5.0 * np.cos(3.0 * TIME), 4)
MAP: dict[str, Any] = {
    "time": {"from": "t", "unit": "s"},
    "position": {"from": "q", "unit": "m"},
    "effort": {"from": "u", "unit": "N"},
}
STRUCT_MAP: dict[str, Any] = {
    "time": {"from": "S.time", "unit": "s"},
    "position": {"from": "S.signals[0].values", "unit": "m"},
    "effort": {"from": "S.signals[1].values", "unit": "N"},
}
# What stands in cells and lines of real files.
CELLS = (
    "",
    "nan",
    "NaN",
    "inf",
    "-inf",
    "1e400",
    "-1e400",
    "1e-400",
    "NA",
    "null",
    "-",
    "abc",
    "True",
    "0x1F",
    "1,234",
    "1.234.567",
    "1'234.5",
    "1D3",
    "12:30:01.5",
    "2024-05-01T12:00:00Z",
    '"',
    '""',
    "1_000",
    "\u0661",
    "\u2212" + "1",
    "9" * 400,
    " ",
    "\0",
    "#",
    "1e",
    "--5",
)
LINES = (
    "",
    "# a comment",
    "MOT: Warn: current limit",
    "t,q,u",
    "s,m,N",
    ",,",
    "EOF",
    '"open',
    "1,2",
    "1,2,3,4",
    "0.1,0.2,0.3,",
    "\0\0\0\0",
    "%",
    ";",
    "Warn: 12, 13, x",
    "\ufeff",
)


def table(separator: str = ",", decimal: str = ".", head: str = "t,q,u", quoted: bool = False) -> bytes:
    """A text table."""
    lines = [head.replace(",", separator)]
    for row in zip(TIME, POSITION, EFFORT, strict=True):
        cells = [f"{value:.{digits}f}".replace(".", decimal) for value, digits in zip(row, (3, 6, 4), strict=True)]
        lines.append(separator.join(f'"{cell}"' if quoted else cell for cell in cells))
    return ("\n".join(lines) + "\n").encode()


def mat(compressed: bool, scope: bool) -> bytes:
    """A MATLAB file, plain or as Simulink's Structure With Time."""
    signals = np.empty(2, dtype=[("values", object), ("label", object)])
    signals[0], signals[1] = (POSITION[:, None], "q"), (EFFORT[:, None], "u")
    content = {"S": {"time": TIME, "signals": signals}} if scope else {"t": TIME, "q": POSITION, "u": EFFORT, "name": "rig"}
    stream = io.BytesIO()
    savemat(stream, content, do_compression=compressed)
    return stream.getvalue()


def npz() -> bytes:
    """Arrays of numpy."""
    stream = io.BytesIO()
    np.savez(stream, t=TIME, q=POSITION, u=EFFORT)
    return stream.getvalue()


def parquet() -> bytes:
    """Columns of Arrow."""
    stream = io.BytesIO()
    pq.write_table(pa.table({"t": TIME, "q": POSITION, "u": EFFORT}), stream)
    return stream.getvalue()


def _rows() -> list[dict[str, float]]:
    return [{"t": float(t), "q": float(q), "u": float(u)} for t, q, u in zip(TIME, POSITION, EFFORT, strict=True)]


# Name of the file, its content, its mapping; texts first.
FILES: dict[str, tuple[str, Callable[[], bytes], dict[str, Any]]] = {
    "csv": ("a.csv", table, MAP),
    "semicolons": ("a.csv", lambda: table(";", ","), MAP),
    "quoted": ("a.csv", lambda: table(",", ",", quoted=True), MAP),
    "blanks": ("a.txt", lambda: table(" "), MAP),
    "json": ("a.json", lambda: json.dumps({"t": TIME.tolist(), "q": POSITION.tolist(), "u": EFFORT.tolist()}).encode(), MAP),
    "records": ("a.json", lambda: json.dumps(_rows(), indent=0).encode(), MAP),
    "jsonl": ("a.jsonl", lambda: "\n".join(map(json.dumps, _rows())).encode(), MAP),
    "mat": ("a.mat", lambda: mat(False, False), MAP),
    "mat packed": ("a.mat", lambda: mat(True, False), MAP),
    "scope": ("a.mat", lambda: mat(False, True), STRUCT_MAP),
    "npz": ("a.npz", npz, MAP),
    "parquet": ("a.parquet", parquet, MAP),
}
TEXTS = ("csv", "semicolons", "quoted", "blanks", "json", "records", "jsonl")


def damaged(content: bytes, text: bool, random: np.random.Generator) -> bytes:
    """One to three drawn changes; of cells and lines only where it is a text."""
    for _ in range(int(random.integers(1, 4))):
        kind = int(random.integers(0, 9 if text else 5))
        content = _of_bytes(content, kind, random) if kind < 5 else _of_lines(content, kind, random)
    return content


def _of_bytes(content: bytes, kind: int, random: np.random.Generator) -> bytes:
    at = int(random.integers(0, len(content) + 1))
    size = int(random.integers(1, 9)) if random.random() < 0.7 else int(random.integers(1, max(len(content) // 2, 2)))
    if kind == 0:
        return content[:at] + bytes([int(random.integers(0, 256))]) + content[at + 1 :]
    if kind == 1:
        return content[:at] + content[at + size :]
    if kind == 2:
        return content[:at] + random.bytes(min(size, 16)) + content[at:]
    if kind == 3:
        return content[:at] + content[at : at + size] + content[at:]
    return content[:at] if random.random() < 0.3 else content[:at] + bytes(min(size, 64)) + content[at + min(size, 64) :]


def _of_lines(content: bytes, kind: int, random: np.random.Generator) -> bytes:
    lines = content.split(b"\n")
    at = int(random.integers(0, len(lines)))
    if kind == 5:
        lines.insert(at, LINES[int(random.integers(0, len(LINES)))].encode())
    elif kind == 6:
        other = int(random.integers(0, len(lines)))
        lines[at], lines[other] = lines[other], lines[at]
    elif kind == 7:
        lines[at:at] = lines[max(at - 3, 0) : at]
    else:
        for separator in (b";", b'","', b",", b" "):
            if separator in lines[at]:
                cells = lines[at].split(separator)
                cells[int(random.integers(0, len(cells)))] = CELLS[int(random.integers(0, len(CELLS)))].encode()
                lines[at] = separator.join(cells)
                break
    return b"\n".join(lines)
