"""Watches the machine while it runs: joint states and commands in, a mismatch out when the machine no longer is its model.

The watch itself (:mod:`fric.diagnosis.watch`) is a few microseconds per sample. Which component changed takes seconds of
processor time, and before it is first asked a compilation: a process of its own does both, so that no sample waits for it.
"""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
import time
from collections import Counter
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from fric.diagnosis.suspects import Suspects, prepare_suspects, suspects
from fric.diagnosis.watch import Phase, Watch, WatchSettings
from fric.model_file import model_from_text, model_to_text, read_model
from fric.record import Record
from fric.shared_files import config_file
from fric.signals.sample_pairs import EffortPairing, Sample
from fric.threads import end_with_parent
from rclpy.clock import Clock, ClockType
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from fric_interfaces.msg import Mismatch

from ..bulk import BulkSubscription
from ..convert import MessageError, joint_sample, set_stamp
from ..orderly import OrderlyNode, run
from ..parameters import NodeParameter, Settings
from ..qos import DIAGNOSTICS, MODEL, SAMPLES

__all__ = ["PARAMETERS", "MonitorNode", "main"]

PARAMETERS = (
    NodeParameter("joint", "", "name of the joint; empty: the only or first one of the joint states"),
    NodeParameter("model_file", "", "fric-model/1 file of what the machine is meant to be; empty: the demo axis"),
    NodeParameter(
        "force_from",
        "joint_states",
        "whose force the model is given: the effort of the joint states, or the command; only the command shows what happens "
        "between command and force",
        choices=("joint_states", "force_command"),
    ),
    NodeParameter(
        "effort_hold", "preceding", "when an effort in a joint state acts", choices=("following", "preceding", "linear")
    ),
    NodeParameter("learning_time", 10.0, "motion from which the floor is learnt", unit="s", lower=2.0, upper=3600.0),
    NodeParameter("tolerance", 0.01, "share of the force that the model may be off at any time", lower=0.0, upper=1.0),
    NodeParameter("false_alarm_time", 360000.0, "mean time between false alarms, at least", unit="s", lower=1.0, upper=1e12),
    NodeParameter("name_component", True, "find out which component changed, in a process of its own"),
)
_QUEUE = 5000  # samples that may wait
_ROUND = 0.01  # [s] between two rounds of taking samples
_BATCH = 1000
_LOOKS = (2.0, 3.0, 4.5, 8.0)  # [s] after the change at which what was recorded since is looked at; a second tells too little


