"""The machine to be controlled, simulated: takes ``force_command``, gives ``joint_states`` and what its plant measures besides.

Any plant of the catalogue, with any terms, chosen by the model file. Each further signal of the plant (``normal_load``,
``pressure_a``, ...) has a topic of its own under its name. It is typed like a force: a plain number in wall time; in lock-step,
where only a stamp can say to which sample a number belongs, a stamped one (its field is called ``force``, whatever it holds).

In wall time the axis moves by the time that really passes, under a drive with a safety layer and a watchdog. In lock-step it
moves by one period when the command for the present sample has come.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from std_msgs.msg import Float64

from fric_interfaces.msg import StampedForce

from ..axis_output import AxisOutput, ModelSwitch
from ..axis_parameters import AXIS, simulated_axis
from ..forces import STAMPED, force_in, force_or_nan, force_type
from ..loop import LOCK_STEP, PERIOD
from ..managed import ManagedNode
from ..parameters import NodeParameter
from ..plant_in_lock_step import PlantInLockStep
from ..plant_in_time import LIMITS, PlantInTime
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
    *LIMITS,
    STAMPED,
)


class PlantNode(ManagedNode):
    """One simulated axis; options as for ``rclpy.node.Node``.

    Raises:
        InputError: a parameter or the model file can't be used.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("plant", PARAMETERS, **options)

    def configure(self) -> None:
        """Make the axis, at rest, and the topics."""
        settings = self.settings
        self._axis = simulated_axis(settings)
        duration = settings.number("duration")
        self._last_sample = round(duration / self.period) if duration > 0.0 else math.inf
        self._sample = 0
        self._output = AxisOutput(self, self._axis)
        self._model = ModelSwitch(self, self._axis, self._output)
        commands = self.take_in(force_type(self), "force_command", self._on_command)
        self._in_time: PlantInTime | None = None
        if self.lock_step:
            self._in_step = PlantInLockStep(self, self._axis, self._output, self._last_sample, self._end)
        else:
            self._in_time = PlantInTime(self, self._axis, commands)
            self.create_timer(self.period, self._tick)

    def activate(self) -> None:
        """Take commands and publish states from now on."""
        if self._in_time is not None:
            self._in_time.start()

    def deactivate(self) -> None:
        """Stop the axis; the states are not published any more."""
        if self._in_time is not None:
            self._in_time.stop()

    def summary(self) -> str:
        """What the node works with."""
        limits = f"force limit {self.settings.number('force_limit'):g}" if self._in_time is None else self._in_time.layer.limits
        return f"{super().summary()}; model {self.settings.text('model_file') or 'demo axis'}; {limits}"

    def state_of(self) -> Mapping[str, object]:
        """What the node adds to its report."""
        moved = {"model since [s]": f"{1e-9 * self._model.since:.6f}"}
        saturated = self._axis.saturated + self.counters["force limit"]
        if self._in_time is None:
            return {"samples": self._in_step.sample, "saturated": saturated, **moved}
        return {"samples": self._sample, "saturated": saturated, **moved, **self._in_time.panel.condition()}

    def judgement(self, troubles: Sequence[str]) -> tuple[bytes, str]:
        """Level and text of the report."""
        return super().judgement(troubles) if self._in_time is None else self._in_time.panel.verdict(troubles)

    def _end(self) -> None:
        self._output.wait_until_sent(_DELIVERY)
        self.finish()

    def _on_command(self, message: StampedForce | Float64) -> None:
        if self._in_time is not None:
            self._in_time.command(*force_or_nan(message))
            return
        command = self.usable("command", force_in, message)
        if command is not None:
            self._in_step.command(*command)

    def _tick(self) -> None:
        """A sample in wall time."""
        assert self._in_time is not None
        if self._sample >= self._last_sample:
            self._end()
            return
        stamp = self._in_time.sample()
        if not (self.active and self.has_audience(self._output.publisher)):
            return
        if self._sample == 0:
            self.get_logger().info("started")
        self._sample += 1
        self._output.measure(stamp)
        self._output.publish()
        self.deadlines.tick(time.monotonic())


main = partial(run, PlantNode)
"""Serve the node until its time is over, or a signal comes."""

if __name__ == "__main__":
    main()
