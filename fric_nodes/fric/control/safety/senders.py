"""Whether two senders command at the same time, where messages don't say who sent them.

A sender either answers each sample once, or sends by a clock of its own. One that sends more often shows its rate while it is
the only one known. With more than one sender known, what comes beyond that rate is added up, and what lacks is taken off;
either is slowly forgotten. That is done twice, against the samples and against the time that has passed: where this process is
held up, samples are left out, which a sender with its own clock doesn't know. Both sums above the threshold mean that two
senders are at work. A sender that is known and silent, as a process that was killed stays for a while, adds nothing, and a
controller that is only unpunctual makes up for samples without a command: as many as its queue holds can still come. What has
queued up while this process was held up comes all at once: a single sample never counts so much that it passes the threshold.
"""

from __future__ import annotations

import math

__all__ = ["SenderWatch", "StreamWatch"]

_MANY = 3.0  # numerical: commands more than samples; the jitter of one sender stays below
_MOST = 8.0  # numerical: the sum goes no further, so that it is down again soon after the second sender has left
_BURST = 3.0  # numerical: a sample counts as at most so many; one of them alone stays below the threshold
_SHARE = 0.02  # numerical: share of a new sample in the rate of a single sender
_QUEUED = 50.0  # numerical: commands that lack and may still come; the queues of the nodes hold so many
_FOLLOWS = 0.002  # numerical: share by which the usual time between two samples changes with each
_LEAK = 0.01  # numerical: per sample; a second sender is found when it sends at more than a hundredth of the samples' rate


class SenderWatch:
    """Commands against samples, and against the time between them.

    Attributes:
        commands: that have come since the last sample.
    """

    __slots__ = ("_by_samples", "_by_time", "_due", "_last", "_n", "_step", "_usual", "commands")

    def __init__(self) -> None:
        self._last: int | None = None
        self._step = 0.0  # usual time between two samples [ns]
        self._n = 0  # times between two samples that it is known from
        self._due = 1.0
        self.forget()

    def forget(self) -> None:
        """Start anew with the senders; how far apart samples are is no matter of theirs."""
        self.commands = 0
        self._by_samples = self._by_time = 0.0
        self._usual = 1.0

    def begin(self) -> None:
        """Count from now on: before, nobody had to command."""
        self.commands, self._last = 0, None

    def command(self) -> None:
        """A command has come."""
        self.commands += 1

    def tick(self, now: int) -> None:
        """A sample is taken at ``now`` [ns], whether anybody has to command or not.

        How many samples were due since the last one follows from their usual distance, which is their median.
        """
        passed = None if self._last is None else float(max(now - self._last, 0))
        self._last, self._due = now, 1.0
        if passed is None or self._step <= 0.0:
            self._step = passed or self._step
            return
        self._n += 1
        self._due = passed / self._step
        self._step *= 1.0 + math.copysign(max(1.0 / (self._n + 1.0), _FOLLOWS), self._due - 1.0)

    def sample(self, senders: int) -> bool:
        """A sample that had to be commanded is over, and so many ``senders`` are known; True when more than one is at work."""
        share = self.commands / self._usual
        at_most = min(share, _BURST)
        if senders > 1:
            self._by_samples = _added(self._by_samples, at_most - 1.0)
            # While it isn't known yet how far apart samples are, time alone would add up what isn't there.
            self._by_time = min(_added(self._by_time, share - self._due), self._by_samples)
        else:
            self._by_samples = self._by_time = 0.0
            self._usual = max(self._usual + _SHARE * self._usual * (at_most - 1.0), 1.0)
        self.commands = 0
        return self.many

    @property
    def many(self) -> bool:
        """True while more than one sender is at work."""
        return self._by_time > _MANY


def _added(surplus: float, more: float) -> float:
    """``surplus``, a little of it forgotten, and ``more``."""
    leaked = surplus - math.copysign(min(_LEAK, abs(surplus)), surplus)
    return min(max(leaked + more, -_QUEUED), _MOST)


class StreamWatch:
    """Whether two senders send stamped values that answer nothing, by the time between their stamps.

    One sender with a period is never faster than that, however its messages are held up and come in bursts. So what is added up
    is one for each value, less the time since the stamp before in periods.

    Args:
        period: of one sender, at the start [ns]; one that is shorter is learnt while a single sender is known.
    """

    __slots__ = ("_longest", "_newest", "_period", "_senders", "_surplus")

    def __init__(self, period: int) -> None:
        self._period = self._longest = float(period)
        self._newest: int | None = None
        self._senders = 1
        self._surplus = 0.0

    def value(self, stamp: int) -> None:
        """A value with ``stamp`` [ns] has come."""
        newest = self._newest
        self._newest = stamp if newest is None else max(newest, stamp)
        if newest is None:
            return
        periods = min(max(stamp - newest, 0) / self._period, _BURST)
        if self._senders > 1:
            leaked = self._surplus - _LEAK if self._surplus > 0.0 else self._surplus
            self._surplus = min(max(leaked + 1.0 - periods, -_MANY), _MOST)
        else:
            self._period = min(max(self._period * (1.0 + _SHARE * (periods - 1.0)), 1.0), self._longest)

    def many(self, senders: int) -> bool:
        """So many ``senders`` are known; True when more than one is at work."""
        self._senders = senders
        if senders <= 1:
            self._surplus = 0.0
        return self._surplus > _MANY
