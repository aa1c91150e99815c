"""One pass over a file without an index for windows that move forward, as pieces of a recording do.

What was written after the end of a window is kept for the next one, which begins a little before that end. A recorder writes
in the order of reception but for what its threads and caches mix up; what is written later than that is counted, not lost in
silence.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from itertools import chain
from typing import Protocol

from .topics import Raw

__all__ = ["Passing"]

_MIXED = 5_000_000_000  # [ns], a physical scale: how far in time caches of recorders mix messages


class _Scan(Protocol):
    def messages(self, topics: Collection[str] | None = None) -> Iterator[Raw]: ...


class Passing:
    """Messages of scans, window by window.

    Attributes:
        late: messages that were written too late to be in their window.
    """

    def __init__(self, scans: Sequence[_Scan]) -> None:
        self.late = 0
        self._scans = scans
        self._left: Iterator[Raw] = iter(())
        self._held: list[Raw] = []
        self._from = -1  # [ns] what was received before is no longer held; -1: nothing was read yet
        self._topics: frozenset[str] | None = None

    def messages(self, topics: Collection[str] | None, first: int, stop: int) -> Iterator[Raw]:
        """Messages received from ``first`` to before ``stop`` [ns], in the order they were written.

        A window before the last one, or other topics, begin the pass anew.
        """
        wanted = None if topics is None else frozenset(topics)
        goes_on = 0 <= self._from <= first and wanted == self._topics
        if not goes_on:
            self._left = (message for scan in self._scans for message in scan.messages(topics))
            self._held, self._topics, self.late = [], wanted, 0
        held, self._held, self._from = self._held, [], -1  # anew, too, after a pass that is left on its way
        keep = max(stop - _MIXED, first)
        for message in chain(held, self._passed(first if goes_on else 0, stop + _MIXED)):
            if message.log_time_ns >= keep:
                self._held.append(message)
            if first <= message.log_time_ns < stop:
                yield message
        self._from = keep

    def _passed(self, first: int, beyond: int) -> Iterator[Raw]:
        """Messages not read before, up to one that was received at ``beyond`` or later; counts those before ``first``."""
        for message in self._left:
            self.late += message.log_time_ns < first
            yield message
            if message.log_time_ns >= beyond:
                return
