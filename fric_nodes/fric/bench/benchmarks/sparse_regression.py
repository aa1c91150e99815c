"""The diagnosis beside sparse regression, on the cases of one examination (:mod:`..sparse_regression`)."""

from __future__ import annotations

import importlib.util
import math
import sys
import tempfile
from functools import partial
from pathlib import Path

from ...diagnosis.prove.candidate import DIAGNOSE
from ...diagnosis.prove.examination import hold
from ...figure import Figure
from ..benchmark import Benchmark
from ..sparse_regression import ENTRIES

__all__ = ["BENCHMARK"]

_CASES = 40
_SEED = 20261202
_SHOWN = (
    "single effects of moderate strength, named first",
    "weak single effects, named first",
    "pairs, both named",
    "single effects with further findings",
    "nothing missing, but something found (false alarms)",
    "outside the vocabulary, said to be unknown, at the right place",
    "time of a diagnosis, median",
)


def run(cases: int = _CASES) -> list[Figure]:
    """The rates of each way, the diagnosis first; all are given the same recordings."""
    absent = [name for name in ("pysindy", "sklearn") if importlib.util.find_spec(name) is None]
    if absent:
        why = f"{' and '.join(absent)} not installed (pip install 'fric[peers]')"
        return [Figure("the diagnosis beside sparse regression", math.nan, "1", skipped=why)]
    figures, keys = [], set()
    with tempfile.TemporaryDirectory(prefix="fric-exam-") as folder:
        for number, (who, entry) in enumerate({"fric": DIAGNOSE, **ENTRIES}.items()):
            out = Path(folder) / str(number)
            held = hold(cases, _SEED, out, entry=entry, progress=partial(_tell, who))
            keys.add(held.hash_of_key)
            for each in held.score.figures:
                if each.name in _SHOWN:
                    rate = held.score.rates.get(each.name)
                    of = "" if rate is None else f" ({rate.hits} of {rate.of})"
                    figures.append(Figure(f"{who}: {each.name}{of}", each.value, each.unit))
    return [*figures, Figure("examinations that were the same, by the hash of their keys", float(len(keys)), "", "== 1")]


def _tell(who: str, line: str) -> None:
    sys.stderr.write(f"{who}: {line}\n")


BENCHMARK = Benchmark(
    "sparse-regression", "the diagnosis beside PySINDy and the lasso", run, long=True, sized=run, size="cases"
)
