"""The machine to be controlled, simulated: takes ``force_command``, gives ``joint_states`` and what its plant measures besides.

Any plant of the catalogue, with any terms, chosen by the model file. Each further signal of the plant (``normal_load``,
``pressure_a``, ...) has a topic of its own under its name. It is typed like a force: a plain number in wall time; in lock-step,
where only a stamp can say to which sample a number belongs, a stamped one (its field is called ``force``, whatever it holds).

In wall time the axis moves by the time that really passes, and a command acts from the moment of its arrival; without a command
for ``watchdog_time`` the drive gives no force. In lock-step it moves by one period when the command for the present sample
has come.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fric.axis import SimulatedAxis
from fric.errors import InputError
from fric.model_file import read_model
from fric.shared_files import config_file
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from fric_interfaces.msg import StampedForce

from ..base import LOCK_STEP, PERIOD, LoopNode, wait_until_sent, wall_clock
from ..convert import MessageError, from_seconds, set_stamp
from ..forces import STAMPED, ForcePublisher, force_in, force_type
from ..lockstep import Stream
from ..parameters import NodeParameter
from ..qos import SAMPLES
from ..run import run

__all__ = ["PlantNode", "main"]

PARAMETERS = (
    PERIOD,
    LOCK_STEP,
    NodeParameter(
        "model_file",
        "",
        "fric-model/1 file of the axis; empty: the demo axis that comes with the package; set to another file of the same "
        "structure, the axis goes on with its values",
        settable=True,
    ),
    NodeParameter("resolution", 1e-7, "step of the encoder; 0: ideal", "m or rad", 0.0, 1.0),
    NodeParameter("position_noise", 0.0, "standard deviation of a reading of the encoder", "m or rad", 0.0, 1.0),
    NodeParameter("readings", 1, "readings of the encoder per sample; their mean is published", "", 1, 1000),
    NodeParameter("publish_velocity", True, "publish the difference quotient of positions as velocity; false: leave it empty"),
    NodeParameter("force_noise", 0.0, "standard deviation of the effort signal", "N or N m", 0.0, 1e9),
    NodeParameter(
        "force_limit", 1e6, "largest force of the drive (or largest command, if it is no force)", "N or N m", 0.0, 1e12
    ),
    NodeParameter("seed", 0, "of the noise", "", 0, 2**31 - 1),
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
        self._axis = SimulatedAxis(
            read_model(_model_path(settings.text("model_file"))),
            resolution=settings.number("resolution"),
            position_noise=settings.number("position_noise"),
            readings=settings.integer("readings"),
            force_noise=settings.number("force_noise"),
            force_limit=settings.number("force_limit"),
            seed=settings.integer("seed"),
        )
        settings.when_changed(self._on_settings)
        # Compiled (or fetched from the cache) here and not at the first sample.
        self._axis.advance(0.0, 1e-12)
        self._axis.measure()
        self._publish_velocity = settings.flag("publish_velocity")
        duration = settings.number("duration")
        self._last_sample = round(duration / self.period) if duration > 0.0 else math.inf
        self._sample = 0
        self._state = JointState(name=[self.joint], position=[0.0])
        self._state.header.frame_id = self.joint
        self._publisher = self.create_publisher(JointState, "joint_states", SAMPLES)
        self._signals = [ForcePublisher(self, name) for name in self._axis.signal_names]
        self._values: list[float] = []
        self._stamp = 0
        self._model_since = 0  # [ns] stamp of the last state before this model
        self.create_subscription(force_type(self), "force_command", self._on_command, SAMPLES)
        if self.lock_step:
            self._period_ns = from_seconds(self.period)
            self._commands: Stream[float] = Stream()
            self._started = -1.0
            self._seen = -1
            self._measure(0)
            self.create_timer(settings.number("retry_time"), self._retry)
        else:
            self._epoch, self._origin = wall_clock()
            self._now = self._commanded = self._origin
            self._force = 0.0
            self._watchdog = from_seconds(settings.number("watchdog_time"))
            self._fed = False
            self.create_timer(self.period, self._tick)

    def _on_settings(self, changed: set[str]) -> None:
        if "model_file" not in changed:
            return
        try:
            self._axis.become(read_model(_model_path(self.settings.text("model_file"))))
        except InputError as error:
            self.refuse("model", error)
            return
        self.counters["models"] += 1
        self._model_since = self._stamp
        self.get_logger().info(f"moves by the new model from {1e-9 * self._stamp:.6f} s on")

    def condition(self) -> Mapping[str, str]:
        """What the node adds to its report."""
        return {
            "samples": str(self._sample),
            "saturated": str(self._axis.saturated),
            "model since [s]": f"{1e-9 * self._model_since:.6f}",
        }

    def _measure(self, stamp: int) -> None:
        """Fill in the state at ``stamp`` [ns]."""
        state, measured = self._state, self._axis.measure()
        self._values = self._axis.signals()
        self._stamp = stamp
        set_stamp(state.header.stamp, stamp)
        state.position = [measured.position]
        state.velocity = [measured.velocity] if self._publish_velocity else []
        state.effort = [measured.effort]

    def _publish(self) -> None:
        """Publish the plant's signals, and then the state, which calls forth the next command."""
        for publisher, value in zip(self._signals, self._values, strict=True):
            publisher.publish(self._stamp, value)
        self._publisher.publish(self._state)

    def _end_if_due(self) -> bool:
        if self._sample < self._last_sample:
            return False
        if not self.finished.done():
            for publisher in (self._publisher, *(signal.publisher for signal in self._signals)):
                wait_until_sent(self, publisher, 15.0)
            self.finish()
        return True

    def _on_command(self, message: StampedForce | Float64) -> None:
        try:
            stamp, force = force_in(message)
        except MessageError as error:
            self.refuse("command", error)
            return
        if self.lock_step:
            self._on_step(stamp, force)
            return
        now = time.monotonic_ns()
        self._advance_to(now)
        self._commanded, self._force, self._fed = now, force, True

    # Lock-step

    def _on_step(self, stamp: int, command: float) -> None:
        self._commands.put(stamp, command)
        self._go_on()

    def _go_on(self) -> None:
        """Advance as far as there are commands."""
        if not self.has_audience(self._publisher):
            return
        while (force := self._commands.get(self._sample * self._period_ns)) is not None:
            if self._sample >= self._last_sample:
                return
            if self._sample == 0:
                self._started = time.monotonic()
            self._axis.advance(force, self.period)
            self._sample += 1
            self._measure(self._sample * self._period_ns)
            self._publish()
            self.deadlines.tick(time.monotonic())
            self._commands.forget_before(self._sample * self._period_ns)
        if self._sample >= self._last_sample and not self.finished.done():
            rate = self._sample / (time.monotonic() - self._started)
            self.get_logger().info(f"{self._sample} samples, {rate:.0f} samples/s")
            self._end_if_due()

    def _retry(self) -> None:
        if not self.has_audience(self._publisher):
            return
        self._go_on()
        if self._sample == self._seen:
            self.counters["repeated states"] += 1
            self._publish()
        self._seen = self._sample

    # Wall time

    def _advance_to(self, now: int) -> None:
        """Move the axis to ``now`` [ns, monotonic] under the force that the drive has been giving."""
        end_of_force = self._commanded + self._watchdog
        if self._fed and now > end_of_force:
            self._axis.advance(self._force, (end_of_force - self._now) * 1e-9)
            self._now = max(self._now, end_of_force)
            self._force = 0.0
            self._fed = False
            self.counters["watchdog"] += 1
            self.get_logger().warning("no command within the watchdog time, force is zero", throttle_duration_sec=1.0)
        self._axis.advance(self._force, (now - self._now) * 1e-9)
        self._now = now

    def _tick(self) -> None:
        if self._end_if_due():
            return
        now = time.monotonic_ns()
        self._advance_to(now)
        if not self.has_audience(self._publisher):
            return
        if self._sample == 0:
            self.get_logger().info("started")
        self._sample += 1
        self._measure(self._epoch + now - self._origin)
        self._publish()
        self.deadlines.tick(now * 1e-9)


def _model_path(given: str) -> Path:
    """The model file that is meant: a path, or the name of a file that comes with fric; empty: the demo axis."""
    path = Path(given or "demo_axis.yaml")
    return config_file(path.name) if not given or (path.name == given and not path.exists()) else path


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    run(PlantNode, args)


if __name__ == "__main__":
    main()
