"""A safety layer as a node shows it: its requests as services, its state on ``/diagnostics``, its events in the log."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

from diagnostic_msgs.msg import DiagnosticStatus
from fric.control.safety import SafetyError, SafetyLayer

from .managed import ManagedNode
from .triggers import add_triggers

__all__ = ["SafetyPanel"]

_OVER = 1.0  # physical scale: [s] without another one, after which something is over
_COUNTED = ("reached", "left")  # ends of events that come again and again, and are counted


class SafetyPanel:
    """Offers ``~/enable``, ``~/disable`` and ``~/reset_fault``.

    Args:
        node: its counters become the layer's.
        layer: of the axis.
        now: the time of the layer [ns].
        enable: what is asked; the layer's own when None.
        disable: the same.
    """

    def __init__(
        self,
        node: ManagedNode,
        layer: SafetyLayer,
        now: Callable[[], int],
        enable: Callable[[int], None] | None = None,
        disable: Callable[[int], None] | None = None,
    ) -> None:
        self._node = node
        self._layer = layer
        self._now = now
        self._before: Counter[str] = Counter(node.counters)
        self._total = sum(node.counters.values())
        self._lasting: dict[str, float] = {}  # what goes on, and when it was last counted [s]
        layer.counters = node.counters
        requests = {"enable": enable or layer.enable, "disable": disable or layer.disable, "reset_fault": layer.reset}
        add_triggers(node, {name: self._at_once(name, act) for name, act in requests.items()})

    def _at_once(self, name: str, act: Callable[[int], None]) -> Callable[[], str]:
        """``act`` at the present time; then the state of the layer."""

        def acted() -> str:
            if name == "enable" and not self._node.active:
                raise SafetyError("safety", "the node is inactive", "activate it first")
            act(self._now())
            self.log()
            return self._layer.state.value

        return acted

    def log(self) -> None:
        """Say what has happened since the last time; of what is counted again and again, the beginning and the end."""
        logger = self._node.get_logger()
        for event in self._layer.events():
            if event.text.startswith("fault:"):
                logger.error(event.text)
            elif not event.text.endswith(_COUNTED):
                logger.info(event.text)
        counters, now = self._node.counters, time.monotonic()
        total = sum(counters.values())
        if total != self._total:
            for name, count in counters.items():
                if count > self._before[name] and not name.startswith(("fault:", "stops")):
                    if name not in self._lasting:
                        logger.warning(name)
                    self._lasting[name] = now
            self._total, self._before = total, Counter(counters)
        elif self._lasting:
            for name in [name for name, last in self._lasting.items() if now - last > _OVER]:
                del self._lasting[name]
                logger.info(f"over: {name}")

    def condition(self) -> Mapping[str, str]:
        """State, faults and counters."""
        return self._layer.condition()

    def verdict(self, troubles: Sequence[str], *others: str) -> tuple[bytes, str]:
        """Level and text of a report: faults first, then ``others`` that are as grave, then what hinders or was refused."""
        layer = self._layer
        said = [f"{name} ({detail})" for name, detail in layer.faults.items()] + list(others)
        level = DiagnosticStatus.ERROR if said else DiagnosticStatus.WARN if troubles else DiagnosticStatus.OK
        return level, "; ".join([layer.state.value, *said, *troubles])
