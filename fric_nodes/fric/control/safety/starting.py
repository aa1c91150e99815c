"""How a safety layer comes to be enabled: on request, or once by itself as soon as it has what it relies on."""

from __future__ import annotations

from .layer import SafetyLayer
from .limits import SafetyError

__all__ = ["Starting"]


class Starting:
    """What stands behind a safety layer, which is enabled on request or once by itself.

    Args:
        layer: of the axis.
        enabled: enable it once, as soon as it lets itself be enabled.

    Attributes:
        layer: the safety layer.
    """

    def __init__(self, layer: SafetyLayer, enabled: bool) -> None:
        self.layer = layer
        self._starts = enabled

    def enable(self, now: int) -> None:
        """Let forces through from ``now`` [ns] on.

        Raises:
            SafetyError: as of the layer.
        """
        self.layer.enable(now)
        self._starts = False

    def begin(self, enabled: bool) -> None:
        """Go on after :meth:`disable`: enable once by itself, if that is wanted."""
        self._starts = enabled

    def disable(self, now: int) -> None:
        """Stop the axis, let no force through from ``now`` [ns] on, and don't enable by itself any more."""
        self._starts = False
        self.layer.disable(now)

    def _start(self, now: int, keep: bool = False) -> None:
        """Enable if that is wanted and the layer has readings to rely on; a fault ends the wait. ``keep`` as of the layer."""
        if not self._starts:
            return
        try:
            self.layer.enable(now, keep)
        except SafetyError:
            self._starts = not self.layer.faults
        else:
            self._starts = False
