"""Watches the machine while it runs: joint states and commands in, a mismatch out when the machine no longer is its model.

The watch itself (:mod:`fric.diagnosis.watch`) is a few microseconds per sample. A process of its own names the component.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from fric.diagnosis.suspects import Suspects
from fric.diagnosis.watch import Phase, Watch, WatchSettings
from fric.model_file import read_model
from fric.shared_files import config_file
from fric.signals.sample_pairs import EffortPairing, Sample

from fric_interfaces.msg import Mismatch

from ..component_process import ComponentProcess, EndedError
from ..mismatch import mismatch_message, watch_report
from ..parameters import NodeParameter
from ..qos import MODEL
from ..run import run
from ..sample_node import SampleNode

__all__ = ["PARAMETERS", "MonitorNode", "main"]

PARAMETERS = (
    NodeParameter("model_file", "", "fric-model/1 file of what the machine is meant to be; empty: the demo axis"),
    NodeParameter(
        "force_from",
        "joint_states",
        "whose force the model is given: the effort of the joint states, or the command; only the command shows what happens "
        "between command and force",
        choices=("joint_states", "force_command"),
    ),
    NodeParameter("learning_time", 10.0, "motion from which the floor is learnt", unit="s", lower=2.0, upper=3600.0),
    NodeParameter("tolerance", 0.01, "share of the force that the model may be off at any time", lower=0.0, upper=1.0),
    NodeParameter("false_alarm_time", 360000.0, "mean time between false alarms, at least", unit="s", lower=1.0, upper=1e12),
    NodeParameter("name_component", True, "find out which component changed, in a process of its own"),
)
_LOOKS = (2.0, 3.0, 4.5, 8.0)  # [s] after the change at which what was recorded since is looked at; a second tells too little


class MonitorNode(SampleNode):
    """Follows the joint states with a model and publishes when it stops explaining them.

    Raises:
        ModelError: the model file cannot be used.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__("monitor", PARAMETERS, **node_options)
        settings = self.settings
        self._model = read_model(settings.text("model_file") or config_file("demo_axis.yaml"))
        self.by_command = settings.text("force_from") == "force_command"
        hold = "following" if self.by_command else settings.text("effort_hold")
        numbers = {name: settings.number(name) for name in ("learning_time", "tolerance", "false_alarm_time")}
        self.watch = Watch(self._model, WatchSettings(**numbers, hold=hold))
        self.pairing = EffortPairing(hold, at_stamp=False)
        self._phase = self.watch.phase
        self._looks: list[float] = []
        self._found: Suspects | None = None
        self._mismatches = self.create_publisher(Mismatch, "friction/mismatch", MODEL)
        _ = self._model.loops  # compiled, or fetched from the cache, here and not at the first sample
        self._naming = ComponentProcess(self._model) if settings.flag("name_component") else None

    def prepared(self) -> bool:
        """True when a component can be named at once."""
        return self._naming is not None and self._naming.prepared()

    def learn(self, time: float, sample: Sample) -> None:
        """Watch ``sample``, and say what is new."""
        self.newest = sample.time
        self.watch.take(time, sample.position, sample.effort)
        self._follow_phase()

    def after_round(self, taken: int) -> None:
        """Publish which component changed, when that is known."""
        try:
            answer = None if self._naming is None else self._naming.answer()
        except Exception as error:  # whatever it was, the watch goes on
            self.counters["failed: naming the component"] += 1
            self.get_logger().warning(f"the component could not be named: {error}", throttle_duration_sec=5.0)
            return
        if answer is not None and self.watch.phase is Phase.DETECTED:
            self._found, stamp = answer
            self._say(stamp)

    def _follow_phase(self) -> None:
        """Announce the beginning and the end of a mismatch, and have what was recorded since looked at."""
        watch = self.watch
        if watch.phase is not self._phase:
            before, self._phase, self._found = self._phase, watch.phase, None
            self._looks = list(_LOOKS) if watch.phase is Phase.DETECTED else []
            if watch.phase is Phase.DETECTED:
                self.get_logger().warning(f"mismatch detected, since {self._age():.1f} s")
            elif before is Phase.DETECTED:
                self.get_logger().info("the model explains the machine again")
            if Phase.DETECTED in (before, watch.phase):
                self._say(self.newest)
        if watch.phase is Phase.DETECTED and self._looks and self._age() >= self._looks[0]:
            self._look()

    def _age(self) -> float:
        return self.seconds() - self.watch.changed

    def _look(self) -> None:
        naming = self._naming
        record = self.watch.since_change() if naming is not None and naming.free else None
        if naming is None or record is None:
            return
        self._looks = [each for each in self._looks if each > self._age()]
        try:
            naming.ask(record, *self.watch.clearest_floor(), self.newest)
        except EndedError as error:
            self.counters[str(error)] += 1

    def _say(self, stamp: int) -> None:
        joint = self.joint or self._model.joint
        self._mismatches.publish(mismatch_message(self.watch, self._found, self._model, joint, stamp))

    def condition(self) -> Mapping[str, object]:
        """What the node adds to its report."""
        names = {"names components": "yes" if self.prepared() else "not yet"}
        return watch_report(self.watch, self._model) | names | self.watch.counters

    def verdict(self, troubles: Sequence[str]) -> tuple[bytes, str]:
        """An error while the model doesn't explain the machine, a warning once something was refused."""
        phase = self.watch.phase
        level = DiagnosticStatus.WARN if self.counters or self.watch.counters else DiagnosticStatus.OK
        return DiagnosticStatus.ERROR if phase is Phase.DETECTED else level, phase.value

    def close(self) -> None:
        """Take what has come, and end the process that names components."""
        super().close()
        if self._naming is not None:
            self._naming.close()


main = partial(run, MonitorNode)
"""Watch until SIGINT or SIGTERM; exit status 2 when the model file cannot be used."""


if __name__ == "__main__":
    main()
