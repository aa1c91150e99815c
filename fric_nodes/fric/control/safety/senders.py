"""Whether two senders command at the same time, where messages don't say who sent them.

A controller answers each sample once. With more than one sender known, the commands beyond one per sample are added up, less a
slow leak, and those that lack are taken off; a sum above the threshold means that two of them are at work. A sender that is
known and silent, as a process that was killed stays for a while, adds nothing, and a controller that is only unpunctual makes
up for samples without a command.
"""

from __future__ import annotations

__all__ = ["SenderWatch"]

_MANY = 5.0  # numerical: commands more than samples; the jitter of one sender stays below
_MOST = 10.0  # numerical: the sum goes no further, so that it is down again soon after the second sender has left
_LEAK = 0.01  # numerical: per sample; a second sender is found when it sends at more than a hundredth of the samples' rate


class SenderWatch:
    """Commands against samples."""

    __slots__ = ("_commands", "_surplus")

    def __init__(self) -> None:
        self._commands = 0
        self._surplus = 0.0

    def command(self) -> None:
        """A command has come."""
        self._commands += 1

    def sample(self, senders: int) -> bool:
        """A sample is over, and so many ``senders`` are known; True when more than one is at work."""
        if senders > 1:
            leaked = self._surplus - _LEAK if self._surplus > 0.0 else self._surplus
            self._surplus = min(max(leaked + self._commands - 1, -_MANY), _MOST)
        else:
            self._surplus = 0.0
        self._commands = 0
        return self.many

    @property
    def many(self) -> bool:
        """True while more than one sender is at work."""
        return self._surplus > _MANY
