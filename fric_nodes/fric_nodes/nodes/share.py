"""Files that come with the package: under ``share/fric_nodes`` of the installation, or in the source tree."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

from ..errors import InputError

__all__ = ["share_file"]


def share_file(name: str) -> Path:
    """Path of the file ``name``, such as ``config/demo_axis.yaml``.

    Raises:
        InputError: neither place has it.
    """
    installed = Path(sys.prefix) / "share" / "fric_nodes"
    places = [installed, Path(__file__).resolve().parents[3]]
    with contextlib.suppress(PackageNotFoundError, OSError):  # an installation by pip sets no AMENT_PREFIX_PATH, and needs none
        places.insert(0, Path(get_package_share_directory("fric_nodes")))
    for place in places:
        if (place / name).is_file():
            return place / name
    raise InputError(name, "is not installed", "give a path of your own, or install the package again")
