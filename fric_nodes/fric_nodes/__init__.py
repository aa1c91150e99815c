"""Friction of mechanical axes: recorded, identified, compensated and diagnosed, over ROS 2 and offline.

The package imports no ROS outside `fric_nodes.nodes`; everything else works on arrays, files and recordings.
"""

from __future__ import annotations

__version__ = "0.1.0"
