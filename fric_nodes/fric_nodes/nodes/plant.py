"""The machine to be controlled, simulated: takes ``force_command``, gives ``joint_states`` and what its plant measures besides.

Any plant of the catalogue, with any terms, chosen by the model file. Each further signal of the plant (``normal_load``,
``pressure_a``, ...) has a topic of its own under its name. It is typed like a force: a plain number in wall time; in lock-step,
where only a stamp can say to which sample a number belongs, a stamped one (its field is called ``force``, whatever it holds).

In wall time the axis moves by the time that really passes, under a drive with a watchdog. In lock-step it moves by one period
when the command for the present sample has come.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from functools import partial
from typing import Any

from fric.axis_in_time import TimedDrive
from std_msgs.msg import Float64

from fric_interfaces.msg import StampedForce

from ..axis_output import AxisOutput, ModelSwitch
from ..axis_parameters import AXIS, simulated_axis
from ..convert import from_seconds
from ..forces import STAMPED, SenderCheck, force_in
from ..lockstep import Stream
from ..loop import LOCK_STEP, PERIOD, LoopNode, wall_clock
from ..parameters import NodeParameter
from ..run import run

__all__ = ["PlantNode", "main"]

_DELIVERY = 15.0  # [s] that subscribers get for the last sample: Fast DDS asks for what was lost every 3 s
PARAMETERS = (
    PERIOD,
    LOCK_STEP,
    *AXIS,
    NodeParameter("watchdog_time", 0.1, "wall time: without a command for so long the force is zero", "s", 1e-3, 1e6),
    NodeParameter("retry_time", 0.2, "lock-step: repeat the state when no command has come for so long", "s", 1e-2, 1e3),
    NodeParameter("duration", 0.0, "end after so much time of the axis; 0: endless", "s", 0.0, 1e9),
    STAMPED,
)


class PlantNode(LoopNode):
    """One simulated axis; options as for ``rclpy.node.Node``.

    Raises:
        InputError: a parameter or the model file can't be used.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("plant", PARAMETERS, **options)
        settings = self.settings
        self._axis = simulated_axis(settings)
        duration = settings.number("duration")
        self._last_sample = round(duration / self.period) if duration > 0.0 else math.inf
        self._sample = 0
        self._output = AxisOutput(self, self._axis)
        self._model = ModelSwitch(self, self._axis, self._output)
        self._senders = SenderCheck(self, self._on_command)
        if self.lock_step:
            self._period_ns = from_seconds(self.period)
            self._commands: Stream[float] = Stream()
            self._started = -1.0
            self._seen = -1
            self._output.measure(0)
            self.create_timer(settings.number("retry_time"), self._retry)
        else:
            self._epoch, self._origin = wall_clock()
            self._drive = TimedDrive(self._axis, self._origin, from_seconds(settings.number("watchdog_time")))
            self.create_timer(self.period, self._tick)

    def condition(self) -> Mapping[str, object]:
        """What the node adds to its report."""
        since = {"model since [s]": f"{1e-9 * self._model.since:.6f}"}
        return {"samples": self._sample, "saturated": self._axis.saturated, **since}

    def _end(self) -> None:
        self._output.wait_until_sent(_DELIVERY)
        self.finish()

    def _on_command(self, message: StampedForce | Float64) -> None:
        command = self.usable("command", force_in, message)
        if command is None:
            return
        if self.lock_step:
            self._commands.put(*command)
            self._go_on()
        elif self._senders.alone():
            self._count_watchdog(self._drive.command(time.monotonic_ns(), command[1]))

    # Lock-step

    def _go_on(self) -> None:
        """Advance as far as there are commands."""
        if not self.has_audience(self._output.publisher):
            return
        while not self.done and (force := self._commands.get(self._sample * self._period_ns)) is not None:
            if self._sample == 0:
                self._started = time.monotonic()
            self._axis.advance(force, self.period)
            self._sample += 1
            self._output.measure(self._sample * self._period_ns)
            self._output.publish()
            self.deadlines.tick(time.monotonic())
            self._commands.forget_before(self._output.stamp)
            if self._sample >= self._last_sample:
                rate = self._sample / (time.monotonic() - self._started)
                self.get_logger().info(f"{self._sample} samples, {rate:.0f} samples/s")
                self._end()

    def _retry(self) -> None:
        self._go_on()
        if self._sample == self._seen and self.has_audience(self._output.publisher):
            self.counters["repeated states"] += 1
            self._output.publish()
        self._seen = self._sample

    # Wall time

    def _count_watchdog(self, ended: bool) -> None:
        if ended:
            self.counters["watchdog"] += 1
            self.get_logger().warning("no command within the watchdog time, force is zero", throttle_duration_sec=1.0)

    def _tick(self) -> None:
        if self._sample >= self._last_sample:
            self._end()
            return
        now = time.monotonic_ns()
        self._count_watchdog(self._drive.advance_to(now))
        self._senders.sample()
        if not self.has_audience(self._output.publisher):
            return
        if self._sample == 0:
            self.get_logger().info("started")
        self._sample += 1
        self._output.measure(self._epoch + now - self._origin)
        self._output.publish()
        self.deadlines.tick(now * 1e-9)


main = partial(run, PlantNode)
"""Serve the node until its time is over, or a signal comes."""

if __name__ == "__main__":
    main()
