"""Files ``.axislog``: three numbers a line."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from fric.importers.table import Importer, Source, Table, TextOptions


def read(path: Path, options: TextOptions, wanted: Sequence[Source]) -> Table:
    table = Table(path)
    for name, column in zip("tqu", np.loadtxt(path).T, strict=True):
        table.add(name, column)
    return table


IMPORTER = Importer("axis log", (".axislog",), read)
