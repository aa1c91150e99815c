"""The plant in lock-step: the axis moves by one period when the command for the present sample has come."""

from __future__ import annotations

import time
from collections.abc import Callable

from fric.axis import SimulatedAxis

from .axis_output import AxisOutput
from .convert import from_seconds
from .lockstep import Stream
from .managed import ManagedNode

__all__ = ["PlantInLockStep"]


class PlantInLockStep:
    """The axis of a node that counts samples.

    Args:
        node: whose axis it is.
        axis: moves with the commands.
        output: measures.
        last: number of the last sample.
        end: called when it has been published.

    Attributes:
        sample: number of the present one.
    """

    def __init__(
        self, node: ManagedNode, axis: SimulatedAxis, output: AxisOutput, last: float, end: Callable[[], None]
    ) -> None:
        self._node = node
        self._axis = axis
        self._output = output
        self._last = last
        self._end = end
        self.sample = 0
        self._period_ns = from_seconds(node.period)
        self._commands: Stream[float] = Stream()
        self._started = -1.0
        self._seen = -1
        output.measure(0)
        node.create_timer(node.settings.number("retry_time"), self._retry)

    def command(self, stamp: int, force: float) -> None:
        """A command for ``force`` [F] at the sample ``stamp`` [ns] has come."""
        self._commands.put(stamp, force)
        self._go_on()

    def _waits(self) -> bool:
        """True when commands may be answered."""
        return self._node.active and self._node.has_audience(self._output.publisher)

    def _go_on(self) -> None:
        """Advance as far as there are commands."""
        node = self._node
        if not self._waits():
            return
        while not node.done and (force := self._commands.get(self.sample * self._period_ns)) is not None:
            if self.sample == 0:
                self._started = time.monotonic()
            self._axis.advance(force, node.period)
            self.sample += 1
            self._output.measure(self.sample * self._period_ns)
            self._output.publish()
            node.deadlines.tick(time.monotonic())
            self._commands.forget_before(self._output.stamp)
            if self.sample >= self._last:
                rate = self.sample / (time.monotonic() - self._started)
                node.get_logger().info(f"{self.sample} samples, {rate:.0f} samples/s")
                self._end()

    def _retry(self) -> None:
        self._go_on()
        if self.sample == self._seen and self._waits():
            self._node.counters["repeated states"] += 1
            self._output.publish()
        self._seen = self.sample
