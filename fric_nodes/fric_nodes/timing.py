"""How well the deadlines were kept, and the report of it on ``/diagnostics``.

A periodic activity calls :meth:`Deadlines.tick`; once a second the node's :class:`Reporter` publishes what was measured since
the last report, next to the node's counters.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from .qos import DIAGNOSTICS

__all__ = ["Deadlines", "Reporter"]

_TROUBLES = (
    "refused", "watchdog", "command lost", "command burst", "joint state lost", "reference lost", "feedforward lost",
    "controller not",
)  # fmt: skip
_MISS = 1.5  # periods longer than this times the nominal one are misses


class Deadlines:
    """Periods of one activity against the nominal one.

    Args:
        nominal: wanted period [s]; 0 when there is none (lock-step), then nothing counts as a miss.

    Attributes:
        ticks: number of periods since the start.
        misses: number of periods longer than 1.5 nominal ones since the start.
    """

    def __init__(self, nominal: float) -> None:
        self.nominal = nominal
        self.ticks = 0
        self.misses = 0
        self._last: float | None = None
        self._clear()

    def _clear(self) -> None:
        self._n = 0
        self._sum = self._sum_squared = self._longest = 0.0
        self._worst = 0.0
        self._latencies = 0
        self._latency_sum = self._latency_max = 0.0

    def tick(self, now: float) -> None:
        """One period ends at ``now`` [s, monotonic]."""
        if self._last is not None:
            period = now - self._last
            self.ticks += 1
            self._n += 1
            deviation = period - self.nominal
            self._sum += deviation
            self._sum_squared += deviation * deviation
            self._longest = max(self._longest, period)
            self._worst = max(self._worst, abs(deviation))
            if self.nominal > 0.0 and period > _MISS * self.nominal:
                self.misses += 1
        self._last = now

    def skip(self) -> None:
        """The activity rests; the time until its next period counts for nothing."""
        self._last = None

    def latency(self, seconds: float) -> None:
        """An input was answered ``seconds`` [s] after its stamp."""
        self._latencies += 1
        self._latency_sum += seconds
        self._latency_max = max(self._latency_max, seconds)

    def report(self) -> dict[str, str]:
        """What was measured since the last report, and the misses since the start."""
        values = {"nominal period [s]": f"{self.nominal:.6f}"} if self.nominal > 0.0 else {}
        if self._n > 0:
            mean = self._sum / self._n
            spread = math.sqrt(max(self._sum_squared / self._n - mean * mean, 0.0))
            values |= {
                "period mean [s]": f"{self.nominal + mean:.6f}",
                "rate [1/s]": f"{1.0 / (self.nominal + mean):.1f}",
                "period max [s]": f"{self._longest:.6f}",
                "jitter std [s]": f"{spread:.6f}",
            }
            if self.nominal > 0.0:
                values["jitter max [s]"] = f"{self._worst:.6f}"
        if self.nominal > 0.0:
            values |= {"periods": str(self.ticks), "misses": str(self.misses)}
        if self._latencies > 0:
            values |= {
                "latency mean [s]": f"{self._latency_sum / self._latencies:.6f}",
                "latency max [s]": f"{self._latency_max:.6f}",
            }
        self._clear()
        return values


class Reporter:
    """Publishes a node's deadlines and counters on ``/diagnostics``.

    Args:
        node: whose they are.
        period: between two reports [s].
        deadlines: its periodic activity.
        counters: what it counts; one whose name begins with a trouble's is one while it grows.
        verdict: level and text of a report, from the troubles since the last one.
        more: further entries, asked for at every report.
    """

    def __init__(
        self,
        node: Node,
        period: float,
        deadlines: Deadlines,
        counters: Counter[str],
        verdict: Callable[[Sequence[str]], tuple[bytes, str]],
        more: Callable[[], Mapping[str, object]],
    ) -> None:
        self._node = node
        self._deadlines = deadlines
        self._counters = counters
        self._verdict = verdict
        self.more = more
        self._before: Counter[str] = Counter()
        self._misses_before = 0
        # One topic for the whole graph, as diagnostic aggregators expect it.
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", DIAGNOSTICS)
        # The node's own clock may be simulated, and stand still.
        self._timer = node.create_timer(period, self.publish, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _troubles(self) -> list[str]:
        grown = [name for name, count in self._counters.items() if count > self._before[name]]
        missed = self._deadlines.misses - self._misses_before
        self._before = Counter(self._counters)
        self._misses_before = self._deadlines.misses
        troubles = [name for name in grown if name.startswith(_TROUBLES)]
        return [*troubles, f"{missed} deadlines missed"] if missed else troubles

    def publish(self) -> None:
        """Publish one report now."""
        level, text = self._verdict(self._troubles())
        values = {**self._deadlines.report(), **self._counters, **self.more()}
        status = DiagnosticStatus(
            level=level,
            name=self._node.get_fully_qualified_name().lstrip("/"),
            message=text,
            hardware_id="",
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(time.time_ns(), 1_000_000_000)
        self._publisher.publish(message)
