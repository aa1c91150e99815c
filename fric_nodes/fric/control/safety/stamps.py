"""Age and order of an input by its stamp."""

from __future__ import annotations

__all__ = ["StampGate"]

_NS = 1e9


class StampGate:
    """Says of each stamp of one sender why it can't be used, if so.

    Args:
        timeout: largest age [s].
        tolerance: how far a stamp may lie in the future [s].

    Attributes:
        newest: the last stamp taken [ns]; None before the first.
    """

    __slots__ = ("_timeout", "_tolerance", "newest")

    def __init__(self, timeout: float, tolerance: float) -> None:
        self._timeout = round(_NS * timeout)
        self._tolerance = round(_NS * tolerance)
        self.newest: int | None = None

    def refusal(self, now: int, stamp: int) -> str:
        """Why an input with ``stamp`` [ns] can't be used at ``now`` [ns]; empty when it can."""
        age = now - stamp
        if age > self._timeout:
            return "too old"
        if -age > self._tolerance:
            return "from the future"
        if self.newest is not None and stamp <= self.newest:
            return "out of order"
        return ""

    def lost(self, now: int) -> bool:
        """True when nothing was taken yet, or the newest is too old at ``now`` [ns]."""
        return self.newest is None or now - self.newest > self._timeout

    def age(self, now: int) -> float:
        """Age of the newest at ``now`` [s]; infinite when there is none."""
        return float("inf") if self.newest is None else (now - self.newest) / _NS
