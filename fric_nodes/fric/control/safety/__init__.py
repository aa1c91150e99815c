"""The safety layer in front of every force that leaves the controller: limits, plausibility, states, and the controlled stop.

The layer stands between whoever wants a force and the drive. What it knows of the axis are bounds: the least and the largest
inertia, the largest friction and the largest load. From these follow how fast the axis can be stopped, and which motion a force
can't have made.
"""

from __future__ import annotations

from .layer import SafetyLayer, State
from .limits import Limits, SafetyError
from .stopping import Stop, stop_from

__all__ = ["Limits", "SafetyError", "SafetyLayer", "State", "Stop", "stop_from"]
