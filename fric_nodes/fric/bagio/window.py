"""A part of a recording by time of reception, and what the writer of a bag stored about its samples.

What is held or interpolated at the joint states, such as a command, is read a little beyond the part, so that the first and the
last of them have their neighbours.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..record import Mask
from .errors import BagError, DamagedError
from .series import Messages
from .source import Source
from .topics import Topic

__all__ = ["Window", "stored_invalid", "stored_notes"]

_AROUND = 1_000_000_000  # [ns], a physical scale: commands and references are published once a second or more often


@dataclass(frozen=True)
class Window:
    """A part of a recording.

    Attributes:
        first_ns: time of reception of its first sample or later [ns].
        stop_ns: as that, of the first sample that is not in it.
        before: how many joint states the recording has before it; None: to be counted where that matters.
    """

    first_ns: int
    stop_ns: int
    before: int | None = None

    @classmethod
    def of(cls, source: Source, first: float, last: float, before: int | None = None) -> Window:
        """The window from ``first`` to ``last`` [s] from the first message of a recording.

        Raises:
            BagError: the recording has no message, or none then.
        """
        start, end = source.start_ns, source.end_ns
        if start is None or end is None:
            raise BagError(source.path, "is empty: it holds no message", "record while the topics are being published")
        if not (first < last and first * 1e9 <= end - start and last > 0.0):
            long = (end - start) * 1e-9
            problem = f"lasts {long:.6g} s and has nothing between {first:.6g} s and {last:.6g} s"
            raise BagError(source.path, problem, "choose a part of it")
        stop = end + 1 if last * 1e9 > end - start else start + round(last * 1e9)
        return cls(start + max(round(first * 1e9), 0), stop, before)

    @property
    def around(self) -> tuple[int, int]:
        """What is read [ns], see above."""
        return self.first_ns - _AROUND, self.stop_ns + _AROUND

    def inside(self, states: Messages) -> Messages:
        """Joint states that lie in the window."""
        first, stop = np.searchsorted(states.log_ns, [self.first_ns, self.stop_ns]).tolist()
        return Messages(states.topic, states.log_ns[first:stop], states.data[first:stop])

    def counted(self, source: Source, states: Topic) -> int | None:
        """How many joint states lie before the window; they are passed by, and not kept. None where damage lies among them."""
        if self.before is not None:
            return self.before
        whole, source.window = source.window, (0, self.first_ns)
        try:
            return sum(message.msgtype == states.msgtype for message in source.messages({states.name}))
        except DamagedError:
            return None
        finally:
            source.window = whole


def stored_invalid(custom: Mapping[str, str], n_samples: int, before: int = 0, n_all: int | None = None) -> Mask | None:
    """Which samples the writer of the bag left usable; None when what it says is about another number of samples.

    Args:
        custom: data stored with the bag.
        n_samples: that were read.
        before: samples before these.
        n_all: samples of the whole recording; None: those that were read.
    """
    valid = np.ones(n_samples, dtype=np.bool_)
    try:
        stored = json.loads(custom.get("fric.invalid", "{}"))
        if not stored:
            return valid
        if stored["samples"] != (n_samples if n_all is None else n_all):
            return None
        for first, last in stored["ranges"]:
            valid[max(first - before, 0) : max(last + 1 - before, 0)] = False
    except (ValueError, KeyError, TypeError):
        pass  # written by somebody else: only an offer
    return valid


def stored_notes(custom: Mapping[str, str]) -> tuple[str, ...]:
    """The notes of the record that was written."""
    try:
        stored = json.loads(custom.get("fric.notes", "[]"))
    except ValueError:
        return ()
    return tuple(str(note) for note in stored) if isinstance(stored, list) else ()
