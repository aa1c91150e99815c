"""Bookkeeping of lock-step, where time is the number of the sample and every message may be sent again.

The plant repeats the state of its sample until the command for it comes, and every node answers a repeated question with the
answer that it gave before. So a lost message and a restarted node cost one repetition, and the numbers stay the same. Two rules
follow from messages arriving in the order in which they were sent:

- a stamp that was answered already is a repetition;
- a message with an earlier stamp than the newest one means that its sender goes through the samples again from there, so that
  what it sent for that stamp and later ones no longer counts (:class:`Stream`).
"""

from __future__ import annotations

from typing import Any, Generic, TypeVar

__all__ = ["Answers", "Matching", "Stream"]

Value = TypeVar("Value")
State = TypeVar("State")
Question = TypeVar("Question")
Answer = TypeVar("Answer")


class Stream(Generic[Value]):
    """The messages of one sender that wait for their sample.

    Args:
        capacity: messages kept; the oldest go first.
    """

    def __init__(self, capacity: int = 1024) -> None:
        self._capacity = capacity
        self._values: dict[int, Value] = {}
        self._newest = -1

    def put(self, stamp: int, value: Value) -> None:
        """Keep ``value`` for the sample ``stamp`` [ns]."""
        values = self._values
        if stamp <= self._newest:
            for later in [kept for kept in values if kept >= stamp]:
                del values[later]
        values[stamp] = value
        self._newest = stamp
        if len(values) > self._capacity:
            del values[next(iter(values))]

    def get(self, stamp: int) -> Value | None:
        """What is kept for the sample ``stamp``."""
        return self._values.get(stamp)

    def forget_before(self, stamp: int) -> None:
        """Drop everything for samples before ``stamp``."""
        values = self._values
        while values:
            oldest = next(iter(values))
            if oldest >= stamp:
                return
            del values[oldest]


class Answers(Generic[Question, Answer]):
    """The last answers given, by the stamp of their question.

    Args:
        capacity: answers kept; must exceed the number of samples that a sender looks ahead.
    """

    def __init__(self, capacity: int = 1024) -> None:
        self._capacity = capacity
        self._given: dict[int, tuple[Question, Answer]] = {}
        self._newest = -1

    def find(self, stamp: int, question: Question) -> Answer | None:
        """The answer given to this very question, or None."""
        found = self._given.get(stamp)
        return found[1] if found is not None and found[0] == question else None

    def goes_back(self, stamp: int) -> bool:
        """True when ``stamp``, which has no answer yet, lies before one that has: its sender has started anew."""
        return stamp <= self._newest

    def keep(self, stamp: int, question: Question, answer: Answer) -> None:
        """Remember ``answer``."""
        self._given[stamp] = (question, answer)
        self._newest = stamp
        if len(self._given) > self._capacity:
            del self._given[next(iter(self._given))]

    def clear(self) -> None:
        """Forget everything."""
        self._given.clear()
        self._newest = -1


class Matching(Generic[State]):
    """A state that waits for one value from each of several senders, all with the state's own stamp.

    Args:
        senders: number of senders.
    """

    def __init__(self, senders: int) -> None:
        self._streams: list[Stream[Any]] = [Stream() for _ in range(senders)]
        self._pending: tuple[int, State] | None = None

    def put(self, sender: int, stamp: int, value: Any) -> None:
        """Take in ``value`` of sender number ``sender`` for the sample ``stamp`` [ns]."""
        self._streams[sender].put(stamp, value)

    def ask(self, stamp: int, state: State) -> None:
        """``state`` of the sample ``stamp`` [ns] waits from now on, instead of an earlier one."""
        self._pending = stamp, state

    def complete(self) -> tuple[State, list[Any]] | None:
        """The state that waits and the senders' values; None as long as one is missing."""
        if self._pending is None:
            return None
        stamp, state = self._pending
        values = [value for stream in self._streams if (value := stream.get(stamp)) is not None]
        if len(values) < len(self._streams):
            return None
        self._pending = None
        for stream in self._streams:
            stream.forget_before(stamp)
        return state, values
