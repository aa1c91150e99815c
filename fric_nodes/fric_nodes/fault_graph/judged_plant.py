"""The node ``plant`` that writes down what reaches its drive, for a judge who isn't part of it.

Each entry is written at once, so that it is there when the process is killed: time [ns], force [N], true position [m], and the
number of the layer's state.
"""

from __future__ import annotations

import os
import struct
from functools import partial
from pathlib import Path
from typing import Any

from fric.control.safety import State

from ..nodes.plant import PlantNode
from ..run import run

__all__ = ["ENTRY", "FOLDER", "JudgedPlantNode", "main"]

ENTRY = struct.Struct("<qddq")
FOLDER = "FRIC_JUDGED_PLANT"
"""Environment variable that names the folder of the records, one for each process."""
_NUMBERS = {state: number for number, state in enumerate(State)}


class JudgedPlantNode(PlantNode):
    """The plant; options as for ``rclpy.node.Node``.

    Raises:
        InputError: a parameter can't be used.
    """

    def __init__(self, **options: Any) -> None:
        self._file = os.open(Path(os.environ[FOLDER]) / f"{os.getpid()}.drive", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        super().__init__(**options)

    def configure(self) -> None:
        """As the plant, with a witness of its drive."""
        super().configure()
        assert self._in_time is not None
        self._in_time.drive.witness = self._write

    def _write(self, now: int, force: float, position: float, state: State) -> None:
        os.write(self._file, ENTRY.pack(now, force, position, _NUMBERS[state]))


main = partial(run, JudgedPlantNode)
"""Serve the node until a signal comes."""

if __name__ == "__main__":
    main()
