"""An experiment that conducts itself: excites the axis, records, identifies, chooses the next setting, and says what it found.

Takes ``joint_states``; gives ``force_command``, or ``reference`` and ``feedforward_force`` for the node ``pid``, whose gains it
sets. Every joint state is answered; between two runs, while the identification goes on in a thread of its own, in wall time
with no force, in lock-step when it is done. A signal, a limit that is passed, and the end leave the drive without force.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

from fric.experiment.conductor import Conductor, Outcome, Waiting
from fric.experiment.knowledge import Knowledge
from fric.experiment.motion import Cut, Drive, ExperimentError, Sample
from fric.experiment.results import write_results, write_run
from fric.experiment.settings import KINDS, NUMBERS, bounds_of, timing_of
from fric.record import Units
from sensor_msgs.msg import JointState

from ..base import LOCK_STEP, PERIOD, LoopNode, wait_until_sent
from ..convert import JointSample, MessageError, joint_sample
from ..experiment_drive import ControllerDrive, ForceDrive, Output
from ..forces import STAMPED
from ..lean_executor import LeanExecutor
from ..orderly import OrderlyNode, run
from ..parameters import NodeParameter
from ..qos import SAMPLES
from ..scheduling import use_normal_scheduling

__all__ = ["ExperimentNode", "main"]

_POLL = 0.005  # [s] between two looks at what is being waited for
_DELIVERY = 4.0  # [s]; Fast DDS asks for acknowledgements every 3 s when nothing else is published
_GAP = 0.25  # [s] without a joint state after which a run is given up, in wall time
_STALE = 20_000_000  # [ns] that a joint state may be later than usual
_CLOCK_DRIFT = 1_000  # [ns] per sample
_SPRINGS = {"auto": None, "yes": True, "no": False}
PARAMETERS = (
    PERIOD,
    LOCK_STEP,
    STAMPED,
    NodeParameter("out", "experiment", "folder for bags, model.yaml and report.html; must not exist"),
    NodeParameter("controller", "", "node of a PID whose gains to set (such as pid); empty: give the force itself"),
    NodeParameter("kind", "auto", "free oscillations, forced runs, or auto: what friction allows", choices=tuple(KINDS)),
    NodeParameter("spring", "auto", "whether the axis has a spring of its own; auto: found out", choices=tuple(_SPRINGS)),
    NodeParameter("position_unit", "m", "unit of positions", choices=("m", "rad")),
    NodeParameter("force_unit", "N", "unit of efforts"),
    NodeParameter(
        "effort_hold", "preceding", "when an effort in a joint state acts", choices=("following", "preceding", "linear")
    ),
    NodeParameter("more_terms", ["presliding"], "effects fitted besides in the end, where they explain the runs better"),
    NodeParameter("fewest_runs", 4, "runs made in any case", "", 1, 1000),
    NodeParameter("most_runs", 12, "runs made at most", "", 1, 1000),
    NodeParameter("periods", 12, "periods of a forced run that count", "", 4, 10_000),
    NodeParameter("filter_time", 0.001, "time constant of the velocity's filter in the feedback", "s", 0.0, 10.0),
    *(NodeParameter(n.name, n.default, n.doc, n.unit, n.lower, n.upper) for n in NUMBERS),
)  # fmt: skip


class ExperimentNode(LoopNode, OrderlyNode):
    """Conducts one experiment; options as for ``rclpy.node.Node``.

    Raises:
        InputError: a parameter can't be used, or the folder exists.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("experiment", PARAMETERS, **options)
        settings = self.settings
        self._out = Path(settings.text("out"))
        if self._out.exists():
            raise ExperimentError(self._out, "exists already", "name another folder (parameter 'out')")
        numbers = {n.name: settings.number(n.name) for n in NUMBERS}
        bounds = bounds_of(numbers, self.period, settings.integer("fewest_runs"), settings.integer("most_runs"))
        controller = settings.text("controller")
        if controller and bounds.proportional[0] <= 0.0:
            raise ExperimentError("parameter 'proportional_low'", "is 0", "a controller needs a gain to lead the axis by")
        self._workers = ThreadPoolExecutor(1, "identification", use_normal_scheduling)
        self._conductor = Conductor(
            bounds,
            timing_of(numbers, settings.integer("periods")),
            KINDS[settings.text("kind")],
            self._submit,
            self.get_logger().info,
            joint=self.joint,
            units=Units(settings.text("position_unit"), settings.text("force_unit")),
            effort_hold=settings.text("effort_hold"),
            spring=_SPRINGS[settings.text("spring")],
            one_gain=bool(controller),
            more=settings.texts("more_terms"),
        )
        limits = (bounds.limits.force, settings.number("filter_time"))
        self._output: Output = ControllerDrive(self, controller, *limits) if controller else ForceDrive(self, *limits)
        self._motion: Generator[Drive | Waiting, Sample, Outcome] | None = None
        self._drive: Drive | None = None  # asked for, and still to be given
        self._work: Future[Any] | None = None
        self._first = self._newest = self._answered = -1
        self._sample = Sample(0.0, 0.0, math.nan)
        self._heard_at = math.inf
        self._youngest = 2**63
        self._outcome: Outcome | None = None
        self._failure: ExperimentError | None = None
        self._done = False
        self.create_subscription(JointState, "joint_states", self._on_state, SAMPLES)
        self.create_timer(_POLL, self._poll)

    @property
    def done(self) -> bool:
        """True when the results are written, or the experiment failed."""
        return self._done

    def condition(self) -> Mapping[str, str]:
        """What the node adds to its report."""
        known = self._conductor.knowledge
        values = {"phase": self._conductor.phase, "runs": str(len(known.runs)), "usable runs": str(len(known.usable))}
        if known.runs:
            values |= {"P": f"{known.runs[-1].setting.proportional:.6g}", "D": f"{known.runs[-1].setting.derivative:.6g}"}
        if known.oscillation is not None:
            values["inertia"] = f"{known.oscillation.model.value('mass'):.6g}"
        return values | {f"relative error, {what}": f"{error:.3g}" for what, error in known.relative_errors().items()}

    def _submit(self, work: Callable[[], object]) -> Future[object]:
        def judged() -> object:
            found = work()
            if isinstance(found, Knowledge):
                write_run(self._out, found.runs[-1])
            return found

        return self._workers.submit(judged)

    # Joint states

    def _on_state(self, message: JointState) -> None:
        try:
            state = joint_sample(message, self.joint)
        except MessageError as error:
            self.refuse("joint state", error)
            return
        if self._done or not self.has_audience(self._output.publisher):
            return
        if state.stamp == self._newest:
            self.counters["repeated states"] += 1
            if self._answered == state.stamp:
                self._output.repeat()
            return
        if state.stamp < self._newest:
            if self.lock_step:
                self._fail(ExperimentError("joint_states", "start again from an earlier time", "begin the experiment anew"))
            self.refuse("joint state", "its stamp is not later than the last one's")
            return
        self._take(state)

    def _take(self, state: JointSample) -> None:
        """One new sample: answer it, or keep it until what is waited for is there."""
        if self._first < 0:
            self._first = state.stamp
        gap = (state.stamp - self._newest) * 1e-9 if self._newest >= 0 else 0.0
        self._newest = state.stamp
        self._heard_at = time.monotonic()
        self._sample = Sample((state.stamp - self._first) * 1e-9, state.position, state.effort)
        if gap > _GAP and not self.lock_step:
            self._give_up(f"no joint state for {gap:.2g} s")
        if not self.lock_step and self._is_stale(state.stamp):
            # What has waited in a queue is a record of what was, and nothing to act upon.
            self.counters["late joint states"] += 1
            self._conductor.note(self._sample, math.nan)
            self._answered = state.stamp
            return
        self._answer()
        if self._answered != state.stamp and not self.lock_step:
            self._output.zero(state.stamp, self._sample)
            self._conductor.note(self._sample, 0.0)
            self._answered = state.stamp
        self.deadlines.tick(time.monotonic())

    def _is_stale(self, stamp: int) -> bool:
        """True when a joint state comes much later after its ``stamp`` [ns] than usual; the clocks may differ, and drift."""
        age = time.time_ns() - stamp
        self._youngest = min(age, self._youngest + _CLOCK_DRIFT)
        return age - self._youngest > _STALE

    def _answer(self) -> None:
        """Answer the newest sample, as far as nothing has to be waited for."""
        try:
            while self._answered != self._newest and not self._done:
                if self._work is not None:
                    if not self._work.done():
                        return
                    self._work = None
                    if self._outcome is not None:
                        self._end()
                        return
                if self._drive is None:
                    self._go_on()
                if self._drive is not None:
                    force = self._output.give(self._newest, self._drive, self._sample)
                    if force is None:
                        return
                    self._conductor.note(self._sample, force)
                    self._drive, self._answered = None, self._newest
        except ExperimentError as error:
            self._fail(error)

    def _go_on(self) -> None:
        """Ask the experiment what comes next."""
        try:
            if self._motion is None:
                self._motion = self._conductor.conduct(self._sample)
                wanted = next(self._motion)
            else:
                wanted = self._motion.send(self._sample)
        except StopIteration as end:
            self._outcome = end.value
            self._work = self._workers.submit(write_results, self._out, self._outcome)
            return
        if isinstance(wanted, Waiting):
            self._work = wanted.work
        else:
            self._drive = wanted

    def _poll(self) -> None:
        """Go on with a sample that was kept; notice when none comes any more."""
        if self._newest >= 0 and self._answered != self._newest:
            self._answer()
        if not self.lock_step and time.monotonic() - self._heard_at > _GAP and self._conductor.moving:
            self._heard_at = math.inf
            self._output.stop(self._newest)
            self._give_up(f"no joint state for {_GAP:g} s")

    def _give_up(self, why: str) -> None:
        """Cut the present run off; without one, nothing."""
        if self._motion is not None and self._conductor.moving:
            wanted = self._motion.throw(Cut(why))
            self._drive = wanted if isinstance(wanted, Drive) else None
            self._work = wanted.work if isinstance(wanted, Waiting) else self._work

    # The end

    def _end(self) -> None:
        self._output.stop(self._newest)
        self._answered = self._newest
        self._done = True
        self.get_logger().info(f"written: {self._out}/report.html")

    def _fail(self, error: ExperimentError) -> None:
        self._failure, self._done = error, True

    def close(self) -> None:
        """Leave the drive without force, and write what is known.

        Raises:
            ExperimentError: the experiment failed.
        """
        if self._newest >= 0:
            stopping = self._output.stop(self._newest)
            if stopping is not None and self.executor is not None:
                self.executor.spin_until_future_complete(stopping, 2.0)
            wait_until_sent(self, self._output.publisher, _DELIVERY)
        self._workers.shutdown(wait=True, cancel_futures=True)
        if self._failure is not None:
            raise self._failure
        if self._outcome is None and self._conductor.knowledge.runs:
            write_results(self._out, self._conductor.stopped())
            self.get_logger().info(f"stopped; what is known is written: {self._out}/report.html")


def main(args: list[str] | None = None) -> None:
    """Conduct the experiment to its end; exit status 0 also when stopped by a signal, 2 when it can't be made as asked."""

    def make() -> ExperimentNode:
        node = ExperimentNode()
        node.settle()
        return node

    run("experiment", make, args, LeanExecutor)


if __name__ == "__main__":
    main()
