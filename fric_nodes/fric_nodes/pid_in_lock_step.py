"""Control in lock-step: the answer to a joint state waits for the reference, and the feedforward, of the same stamp."""

from __future__ import annotations

import time

from fric.control.controller import Law, Setpoint
from fric.control.reference import ReferencePoint

from .convert import JointSample
from .forces import ForcePublisher
from .lockstep import Matching
from .managed import ManagedNode

__all__ = ["StepControl"]

_REFERENCE, _FEEDFORWARD = 0, 1  # what a state waits for


class StepControl:
    """A law that counts samples.

    Args:
        node: counts repetitions and restarts.
        law: gives the force.
        commands: where it is published.
        waits: wait for a feedforward, too.
    """

    def __init__(self, node: ManagedNode, law: Law, commands: ForcePublisher, waits: bool) -> None:
        self._node = node
        self._law = law
        self._commands = commands
        self._answered = -1
        self._matching: Matching[JointSample] = Matching(2 if waits else 1)

    def reference(self, reference: ReferencePoint) -> None:
        """Take in a reference."""
        self._matching.put(_REFERENCE, reference.stamp, Setpoint(*reference[1:]))
        self._answer()

    def feedforward(self, stamp: int, force: float) -> None:
        """Take in a feedforward ``force`` [F] for the sample ``stamp`` [ns]."""
        self._matching.put(_FEEDFORWARD, stamp, force)
        self._answer()

    def state(self, state: JointSample) -> None:
        """Take in a joint state."""
        if state.stamp == self._answered:
            self._node.counters["repeated states"] += 1
            self._commands.repeat()
            return
        if state.stamp < self._answered:
            self._node.counters["restarts"] += 1
            self._law.reset()
        self._matching.ask(state.stamp, state)
        self._answer()

    def _answer(self) -> None:
        """Publish the command to the state that waits, when all that it takes is there."""
        node = self._node
        complete = self._matching.complete() if node.active and node.has_audience(self._commands.publisher) else None
        if complete is None:
            return
        state, (wanted, *feedforward) = complete
        self._commands.publish(state.stamp, self._law.answer(wanted, state.position, node.period, sum(feedforward)))
        self._answered = state.stamp
        node.deadlines.tick(time.monotonic())
