"""The fault table: each fault of a wire, at random moments of a moving axis, and what it did to the axis.

Each is injected into the simulated plant and into the serial drive with its emulator on a pseudo-terminal, in library time. A
sample is unsafe when force, force rate, true speed or true position is out of its limit at the drive.
"""

from __future__ import annotations

import tempfile
import zlib
from pathlib import Path

import numpy as np

from ...figure import Figure
from ..benchmark import Benchmark
from ..fault_rig import FaultRig, Outcome
from ..faults import FAULTS, Fault, inject

__all__ = ["BENCHMARK", "trial"]

_TIMES = 20  # statistical: with none of 20 unsafe, fewer than 14 % of such faults are, at 95 % confidence; of all, 0.3 %


def trial(name: str, fault: Fault, number: int, port: Path | None) -> tuple[Outcome, bool, bool]:
    """One injection of ``fault``: what was counted, if its cause was named, and if the axis moved again.

    The same numbers give the same trial.
    """
    random = np.random.default_rng([zlib.crc32(name.encode()), number, port is not None])
    rig = FaultRig(port, random)
    try:
        return rig.outcome, *inject(rig, fault, random)
    finally:
        rig.close()


def run() -> list[Figure]:
    """Unsafe samples of each fault, and shares over all."""
    figures: list[Figure] = []
    samples = unsafe = injected = named = slow = moved = 0
    with tempfile.TemporaryDirectory() as folder:
        for name, fault in FAULTS.items():
            bad = 0
            for port in (Path(folder) / "drive", None):
                if port is None and fault.serial_only:
                    continue
                for number in range(_TIMES):
                    outcome, known, moves = trial(name, fault, number, port)
                    samples, bad = samples + outcome.samples, bad + outcome.unsafe
                    injected, named, slow = injected + 1, named + known, slow + (not outcome.stopped)
                    moved += moves
            unsafe += bad
            figures.append(Figure(name, bad, "unsafe samples", "== 0"))
    return [
        *figures,
        Figure(f"all, of {samples} samples", unsafe, "unsafe samples", "== 0"),
        Figure(f"cause named, of {injected} faults", 100.0 * named / injected, "%", ">= 99"),
        Figure("stops longer than stated", slow, "1", "== 0"),
        Figure("axis moves again", 100.0 * moved / injected, "%", "== 100"),
    ]


BENCHMARK = Benchmark("faults", "faults injected into a moving axis", run, long=True)