def _calm() -> None:
    """The process that names components leaves the signals to the node, and the processor to the machine."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    os.nice(5)
    end_with_parent()


def _prepare(text: str) -> None:
    prepare_suspects(model_from_text(text))


def _suspects(text: str, record: Record, bandwidth: float, floor: float) -> Suspects:
    return suspects(model_from_text(text), record, bandwidth, floor)


class MonitorNode(OrderlyNode):
    """Follows the joint states with a model and publishes when it stops explaining them.

    Raises:
        ModelError: the model file cannot be used.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__("monitor", **node_options)
        settings = Settings(self, PARAMETERS)
        self._joint = settings.text("joint")
        file = settings.text("model_file")
        self._model = read_model(file or config_file("demo_axis.yaml"))
        self._by_command = settings.text("force_from") == "force_command"
        hold = "following" if self._by_command else settings.text("effort_hold")
        self.watch = Watch(
            self._model,
            WatchSettings(
                learning_time=settings.number("learning_time"),
                tolerance=settings.number("tolerance"),
                false_alarm_time=settings.number("false_alarm_time"),
                hold=hold,
            ),
        )
        self._pairing = EffortPairing(hold, at_stamp=False)
        self.counters: Counter[str] = Counter()
        self.newest = self._origin = -1
        self._unstamped = False
        self._phase = self.watch.phase
        self._looks: list[float] = []
        self._found: Suspects | None = None
        self._pending: tuple[Future[Suspects], int] | None = None
        self._mismatches = self.create_publisher(Mismatch, "friction/mismatch", MODEL)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", DIAGNOSTICS)
        deep = QoSProfile(depth=_QUEUE, reliability=SAMPLES.reliability)
        self._states = BulkSubscription(self, "sensor_msgs/msg/JointState", "joint_states", deep, raw=False)
        self._commands: BulkSubscription | None = None
        self._pool: ProcessPoolExecutor | None = None
        self._text = model_to_text(self._model)
        if settings.flag("name_component"):
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(1, mp_context=context, initializer=_calm)
            self._ready: Future[None] = self._pool.submit(_prepare, self._text)
        _ = self._model.loops  # compiled, or fetched from the cache, here and not at the first sample
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_ROUND, self.work, clock=steady)
        self.create_timer(1.0, self._report, clock=steady)

    def prepared(self) -> bool:
        """True when a component can be named at once."""
        return self._pool is not None and self._ready.done()

    def work(self) -> None:
        """Take what has come, and say what is new."""
        before = time.time_ns()  # the clock on which the middleware stamps reception
        self._take_commands()
        for message, received, _ in self._states.take(_BATCH):
            self._take(message, received)
        for sample in self._pairing.ready(before):
            if self._origin < 0:
                self._origin = sample.time
            self.newest = sample.time
            self.watch.take((sample.time - self._origin) * 1e-9, sample.position, sample.effort)
            self._follow_phase()
        self._listen_to_commands()
        self._collect()

    def _take_commands(self) -> None:
        if self._commands is None:
            return
        for message, received, _ in self._commands.take(_BATCH):
            stamp = message.header.stamp if hasattr(message, "header") else None
            force = message.force if stamp is not None else message.data
            if not math.isfinite(force):
                self.counters["refused: command not finite"] += 1
                continue
            self._pairing.command(force, received, None if stamp is None else stamp.sec * 1_000_000_000 + stamp.nanosec)

    def _take(self, message: JointState, received: int) -> None:
        try:
            if not self._joint and message.name:
                self._joint = message.name[0]
            sample = joint_sample(message, self._joint)
        except MessageError as error:
            self.counters["refused: joint state"] += 1
            self.get_logger().warning(f"joint state refused: {error}", throttle_duration_sec=5.0)
            return
        if sample.stamp and self._unstamped:
            # In lock-step the first stamp is 0, which looks like none; time by the wall doesn't go with what follows.
            self._pairing.clear()
            self._origin = -1
        self._unstamped = not sample.stamp
        effort = math.nan if self._by_command else sample.effort
        self._pairing.state(Sample(sample.stamp or received, received, sample.position, effort))

    def _listen_to_commands(self) -> None:
        """Subscribe to the command, in the type in which it is published, where it is wanted or efforts are missing."""
        if self._commands is not None or not (self._by_command or self._pairing.lacks_effort):
            return
        topic = self.resolve_topic_name("force_command")
        for publisher in self.get_publishers_info_by_topic(topic):
            deep = QoSProfile(depth=_QUEUE, reliability=publisher.qos_profile.reliability)
            self._commands = BulkSubscription(self, publisher.topic_type, topic, deep, raw=False)
            return

    def _follow_phase(self) -> None:
        """Announce the beginning and the end of a mismatch, and have what was recorded since looked at."""
        watch = self.watch
        if watch.phase is not self._phase:
            before, self._phase = self._phase, watch.phase
            if watch.phase is Phase.DETECTED:
                self._found, self._looks = None, list(_LOOKS)
                self.get_logger().warning(f"mismatch detected, since {self._age():.1f} s")
                self._say(self.newest)
            elif before is Phase.DETECTED:
                self._found, self._looks = None, []
                self.get_logger().info("the model explains the machine again")
                self._say(self.newest)
        if watch.phase is Phase.DETECTED and self._looks and self._age() >= self._looks[0] and self._pending is None:
            self._look()

    def _age(self) -> float:
        return (self.newest - self._origin) * 1e-9 - self.watch.changed

    def _look(self) -> None:
        pool = self._pool
        if pool is None or not self.prepared():
            return
        record = self.watch.since_change()
        if record is None:
            return
        self._looks = [each for each in self._looks if each > self._age()]
        clearest, floor = self.watch.clearest_floor()
        try:
            self._pending = pool.submit(_suspects, self._text, record, clearest, floor), self.newest
        except BrokenProcessPool:
            self.counters["process that names components ended"] += 1
            self._pool = None
        except RuntimeError:
            if self._pool is not None:  # or else it was shut down meanwhile, with the node
                raise

    def _collect(self) -> None:
        """Publish what the other process found, when it has."""
        if self._pending is None or not self._pending[0].done():
            return
        future, stamp = self._pending
        self._pending = None
        if future.cancelled():
            return  # with the process that was to do it, as the node ends
        error = future.exception()
        if error is not None:
            self.counters["failed: naming the component"] += 1
            self.get_logger().warning(f"the component could not be named: {error}", throttle_duration_sec=5.0)
        elif self.watch.phase is Phase.DETECTED:
            self._found = future.result()
            self._say(stamp)

    def _say(self, stamp: int) -> None:
        found, watch = self._found, self.watch
        message = Mismatch(joint=self._joint or self._model.joint, detected=watch.phase is Phase.DETECTED)
        set_stamp(message.header.stamp, stamp)
        message.header.frame_id = message.joint
        if message.detected and found is not None:
            message.component, message.effect, message.runner_up = found.component, found.effect, found.runner_up
            message.confidence, message.share_of_mismatch, message.regime = found.confidence, found.share, found.regime
            what = "a change of what the model has" if found.known else "not in the model"
            message.detail = (
                f"{found.strength:.3g} {self._model.units.force} missing on average over {found.duration:.1f} s; "
                f"{found.component or 'no component'} ({100 * found.component_confidence:.0f} % sure): {found.effect}, {what}"
            )
        elif message.detected:
            ratio = max(watch.ratio)
            message.detail = f"{ratio:.3g} times the energy of the floor is missing; floor learnt from {watch.learnt:.0f} s"
        else:
            message.detail = "the model explains the machine as it did at the beginning"
        self._mismatches.publish(message)

    def _report(self) -> None:
        watch = self.watch
        counted = {**self.counters, **watch.counters}
        values = {
            "phase": watch.phase.value,
            "floor learnt from [s of motion]": f"{watch.learnt:.1f}",
            f"floor, root mean square [{self._model.units.force}]": ", ".join(f"{each:.3g}" for each in watch.floor),
            "energy over floor": ", ".join(f"{each:.3g}" for each in watch.ratio),
            "sum over threshold": ", ".join(f"{test.sum / test.threshold:.2f}" for test in watch.tests),
            "names components": "yes" if self.prepared() else "not yet",
            **counted,
        }
        level = DiagnosticStatus.ERROR if watch.phase is Phase.DETECTED else DiagnosticStatus.OK
        if level == DiagnosticStatus.OK and counted:
            level = DiagnosticStatus.WARN
        status = DiagnosticStatus(
            level=level,
            name=self.get_fully_qualified_name().lstrip("/"),
            message=watch.phase.value,
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)

    def close(self) -> None:
        """Take what has come, and end the process that names components."""
        self.work()
        self.release()

    def release(self) -> None:
        """End the process that names components."""
        pool, self._pool = self._pool, None
        if pool is not None:
            for process in list((pool._processes or {}).values()):
                process.kill()
            pool.shutdown(wait=True, cancel_futures=True)


def main(args: list[str] | None = None) -> None:
    """Watch until SIGINT or SIGTERM; exit status 2 when the model file cannot be used."""
    run("monitor", MonitorNode, args)


if __name__ == "__main__":
    main()
