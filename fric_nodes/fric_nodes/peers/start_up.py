"""Start-up of the command line beside that of numpy: ``fric --help`` against ``python -c "import numpy"``."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from fric.bench.peer import Pair, Peer

__all__ = ["PEER"]

_TURNS = 25


def _spent(command: Sequence[str]) -> float:
    begun = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begun


def prepare(_: Path) -> Sequence[Pair]:
    """One pair; both with this interpreter."""
    script = Path(sys.executable).with_name("fric")
    start = ["import fric_nodes.cli.main as it; it.main()", "--help"]
    ours = [str(script), "--help"] if script.is_file() else [sys.executable, "-c", *start]
    numpy = [sys.executable, "-c", "import numpy"]
    return (Pair("start-up, fric --help against import numpy", lambda: _spent(ours), lambda: _spent(numpy), "<= 1.3", _TURNS),)


PEER = Peer("start-up", prepare)
