"""Twenty ways in which recordings break: cut off, overwritten, incomplete, or whole and of no use."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..bagio.read import read_record
from ..bagio.write import write_record
from ..record import Record

__all__ = ["BREAKS"]

Break = Callable[[Path, np.random.Generator], None]


def _storage(bag: Path) -> Path:
    return next(bag.glob("*.mcap"))


def _cut(share: float) -> Break:
    def cut(bag: Path, _: np.random.Generator) -> None:
        file = _storage(bag)
        with file.open("r+b") as stream:
            stream.truncate(int(share * file.stat().st_size))

    return cut


def _overwritten(at: float, share: float, zeros: bool = False) -> Break:
    def overwrite(bag: Path, generator: np.random.Generator) -> None:
        data = bytearray(_storage(bag).read_bytes())
        first, length = int(at * len(data)), max(int(share * len(data)), 16)
        length = min(length, len(data) - first)
        data[first : first + length] = bytes(length) if zeros else generator.bytes(length)
        _storage(bag).write_bytes(bytes(data))

    return overwrite


def _without_storage(bag: Path, _: np.random.Generator) -> None:
    _storage(bag).unlink()


def _metadata(text: str | None) -> Break:
    def change(bag: Path, _: np.random.Generator) -> None:
        (bag / "metadata.yaml").write_text(text or "", encoding="utf-8")

    return change


def _text(bag: Path, _: np.random.Generator) -> None:
    _storage(bag).write_text("time,position\n0.0,1.0\n", encoding="utf-8")


def _of_no_use(change: Callable[[Record], Record]) -> Break:
    def write(bag: Path, _: np.random.Generator) -> None:
        record = read_record(bag)
        shutil.rmtree(bag)
        write_record(change(record), bag, compression="zstd")

    return write


BREAKS: Sequence[tuple[str, Break]] = (
    ("empty file", _cut(0.0)),
    ("cut off in its first bytes", _cut(1e-5)),
    ("cut off at 1 %", _cut(0.01)),
    ("cut off at 10 %", _cut(0.1)),
    ("cut off in the middle", _cut(0.5)),
    ("cut off before its end", _cut(0.99)),
    ("head overwritten", _overwritten(0.0, 0.01)),
    ("middle overwritten", _overwritten(0.5, 0.01)),
    ("end overwritten", _overwritten(0.98, 0.02)),
    ("all overwritten", _overwritten(0.0, 1.0)),
    ("all zeros", _overwritten(0.0, 1.0, zeros=True)),
    ("half zeros", _overwritten(0.4, 0.6, zeros=True)),
    ("no storage file", _without_storage),
    ("text in place of storage", _text),
    ("empty metadata", _metadata(None)),
    ("metadata of nothing", _metadata("rosbag2_bagfile_information: {}\n")),
    ("metadata that is no YAML", _metadata("{[")),
    ("too short", _of_no_use(lambda record: record.between(0.0, 0.05))),
    ("at rest", _of_no_use(lambda record: replace(record, position=np.zeros(record.n_samples), velocity=None))),
    ("no force", _of_no_use(lambda record: replace(record, effort=np.zeros(record.n_samples)))),
)
"""Name and function of each; some leave enough to be read."""
