"""Friction of mechanical axes: recorded, simulated, identified and diagnosed; on arrays and recordings, without ROS."""

from __future__ import annotations

__version__ = "0.1.0"
