"""Where the files are that come with fric: configuration and example recordings."""

from __future__ import annotations

import sys
from pathlib import Path

from .errors import InputError

__all__ = ["config_file"]


def config_file(name: str) -> Path:
    """The file ``name`` of ``config/``: as installed under the environment's prefix, or in the source tree.

    Raises:
        InputError: it is in neither place.
    """
    places = [
        Path(sys.prefix) / "share" / "fric_nodes" / "config",
        # In a colcon workspace the package lies in <prefix>/lib/pythonX.Y/site-packages.
        *(parent / "share" / "fric_nodes" / "config" for parent in Path(__file__).resolve().parents[:6]),
        Path(__file__).resolve().parents[2] / "config",
    ]
    for place in places:
        if (place / name).is_file():
            return place / name
    raise InputError(name, "does not come with this installation", "install fric again, or run from its source tree")
