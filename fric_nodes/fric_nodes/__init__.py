"""The ROS 2 shell of the library :mod:`fric`: its nodes, and the command ``fric``."""

from __future__ import annotations

from fric import __version__

__all__ = ["__version__"]
