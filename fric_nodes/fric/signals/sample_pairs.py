"""Pairing positions with efforts, from streams that say in different ways when an effort acts; no ROS in here.

The identifier wants for each position the effort at its stamp; where an effort is constant from one stamp to the next, that is
the mean of the interval before and the interval after (as in :mod:`fric.identification.equations`). A joint state may
carry the effort of the interval before it, of the interval after it, or a sampled continuous signal; or it carries none, and
the force command has to serve: by its stamp in lock-step, by the time of reception otherwise (the last one before the state,
held).
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

__all__ = ["EffortPairing", "Sample"]

_COMMANDS_KEPT = 5000


class Sample(NamedTuple):
    """Stamp [ns], time of reception [ns], position [x] and effort [F] (NaN: none)."""

    time: int
    received: int
    position: float
    effort: float


class EffortPairing:
    """Turns samples as they come into samples with the effort at their stamp.

    Args:
        hold: what the effort of a joint state means: ``"preceding"``, ``"following"`` or ``"linear"``.
        at_stamp: give the effort at the stamp; False: as it was sent, with a meaning that :attr:`hold` tells.
    """

    def __init__(self, hold: str, at_stamp: bool = True) -> None:
        self._hold = hold
        self._at_stamps = at_stamp
        self.lacks_effort = False
        """True since a sample came without effort."""
        self.clear()

    @property
    def hold(self) -> str:
        """What the effort of a sample means that is given as it was sent; a command acts from the sample on."""
        return "following" if self.lacks_effort else self._hold

    def clear(self) -> None:
        """Forget samples and commands."""
        self._last: Sample | None = None
        self._waiting: deque[Sample] = deque()
        self._stamped = False
        self._by_stamp: dict[int, float] = {}
        self._by_reception: deque[tuple[int, float]] = deque(maxlen=_COMMANDS_KEPT)
        self._held = math.nan

    def command(self, force: float, received: int, stamp: int | None) -> None:
        """Take in a force command [F], received at ``received`` [ns]; ``stamp`` [ns] when it is a stamped one."""
        if stamp is None:
            self._by_reception.append((received, force))
            return
        self._stamped = True
        self._by_stamp[stamp] = force
        if len(self._by_stamp) > _COMMANDS_KEPT:
            self._by_stamp.pop(next(iter(self._by_stamp)))

    def state(self, sample: Sample) -> None:
        """Take in a joint's state; one that repeats the last stamp is a retransmission and is left out."""
        newest = self._waiting[-1] if self._waiting else self._last
        if newest is None or sample.time != newest.time:
            self._waiting.append(sample)

    def ready(self, before: int) -> list[Sample]:
        """Samples whose effort is known, in order.

        Args:
            before: every command received before this time [ns] has been taken in.
        """
        pairs: list[Sample] = []
        while self._waiting:
            sample = self._waiting[0]
            following = sample
            if math.isnan(sample.effort):
                self.lacks_effort = True
                force = self._command_for(sample, before)
                if force is None:
                    break
                following = sample._replace(effort=force)
            paired = self._at_stamp(following, self._hold if following is sample else "following")
            self._waiting.popleft()
            self._last = following
            if paired is not None and not math.isnan(paired.effort):
                pairs.append(paired)
        return pairs

    def _at_stamp(self, sample: Sample, hold: str) -> Sample | None:
        """The newest sample whose effort at its stamp is known now."""
        if hold == "linear" or not self._at_stamps:
            return sample
        last = self._last
        if last is None or sample.time < last.time:
            return None
        mean = 0.5 * (last.effort + sample.effort)
        return (sample if hold == "following" else last)._replace(effort=mean)

    def _command_for(self, sample: Sample, before: int) -> float | None:
        """The command that acts from the sample on; None while it may still come; NaN when there is none."""
        if self._stamped:
            force = self._by_stamp.pop(sample.time, None)
            if force is None and max(self._by_stamp, default=-1) > sample.time:
                return math.nan  # later samples have been answered already
            return force
        if sample.received >= before:
            return None
        while self._by_reception and self._by_reception[0][0] <= sample.received:
            self._held = self._by_reception.popleft()[1]
        return self._held
