"""Damaged files: one line and no more, or a record of what is still there, with a word on what is not.

Ten thousand in every run; ``--long`` tries a hundred times as many.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fric.bagio import import_recording, load_mapping
from fric.errors import InputError
from fric.importers import text
from fric.record import Record

_SPEC = importlib.util.spec_from_file_location("mutations", Path(__file__).with_name("mutations.py"))
assert _SPEC is not None
assert _SPEC.loader is not None
made = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(made)

CONTENT = {name: build() for name, (_, build, _) in made.FILES.items()}
MAPS = {name: load_mapping(mapping) for name, (_, _, mapping) in made.FILES.items()}


def _lines(content: bytes) -> list[list[float]]:
    """The lines of three numbers of a text with commas and points, found without the product's code."""
    rows = []
    for line in content.decode("latin-1").replace("\r\n", "\n").replace("\r", "\n").split("\n"):
        cells = line.split(",")
        if len(cells) == 3 and all(cell and set(cell) <= set("0123456789.+-") for cell in cells):
            try:
                rows.append([float(cell) for cell in cells])
            except ValueError:
                continue
    return rows


def _true(record: Record, content: bytes) -> None:
    """A record without notes holds every line of plain numbers as it is; cells spelt otherwise may make further samples."""
    rows = np.array(_lines(content))
    if not record.notes:
        own = np.stack([record.time, record.position, record.effort], axis=1)
        rows[:, 0] -= rows[0, 0] - own[_first(own, rows[0]), 0]
        kept = [np.any(np.all(np.abs(own - row) < 1e-9 * (1.0 + np.abs(row)), axis=1)) for row in rows]
        assert all(kept)
        assert record.n_samples <= len([line for line in content.splitlines() if line.strip()])


def _first(own: Any, row: Any) -> int:
    """Which sample is the first line of plain numbers; times count from the first sample."""
    return int(np.argmin(np.abs(own[:, 1:] - row[1:]).sum(axis=1)))


def _try(folder: Path, count: int, seed: int) -> dict[str, int]:
    names = list(made.FILES)
    done = {"read": 0, "refused": 0}
    refusals: list[str] = []
    for k in range(count):
        name = names[k % len(names)]
        random = np.random.default_rng([seed, k])
        content = made.damaged(CONTENT[name], name in made.TEXTS, random)
        file = folder / made.FILES[name][0]
        file.write_bytes(content)
        try:
            record = import_recording(file, MAPS[name], repair=bool(k // len(names) % 2))
        except InputError as error:
            done["refused"] += 1
            refusals.append(str(error))
            continue
        except Exception as error:
            raise AssertionError(f"{name}, seed {seed}, mutation {k}: {error!r}") from error
        done["read"] += 1
        if name == "csv":
            _true(record, content)
    assert all(message.isprintable() for message in refusals)  # one line, that is
    return done


@pytest.mark.timeout(600)
def test_damage_is_refused_in_one_line_or_said(tmp_path: Path) -> None:
    done = _try(tmp_path, 10_000, 1)
    assert min(done.values()) > 2000


def test_the_quick_reader_gives_what_the_careful_one_does(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for k in range(300):
        name = ("csv", "semicolons", "quoted", "blanks")[k % 4]
        file = tmp_path / made.FILES[name][0]
        file.write_bytes(made.damaged(CONTENT[name], True, np.random.default_rng([2, k])))
        found: list[Any] = []
        for small in (0, 1 << 30):
            monkeypatch.setattr(text, "_SMALL", small)
            try:
                record = import_recording(file, MAPS[name], repair=bool(k // 4 % 2))
                found.append((record.time.tolist(), record.position.tolist(), record.effort.tolist(), record.notes))
            except InputError as error:
                found.append(str(error))
        assert found[0] == found[1], (name, k)


@pytest.mark.long
@pytest.mark.timeout(36_000)
def test_a_million_damaged_files(tmp_path: Path) -> None:
    done = _try(tmp_path, 1_000_000, 3)
    assert min(done.values()) > 200_000
