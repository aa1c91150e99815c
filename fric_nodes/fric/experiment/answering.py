"""An experiment's answers to samples that come one by one, in lock-step or in wall time; no ROS in here.

Every sample is answered. In lock-step an answer waits for what it needs, and the axis with it. In wall time a sample that can't
be answered yet gets no force; one that is late is a record of what was, and nothing to act upon.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any, Protocol

from .conductor import Conductor, Outcome, Waiting
from .knowledge import Knowledge
from .motion import Cut, Drive, Sample
from .results import write_results, write_run

__all__ = ["Answering", "Output", "Staleness", "submitting"]

_GAP = 0.25  # physical scale: [s] without a sample after which a run is given up, in wall time
_STALE = 20_000_000  # physical scale: [ns] that a sample may be later than usual
_CLOCK_DRIFT = 1_000  # physical scale: [ns] per sample that two clocks may drift apart


class Output(Protocol):
    """Where the drives of an experiment go."""

    def give(self, stamp: int, drive: Drive, sample: Sample) -> float | None:
        """Answer ``sample`` of ``stamp`` [ns] with ``drive``: the force [F] (NaN: not known), or None when it has to wait."""

    def zero(self, stamp: int, sample: Sample) -> None:
        """Answer ``sample`` while something is being waited for: no force that isn't there already."""


def submitting(workers: Executor, out: Path) -> Callable[[Callable[[], object]], Future[object]]:
    """What has work done by ``workers``; a run that was judged is written to the folder ``out``."""

    def submit(work: Callable[[], object]) -> Future[object]:
        def judged() -> object:
            found = work()
            if isinstance(found, Knowledge):
                write_run(out, found.runs[-1])
            return found

        return workers.submit(judged)

    return submit


class Staleness:
    """Whether samples come later after their stamps than usual; the clocks may differ, and drift."""

    def __init__(self) -> None:
        self._youngest = 2**63

    def is_stale(self, stamp: int, now: int) -> bool:
        """True when a sample of ``stamp`` [ns], received at ``now`` [ns], has waited somewhere."""
        age = now - stamp
        self._youngest = min(age, self._youngest + _CLOCK_DRIFT)
        return age - self._youngest > _STALE


class Answering:
    """Answers samples as ``conductor`` wants them answered.

    Args:
        conductor: of the experiment.
        output: takes the answers.
        workers: write the results at the end.
        out: folder of the results.
        waits: in lock-step an answer may come later than its sample; in wall time it may not.

    Attributes:
        newest: stamp of the newest sample [ns]; -1 before the first.
        answered: stamp of the last sample that was answered [ns].
        late: samples that came too late to be acted upon.
        outcome: of the experiment, when it has come to its end.
        written: True when the results are written.
    """

    def __init__(self, conductor: Conductor, output: Output, workers: Executor, out: Path, waits: bool) -> None:
        self._conductor = conductor
        self._output = output
        self._workers = workers
        self._out = out
        self._waits = waits
        self._motion: Generator[Drive | Waiting, Sample, Outcome] | None = None
        self._drive: Drive | None = None  # asked for, and still to be given
        self._work: Future[Any] | None = None
        self._first = self.newest = self.answered = -1
        self._sample = Sample(0.0, 0.0, math.nan)
        self._heard_at = math.inf
        self._staleness = Staleness()
        self.late = 0
        self.outcome: Outcome | None = None
        self.written = False

    def take(self, stamp: int, position: float, effort: float) -> None:
        """One new sample: answer it, or keep it until what is waited for is there.

        Args:
            stamp: [ns], greater than :attr:`newest`.
            position: [x].
            effort: [F]; NaN when it isn't measured.

        Raises:
            ExperimentError: the experiment can't be made as asked.
        """
        if self._first < 0:
            self._first = stamp
        gap = (stamp - self.newest) * 1e-9 if self.newest >= 0 else 0.0
        self.newest = stamp
        self._heard_at = time.monotonic()
        self._sample = Sample((stamp - self._first) * 1e-9, position, effort)
        if self._waits:
            self.go_on()
            return
        if gap > _GAP:
            self._give_up(f"no joint state for {gap:.2g} s")
        if self._staleness.is_stale(stamp, time.time_ns()):
            self.late += 1
            self._close_sample(math.nan)
            return
        self.go_on()
        if self.answered != stamp:
            self._output.zero(stamp, self._sample)
            self._close_sample(0.0)

    def _close_sample(self, force: float) -> None:
        self._conductor.note(self._sample, force)
        self.answered = self.newest

    def go_on(self) -> None:
        """Answer the newest sample, as far as nothing has to be waited for.

        Raises:
            ExperimentError: the experiment can't be made as asked.
        """
        while self.answered != self.newest and not self.written:
            if self._work is not None:
                if not self._work.done():
                    return
                self._work = None
                if self.outcome is not None:
                    self.written = True
                    return
            if self._drive is None:
                self._ask()
            if self._drive is not None:
                force = self._output.give(self.newest, self._drive, self._sample)
                if force is None:
                    return
                self._drive = None
                self._close_sample(force)

    def _ask(self) -> None:
        """Ask the experiment what comes next."""
        try:
            if self._motion is None:
                self._motion = self._conductor.conduct(self._sample)
                wanted = next(self._motion)
            else:
                wanted = self._motion.send(self._sample)
        except StopIteration as end:
            self.outcome = end.value
            self._work = self._workers.submit(write_results, self._out, end.value)
            return
        self._follow(wanted)

    def _follow(self, wanted: Drive | Waiting) -> None:
        if isinstance(wanted, Waiting):
            self._work = wanted.work
        else:
            self._drive = wanted

    def missed(self) -> bool:
        """True, once, when samples no longer come in a run that moves the axis; the run is given up."""
        if self._waits or time.monotonic() - self._heard_at <= _GAP or not self._conductor.moving:
            return False
        self._heard_at = math.inf
        self._give_up(f"no joint state for {_GAP:g} s")
        return True

    def _give_up(self, why: str) -> None:
        """Cut the present run off; without one, nothing."""
        if self._motion is not None and self._conductor.moving:
            self._drive = None
            self._follow(self._motion.throw(Cut(why)))

    def stopped(self) -> bool:
        """Write what is known of an experiment that was stopped early; False when nothing is."""
        if self.outcome is not None or not self._conductor.knowledge.runs:
            return False
        write_results(self._out, self._conductor.stopped())
        return True
