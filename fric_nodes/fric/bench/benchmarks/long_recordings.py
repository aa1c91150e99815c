"""Recordings of hours at 1 kHz, identified in pieces of 10 min: memory, how the time grows, and what is found.

Each recording is written without ever being whole in memory, and identified by the same code as ``fric identify --pieces``, in
a process of its own whose largest resident memory the system tells. Times are those of reading and fitting, without the start
of the process. The exponent b of time = c length^b is the slope of the logarithms of the processor's time, which other work on
the machine hardly changes, with Student's interval of their line. A short recording identified as a whole tells what a
sample takes then.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import linregress
from scipy.stats import t as student

from ...figure import Figure
from ..benchmark import Benchmark
from ..long_recordings import DRIFT, true_values, write_long_recording

__all__ = ["BENCHMARK"]

_HOURS = (0.5, 1.0, 2.0, 4.0)  # [h]
_PIECE = 600.0  # [s]
_WHOLE = (0.05, 0.2)  # [h] identified as a whole
_TIME_LIMIT = 48 * 3600.0  # [s]
_CODE = """
import json, resource, sys, time
from pathlib import Path
from fric.bagio import pieces, read_record
from fric.facade.structure import to_fit
from fric.identification.choice import method_for
from fric.identification.piecewise import identified_piecewise
from fric.identification.workflow import identified

def structure(record):
    return to_fit("coulomb,viscous,bias", record.joint, record.units)

path, seconds = Path(sys.argv[1]), float(sys.argv[2])
start, worked = time.perf_counter(), time.process_time()
found = {}
if seconds:
    done = identified_piecewise(
        pieces(path, seconds), structure, lambda model: method_for(None, model), lambda method: method.settings()
    )
    found = {each.name: (each.value, each.half, each.drift, each.drift_half) for each in done.combined}
    found["used"] = len(done.used) / len(done.rows)
else:
    record = read_record(path)
    identified(structure(record), [record], experiments=False)
found["time"], found["worked"] = time.perf_counter() - start, time.process_time() - worked
found["memory"] = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(json.dumps(found))
"""


def identified_apart(path: Path, seconds: float) -> dict[str, Any]:
    """What a process of its own finds in pieces of so many seconds, or with 0 as a whole; its times [s] and memory [byte]."""
    command = [sys.executable, "-c", _CODE, str(path), str(seconds)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=_TIME_LIMIT, check=False)
    if done.returncode:
        raise RuntimeError(f"{path.name}: status {done.returncode}: {done.stderr[-500:]}")
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def _measured(folder: Path, hours: float, seconds: float) -> dict[str, Any]:
    path = write_long_recording(folder / f"h{hours:g}", hours)
    found = identified_apart(path, seconds)
    for file in path.iterdir():
        file.unlink()
    return found


def _growth(hours: Sequence[float], times: Sequence[float]) -> tuple[float, float]:
    """Exponent with which the time grows, and half its 95 % interval; NaN with fewer than three lengths."""
    if len(hours) < 3:
        return math.nan, math.nan
    line = linregress(np.log(hours), np.log(times))
    return float(line.slope), float(line.stderr * student.ppf(0.975, len(hours) - 2))


def figures(hours: Sequence[float], folder: Path) -> list[Figure]:
    """Figures of recordings of these lengths [h], written below ``folder`` one after the other."""
    found = {each: _measured(folder, each, _PIECE) for each in hours}
    few, many = (_measured(folder, each, 0.0)["memory"] for each in _WHOLE)
    made = [Figure(f"{each:g} h: time", found[each]["time"], "s") for each in hours]
    made += [Figure(f"{each:g} h: time of the processor", found[each]["worked"], "s") for each in hours]
    made += [Figure(f"{each:g} h: largest memory", found[each]["memory"] / 1e9, "GB", "<= 2") for each in hours]
    slope, half = _growth(hours, [found[each]["worked"] for each in hours])
    if math.isfinite(slope):
        # 1 within its interval: the time grows as the length.
        made.append(Figure(f"time grows with this power of the length, +-{half:.2g}", slope, "1"))
        made.append(Figure("distance of this power from 1, in half intervals", abs(slope - 1.0) / half, "1", "<= 1"))
    longest = max(hours)
    last, true = found[longest], true_values(longest)
    for name, value in true.items():
        made.append(Figure(f"{longest:g} h: error of {name}", 100.0 * abs(last[name][0] / value - 1.0), "%", "<= 1"))
    _, _, drift, drift_half = last["viscous.coefficient"]
    made += [
        Figure(f"{longest:g} h: drift of viscous.coefficient, +-{drift_half:.2g}, true {DRIFT:g}", drift, "N s/m per h"),
        Figure(f"{longest:g} h: pieces used", 100.0 * last["used"], "%", "== 100"),
        Figure("a sample identified as a whole", (many - few) / (3.6e6 * (_WHOLE[1] - _WHOLE[0])), "byte"),
    ]
    return made


def _run() -> list[Figure]:
    with tempfile.TemporaryDirectory(prefix="fric-long-") as folder:
        return figures(_HOURS, Path(folder))


def _of_length(hours: int) -> list[Figure]:
    with tempfile.TemporaryDirectory(prefix="fric-long-") as folder:
        return figures((float(hours),), Path(folder))


BENCHMARK = Benchmark("long-recordings", "recordings of hours, in pieces", _run, long=True, sized=_of_length, size="hours")
