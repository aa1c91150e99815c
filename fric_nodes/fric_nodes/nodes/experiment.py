"""An experiment that conducts itself: excites the axis, records, identifies, chooses the next setting, and says what it found.

Takes ``joint_states``; gives ``force_command``, or ``reference`` and ``feedforward_force`` for the node ``pid``, whose gains it
sets. Every joint state is answered; between two runs, while the identification goes on in a thread of its own, in wall time
with no force, in lock-step when it is done. A signal, a limit that is passed, and the end leave the drive without force.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

from fric.experiment.answering import Answering, submitting
from fric.experiment.motion import ExperimentError
from sensor_msgs.msg import JointState

from ..base import wait_until_sent
from ..experiment_drive import ControllerDrive, ForceDrive, Output
from ..experiment_parameters import EXPERIMENT, bounds_in, conductor_in, folder_in
from ..forces import STAMPED
from ..loop import LOCK_STEP, PERIOD, LoopNode
from ..qos import SAMPLES
from ..run import run
from ..scheduling import use_normal_scheduling

__all__ = ["ExperimentNode", "main"]

_POLL = 0.005  # [s] between two looks at what is being waited for
_DELIVERY = 4.0  # [s]; Fast DDS asks for acknowledgements every 3 s when nothing else is published
_STOPPING = 2.0  # [s] that a controller has to answer in the end
PARAMETERS = (PERIOD, LOCK_STEP, STAMPED, *EXPERIMENT)


class ExperimentNode(LoopNode):
    """Conducts one experiment; options as for ``rclpy.node.Node``.

    Raises:
        InputError: a parameter can't be used, or the folder exists.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("experiment", PARAMETERS, **options)
        settings = self.settings
        self._out = folder_in(settings)
        bounds = bounds_in(settings, self.period)
        self._workers = ThreadPoolExecutor(1, "identification", use_normal_scheduling)
        say = self.get_logger().info
        self._conductor = conductor_in(settings, bounds, submitting(self._workers, self._out), say)
        limits = (bounds.limits.force, settings.number("filter_time"))
        controller = settings.text("controller")
        self._output: Output = ControllerDrive(self, controller, *limits) if controller else ForceDrive(self, *limits)
        self._answering = Answering(self._conductor, self._output, self._workers, self._out, self.lock_step)
        self._failure: ExperimentError | None = None
        self.create_subscription(JointState, "joint_states", self._on_state, SAMPLES)
        self.create_timer(_POLL, self._poll)

    def condition(self) -> Mapping[str, object]:
        """What the node adds to its report."""
        known = self._conductor.knowledge
        values: dict[str, object] = {"phase": self._conductor.phase}
        values |= {"runs": len(known.runs), "usable runs": len(known.usable), "late joint states": self._answering.late}
        if known.runs:
            values |= {"P": f"{known.runs[-1].setting.proportional:.6g}", "D": f"{known.runs[-1].setting.derivative:.6g}"}
        if known.oscillation is not None:
            values["inertia"] = f"{known.oscillation.model.value('mass'):.6g}"
        return values | {f"relative error, {what}": f"{error:.3g}" for what, error in known.relative_errors().items()}

    def _on_state(self, message: JointState) -> None:
        state, answering = self.state_of_joint(message), self._answering
        if state is None or self.done or not self.has_audience(self._output.publisher):
            return
        if state.stamp == answering.newest:
            self.counters["repeated states"] += 1
            if answering.answered == state.stamp:
                self._output.repeat()
            return
        if state.stamp < answering.newest:
            if self.lock_step:
                self._fail(ExperimentError("joint_states", "start again from an earlier time", "begin the experiment anew"))
            self.refuse_late_state()
            return
        try:
            answering.take(state.stamp, state.position, state.effort)
        except ExperimentError as error:
            self._fail(error)
        self._end_if_written()

    def _poll(self) -> None:
        """Go on with a sample that was kept; notice when none comes any more."""
        if self.done:
            return
        try:
            self._answering.go_on()
        except ExperimentError as error:
            self._fail(error)
        if self._answering.missed():
            self._output.stop(self._answering.newest)
        self._end_if_written()

    # The end

    def _end_if_written(self) -> None:
        if self._answering.written and not self.done:
            self._output.stop(self._answering.newest)
            self.finish()
            self.get_logger().info(f"written: {self._out}/report.html")

    def _fail(self, error: ExperimentError) -> None:
        self._failure = error
        self.finish()

    def close(self) -> None:
        """Leave the drive without force, and write what is known.

        Raises:
            ExperimentError: the experiment failed.
        """
        if self._answering.newest >= 0:
            stopping = self._output.stop(self._answering.newest)
            deadline = time.monotonic() + _STOPPING
            while stopping is not None and self.executor is not None and not stopping.done() and time.monotonic() < deadline:
                self.executor.spin_once(timeout_sec=0.05)
            wait_until_sent(self, self._output.publisher, _DELIVERY)
        self._workers.shutdown(wait=True, cancel_futures=True)
        if self._failure is not None:
            raise self._failure
        if self._answering.stopped():
            self.get_logger().info(f"stopped; what is known is written: {self._out}/report.html")


main = partial(run, ExperimentNode)
"""Conduct the experiment to its end; exit status 0 also when stopped by a signal, 2 when it can't be made as asked."""


if __name__ == "__main__":
    main()
