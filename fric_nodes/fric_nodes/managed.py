"""Managed nodes of ROS 2: configure, activate, deactivate, clean up, shut down, by the services of ``rclpy.lifecycle``.

A node is made at *configure*, from its parameters: files are read there, and topics, services and timers come into being. From
*activate* on it has an effect. With ``autostart`` both come at the start. A parameter that can't be used makes *configure*
fail, with one line in the log; the node then stays unconfigured. *Clean up* takes away what configure made. *Shut down* ends
the process with status 0.
"""

from __future__ import annotations

import traceback
from collections.abc import Mapping, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from fric.errors import InputError
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from rclpy.lifecycle.node import LifecycleNodeMixin

from .loop import LoopNode
from .parameters import NodeParameter

__all__ = ["ManagedNode"]

_AUTOSTART = NodeParameter("autostart", True, "configure and activate at the start; otherwise by the lifecycle services")
_KINDS = ("timers", "subscriptions", "publishers", "services", "clients")


class ManagedNode(LifecycleNodeMixin, LoopNode):
    """A node of the loop with a life cycle.

    Args:
        name: of the node.
        declarations: its parameters besides the common ones.
        options: as for :class:`LoopNode`.

    Attributes:
        configured: True from configure to clean up.
        active: True from activate to deactivate.

    Raises:
        InputError: a parameter can't be used, and the node is to start at once.
    """

    def __init__(self, name: str, declarations: Sequence[NodeParameter], **options: Any) -> None:
        self.configured = self.active = False
        LoopNode.__init__(self, name, (*declarations, _AUTOSTART), **options)
        LifecycleNodeMixin.__init__(self)
        self._failure: Exception | None = None
        self._before: dict[str, list[Any]] = {}
        if self.settings.flag(_AUTOSTART.name):
            self._start()

    def _start(self) -> None:
        for trigger in (self.trigger_configure, self.trigger_activate):
            trigger()
            if self._failure is not None:
                raise self._failure

    # What a node does

    def configure(self) -> None:
        """Make everything from the parameters.

        Raises:
            InputError: a parameter can't be used.
        """

    def activate(self) -> None:
        """Begin to have an effect.

        Raises:
            InputError: that isn't possible.
        """

    def deactivate(self) -> None:
        """Have no effect any more; an axis in motion is stopped within its limits."""

    def release(self) -> None:
        """Let go of what isn't a topic, service or timer of the node."""

    def state_of(self) -> Mapping[str, object]:
        """What the node adds to its report while it is configured."""
        return {}

    def judgement(self, troubles: Sequence[str]) -> tuple[bytes, str]:
        """Level and text of the report while the node is active; see :meth:`FricNode.verdict`."""
        return super().verdict(troubles)

    # The transitions

    def on_configure(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Make the node."""
        self._before = {kind: list(getattr(self, kind)) for kind in _KINDS}
        self._listeners = self.settings.listeners
        done = self._attempted(self.configure)
        self.configured = done is TransitionCallbackReturn.SUCCESS
        if self.configured:
            super().introduce()
        else:
            self._take_away()
        return done

    def on_activate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Let it have an effect."""
        done = self._attempted(self.activate)
        self.active = done is TransitionCallbackReturn.SUCCESS
        return done

    def on_deactivate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Let it have none."""
        self.active = False
        return self._attempted(self.deactivate)

    def on_cleanup(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Take away what configure made."""
        return self._attempted(self._clean)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End the process."""
        self.finish()
        return self.on_cleanup(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start anew after a fault of the program."""
        return self.on_cleanup(state)

    def _attempted(self, act: Any) -> TransitionCallbackReturn:
        """What ``act`` comes to; rclpy would drop its exception without a word."""
        self._failure = None
        try:
            act()
        except InputError as error:
            self._failure = error
            if not self.settings.flag(_AUTOSTART.name) or self.configured:
                self.get_logger().error(" ".join(str(error).split()))
            return TransitionCallbackReturn.FAILURE
        except Exception as error:
            self._failure = error
            self.get_logger().error(traceback.format_exc())
            return TransitionCallbackReturn.ERROR
        return TransitionCallbackReturn.SUCCESS

    def _clean(self) -> None:
        if self.configured:
            self.active = self.configured = False
            self.release()
            self._take_away()

    def _take_away(self) -> None:
        for kind in _KINDS:
            for made in [each for each in getattr(self, kind) if each not in self._before[kind]]:
                getattr(self, f"destroy_{kind.removesuffix('s')}")(made)
        self.settings.listeners = self._listeners
        self.start_anew()

    # What the base asks

    def introduce(self) -> None:
        """Configure has said it."""

    def close(self) -> None:
        """Let go."""
        if self.configured:
            self.release()

    def condition(self) -> Mapping[str, object]:
        """Where the node is in its life, and what it adds itself."""
        stage = "active" if self.active else "inactive" if self.configured else "unconfigured"
        return {"lifecycle": stage, **(self.state_of() if self.configured else {})}

    def verdict(self, troubles: Sequence[str]) -> tuple[bytes, str]:
        """Level and text of the report."""
        if not self.configured:
            return DiagnosticStatus.OK, "unconfigured"
        level, text = self.judgement(troubles)
        return level, text if self.active else f"inactive; {text}"
