"""A controller behind the safety layer: what a joint state calls forth passes the layer before it leaves.

The layer's readings are the joint states, its commands the controller's forces. While the layer lets nothing through, the
controller starts anew with every state, so that nothing accumulates, and after the next enabling it begins at the axis's own
motion with the force that acts. When joint states stay away, the layer takes the force away by itself; whoever has received no
force for the command timeout has done so too, and then the layer goes on from zero.
"""

from __future__ import annotations

import math

from .safety import SafetyLayer, State
from .safety.senders import StreamWatch
from .safety.starting import Starting
from .stall import StallGuard

__all__ = ["SafeControl"]

_NS = 1e9
_UNTIMELY = {"too old", "from the future", "not finite"}  # refused references whose stamps tell nothing


class SafeControl(Starting):
    """Controller and safety layer of one axis.

    Args:
        guard: the controller with its reference.
        layer: what its force passes.
        wait: without a joint state for so long :meth:`idle` steps the layer [s].
        enabled: enable once, as soon as there are joint states to rely on.
    """

    def __init__(self, guard: StallGuard, layer: SafetyLayer, wait: float, enabled: bool) -> None:
        super().__init__(layer, enabled)
        self.guard = guard
        self._wait = round(_NS * wait)
        self._stepped: int | None = None
        self._sent = 0.0
        self._senders = StreamWatch(round(_NS * guard.period))

    def reference(self, now: int, stamp: int, position: float, velocity: float, acceleration: float) -> str:
        """Take in a reference; why it is refused, or an empty text. Arguments as of :meth:`ReferenceGuard.take`."""
        why = self.guard.references.take(now, stamp, position, velocity, acceleration)
        if why not in _UNTIMELY:
            self._senders.value(stamp)
        return why

    def referees(self, now: int, count: int) -> None:
        """So many publishers of references are known; more than one at work is a fault."""
        if self._senders.many(count):
            self.layer.fail("second reference source", f"{count} publishers, more references than one sends", now)

    def enable(self, now: int) -> None:
        """As of :class:`Starting`; the controller starts anew."""
        super().enable(now)
        self.guard.restart()

    def answer(self, now: int, stamp: int, position: float, feedforward: float = 0.0, acting: float = 0.0) -> float | None:
        """The force [F] to be sent for a joint state; None: none. Arguments as of :meth:`StallGuard.answer`."""
        layer = self.layer
        self._let_go(now)
        wanted = None
        if layer.reading(now, stamp, position):
            self._start(now)
            if self._starts or layer.resuming or layer.state is State.ENABLED:
                most = layer.limits.force
                wanted = self.guard.answer(now, stamp, position, feedforward, min(max(acting, -most), most))
            else:
                self.guard.restart()
        if wanted is not None:
            layer.command(now, now, wanted)
        return self._given(now, wanted is not None)

    def idle(self, now: int) -> float | None:
        """Called now and then: the force to be sent [F] when no joint state has come for a while; None: none."""
        if self._stepped is None or now - self._stepped < self._wait:
            return None
        self._let_go(now)
        return self._given(now, False)

    def _let_go(self, now: int) -> None:
        """Go on from zero where nobody has been sent a force for so long that it acts no more."""
        if self._stepped is not None and now - self._stepped > _NS * self.layer.limits.command_timeout:
            self.layer.cut(now)

    def _given(self, now: int, answered: bool) -> float | None:
        layer = self.layer
        force = layer.step(now, self.guard.references.position if answered else math.nan)
        self._stepped = now
        if layer.state is State.ENABLED and not answered:
            return None
        if layer.state is not State.ENABLED and force == 0.0 and self._sent == 0.0:
            return None
        self._sent = force
        return force
