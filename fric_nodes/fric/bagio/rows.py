"""Many messages in one array of bytes: a sequence of messages that need not be objects of their own."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import accumulate
from typing import overload

import numpy as np
from numpy.typing import NDArray

__all__ = ["Rows"]

Bytes = NDArray[np.uint8]
Index = NDArray[np.intp]


class Rows(Sequence[bytes]):
    """Messages, one behind the other.

    Args:
        content: the bytes of all, shape ``(n_bytes,)``.
        starts: where each begins, shape ``(n,)``.
        lengths: of each [byte], shape ``(n,)``.
    """

    def __init__(self, content: Bytes, starts: Index, lengths: Index) -> None:
        self._content = content
        self._starts = starts
        self.lengths = lengths

    @classmethod
    def of(cls, messages: Sequence[bytes]) -> Rows:
        """``messages`` in one array."""
        if isinstance(messages, Rows):
            return messages
        lengths = np.fromiter(map(len, messages), dtype=np.intp, count=len(messages))
        return cls(np.frombuffer(b"".join(messages), dtype=np.uint8), _begin(lengths), lengths)

    @classmethod
    def joined(cls, parts: Iterable[Rows]) -> Rows:
        """The messages of all ``parts``, in their order."""
        held = [part for part in parts if len(part)]
        if not held:
            return cls.of([])
        shifts = accumulate((part._content.shape[0] for part in held[:-1]), initial=0)
        starts = [part._starts + shift for part, shift in zip(held, shifts, strict=True)]
        content = np.concatenate([part._content for part in held])
        return cls(content, np.concatenate(starts), np.concatenate([part.lengths for part in held]))

    def table(self, rows: Index) -> Bytes:
        """The messages ``rows``, all of one length, shape ``(n_rows, length)``."""
        length, starts = int(self.lengths[rows[0]]), self._starts[rows]
        if length and np.all(np.diff(starts) == length):
            return self._content[starts[0] : starts[-1] + length].reshape(rows.size, length)
        return np.asarray(self._content[starts[:, None] + np.arange(length)])

    def taken(self, order: Index) -> Rows:
        """The messages with these numbers, in this order."""
        return Rows(self._content, self._starts[order], self.lengths[order])

    def __len__(self) -> int:
        return int(self._starts.shape[0])

    @overload
    def __getitem__(self, at: int) -> bytes: ...
    @overload
    def __getitem__(self, at: slice) -> Rows: ...
    def __getitem__(self, at: int | slice) -> bytes | Rows:
        if isinstance(at, slice):
            return Rows(self._content, self._starts[at], self.lengths[at])
        start = self._starts[at]
        return self._content[start : start + self.lengths[at]].tobytes()

    def __iter__(self) -> Iterator[bytes]:
        for start, length in zip(self._starts.tolist(), self.lengths.tolist(), strict=True):
            yield self._content[start : start + length].tobytes()


def _begin(lengths: Index) -> Index:
    """Where each of messages of these ``lengths`` begins, one behind the other."""
    return np.concatenate([[0], np.cumsum(lengths)[:-1]]).astype(np.intp) if lengths.size else np.zeros(0, dtype=np.intp)
