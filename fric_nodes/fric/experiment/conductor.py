"""The experiment as a whole: runs one after the other, each chosen from what the ones before it have shown.

A generator over samples like its phases (:mod:`.motion`). Between two runs it waits, without force, for the identification
that goes on elsewhere: it yields a :class:`Waiting`, and is sent a sample when that is done. So in lock-step the axis doesn't
move on meanwhile, and nothing depends on how long the identification takes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from ..record import Array, Record, Units
from .choice import Bounds, Done, next_forced, next_setting
from .knowledge import Expectation, Knowledge, Run, concluded, learn
from .motion import REST, Cut, Drive, Sample
from .runs import FORCED, FREE, Placing, Setting, Timing, decay, force_run, settle

__all__ = ["AUTO", "Conductor", "Outcome", "Waiting"]

AUTO = "auto"
T = TypeVar("T")
_REST_LEVEL = 0.01  # of the deflection
_MOST_CUTS = 3
_DELAY = 0.02  # [s] that a command may take to act


@dataclass(frozen=True, eq=False)
class Waiting:
    """Yielded while ``work`` is being done elsewhere; no force acts."""

    work: Future[object]


@dataclass(frozen=True, eq=False)
class Outcome:
    """What came of an experiment.

    Attributes:
        knowledge: of all runs.
        end: why it ended.
        messages: what happened on the way.
    """

    knowledge: Knowledge
    end: Done
    messages: tuple[str, ...]


class Conductor:
    """Conducts one experiment.

    Args:
        bounds: of the settings.
        timing: of the runs.
        kind: :data:`AUTO` (free oscillations, forced runs where friction is too high for them), :data:`FREE` or :data:`FORCED`.
        submit: has work done elsewhere.
        say: takes a line that tells what happens.
        joint: name of the joint.
        units: of position and force.
        effort_hold: when a measured effort acts, as in :class:`fric.record.Record`.
        spring: whether the axis has a spring of its own; None: found out.
        one_gain: lead the axis to its deflection under the P of the run itself: a controller that changes P without a jump of
            its output would keep a part of it as a constant force.
        more: effects fitted besides in the end, where they explain the runs better.

    Attributes:
        knowledge: after the last run that was judged.
        phase: what is being done, in words.
        moving: True while a force moves the axis.
    """

    def __init__(
        self,
        bounds: Bounds,
        timing: Timing,
        kind: str,
        submit: Callable[[Callable[[], object]], Future[object]],
        say: Callable[[str], None],
        joint: str = "axis",
        units: Units | None = None,
        effort_hold: str = "preceding",
        spring: bool | None = None,
        one_gain: bool = False,
        more: Sequence[str] = (),
    ) -> None:
        self._bounds = bounds
        self._timing = timing
        self._kind = kind
        self._submit = submit
        self._say = say
        self._joint = joint
        self._units = units or Units()
        self._hold = effort_hold
        self._spring = spring
        self._one_gain = one_gain
        self._more = tuple(more)
        self._rows: list[tuple[float, float, float, float]] = []
        self._messages: list[str] = []
        self.knowledge = Knowledge()
        self.phase = "waiting for the axis"
        self.moving = False

    def note(self, sample: Sample, force: float) -> None:
        """Keep a sample and the force commanded at it [F]."""
        self._rows.append((*sample, force))

    def _tell(self, message: str) -> None:
        self._messages.append(message)
        self._say(message)

    def conduct(self, sample: Sample) -> Generator[Drive | Waiting, Sample, Outcome]:
        """The experiment, from the first ``sample`` to its end."""
        level = _REST_LEVEL * self._bounds.deflection
        self.phase = "waiting for the axis to rest"
        sample = yield from settle(sample, level, replace(self._timing, settle=12.0 * self._timing.settle))
        origin = sample.position
        forced = self._kind == FORCED
        while True:
            choice = next_forced(self._bounds, self.knowledge) if forced else next_setting(self._bounds, self.knowledge)
            if isinstance(choice, Done):
                if not (choice.sticks and self._kind == AUTO):
                    break
                self._tell(f"{choice.reason}: going on with forced runs")
                forced = True
                continue
            sample = yield from self._one(sample, origin, choice)
            if sum(run.problem.startswith("cut") for run in self.knowledge.runs) >= _MOST_CUTS:
                choice = Done(f"cut off {_MOST_CUTS} times: narrow the limits of the gains, or widen the travel")
                break
        self.phase = "concluding"
        known, more = self.knowledge, self._more
        work = self._submit(lambda: (concluded(known, more),))
        yield Waiting(work)
        (self.knowledge,) = work.result()  # type: ignore[misc]
        self.phase = "finished"
        if choice.sticks:
            choice = replace(choice, reason=f"{choice.reason}; use forced runs (kind: forced), or allow more force")
        self._tell(choice.reason)
        return Outcome(self.knowledge, choice, tuple(self._messages))

    def stopped(self) -> Outcome:
        """What is known when the experiment is broken off."""
        return Outcome(self.knowledge, Done("it was stopped"), (*self._messages, "stopped"))

    def _one(self, sample: Sample, origin: float, setting: Setting) -> Generator[Drive | Waiting, Sample, Sample]:
        """One run, judged."""
        number = len(self.knowledge.runs) + 1
        self.phase = f"run {number}"
        self._tell(f"run {number}: {self._words(setting)}")
        first, problem = len(self._rows), ""
        begin = sample.time
        span = (begin, begin)
        self.moving = True
        try:
            if setting.kind == FREE:
                placing = self._placing(setting)
                span = yield from decay(sample, origin, setting, placing, self._bounds.limits, self._timing)
            else:
                span = yield from force_run(sample, origin, setting, self._bounds.limits, self._timing)
        except Cut as cut:
            problem = f"cut off: {cut}"
            self._tell(f"run {number}: the force is cut: {cut}")
        self.moving = False
        last = len(self._rows)
        self.phase = f"run {number}: resting"
        sample = yield REST
        sample = yield from settle(sample, _REST_LEVEL * self._bounds.deflection, replace(self._timing, settle=60.0))
        record = self._record(first, last, number)
        problem = problem or self._unfaithful(first, last, span)
        start = self._rows[first][0]
        run = Run(number, setting, origin, record, (span[0] - start, span[1] - start), problem)
        self.phase = f"run {number}: identifying"
        runs, spring = (*self.knowledge.runs, run), self._spring
        work = self._submit(lambda: learn(runs, spring))
        yield Waiting(work)
        found = work.result()
        assert isinstance(found, Knowledge)
        self.knowledge = found
        if found.runs[-1].problem and not problem:
            self._tell(f"run {number}: not usable: {found.runs[-1].problem}")
        return sample

    def _words(self, setting: Setting) -> str:
        if setting.kind == FREE:
            return f"P = {setting.proportional:.5g}, D = {setting.derivative:.4g}, let go from {setting.deflection:.4g}"
        return f"force {setting.force:.4g} at {setting.frequency:.4g} rad/s"

    def _placing(self, setting: Setting) -> Placing:
        """Gains that lead the axis to its deflection without swinging."""
        limits = self._bounds.limits
        proportional = setting.proportional
        if not self._one_gain:
            proportional = max(proportional, 0.9 * limits.force / limits.travel)
        expected: Expectation | None = self.knowledge.expectation
        if expected is None:
            return Placing(proportional)
        wanted = 1.4 * math.sqrt(max((expected.stiffness + proportional) * expected.mass, 0.0)) - expected.viscous
        # Through a sampled velocity a damping of m/h is too much; a tenth of it is plenty.
        most = 0.1 * expected.mass / self._bounds.sample_time
        return Placing(proportional, min(max(wanted, 0.0), most))

    def _unfaithful(self, first: int, last: int, span: tuple[float, float]) -> str:
        """Why what the drive gave in ``span`` [s] isn't what was asked of it; empty when it is, or isn't known."""
        rows: Array = np.array(self._rows[first:last], dtype=np.float64)
        rows = rows[(rows[:, 0] >= span[0] + _DELAY) & (rows[:, 0] <= span[1])]
        if rows.shape[0] < 10 or np.any(np.isnan(rows[:, 2])) or np.all(np.isnan(rows[:, 3])):
            return ""
        late = float(np.mean(np.isnan(rows[:, 3])))
        if late > 0.0:
            return f"{100 * late:.2g} % of the joint states came too late to be answered"
        time, given, asked = rows[:, 0], rows[:, 2], rows[:, 3]
        width = max(round(_DELAY / float(np.median(np.diff(time)))), 1) + 1
        windows = np.lib.stride_tricks.sliding_window_view(asked, width)
        given, step = given[width - 1 :], np.diff(time)[width - 2 :]
        noise = 1.4826 * float(np.median(np.abs(given - windows[:, -2])))
        slack = 0.03 * float(np.max(np.abs(asked))) + 6.0 * noise
        off = (given < windows.min(axis=1) - slack) | (given > windows.max(axis=1) + slack)
        lost = float(np.sum(step[off]))
        return f"the drive did not follow the command for {lost:.3f} s" if lost > 0.5 * _DELAY else ""

    def _record(self, first: int, last: int, number: int) -> Record:
        """Rows ``first`` to ``last`` as a record."""
        rows: Array = np.array(self._rows[first : max(last, first + 2)], dtype=np.float64)
        measured = not np.any(np.isnan(rows[:, 2]))
        notes = (
            () if measured else ("the effort is the force commanded: none was measured, so a delay of the drive isn't seen",)
        )
        return Record(
            rows[:, 0] - rows[0, 0],
            rows[:, 1],
            rows[:, 2] if measured else np.nan_to_num(rows[:, 3]),
            joint=self._joint,
            units=self._units,
            source=f"run {number}",
            effort_hold=self._hold if measured else "following",
            notes=notes,
        )
