"""The index of a long recording: whole in the file, and not in memory while it is being recorded."""

from __future__ import annotations

import tracemalloc
from io import BytesIO
from pathlib import Path

from fric.bagio.chunk_index import ChunkIndex
from fric.bagio.source import Source
from fric.bagio.types import FLOAT64
from fric.bagio.write import BagWriter


def entry(content: bytes) -> BytesIO:
    made = BytesIO()
    made.write(content)
    return made


def test_entries_come_back_in_order_as_they_were_left(tmp_path: Path) -> None:
    index = ChunkIndex(tmp_path)
    assert not index
    contents = [bytes([k]) * (17 * k) for k in range(50)]
    for content in contents[:30]:
        index.append(entry(content))
    assert [each.getvalue() for each in index] == contents[:30]
    for content in contents[30:]:
        index.append(entry(content))
    assert len(index) == 50
    found = list(index)
    assert [each.getvalue() for each in found] == contents
    assert [each.tell() for each in found] == [len(content) for content in contents]  # as the library takes their length
    assert list(tmp_path.iterdir()) == []


def test_hours_of_chunks_take_no_memory_and_are_all_in_the_index(tmp_path: Path) -> None:
    n = 3000
    with BagWriter(tmp_path / "bag", flush_period=None) as writer:
        writer.topic("/force_command", FLOAT64)
        held = []
        for k in range(n):
            writer.write("/force_command", k, b"\x00\x01\x00\x00" + bytes(8))
            writer.flush()
            if k == 500:
                tracemalloc.start()
            if k in (1000, n - 1):
                held.append(tracemalloc.get_traced_memory()[0])
        tracemalloc.stop()
    assert held[1] - held[0] < 50 * (n - 1001)  # the library's entries take some hundred bytes each
    with Source(tmp_path / "bag") as source:
        # By the index, not record by record.
        assert not source.recovered
        assert [each.n_messages for each in source.topics] == [n]
        source.window = (2000, 2010)
        assert [each.log_time_ns for each in source.messages()] == list(range(2000, 2010))
