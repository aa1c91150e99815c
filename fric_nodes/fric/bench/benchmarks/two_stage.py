"""Two-stage identification of a DNLRX on 60 s at 1 kHz: a guideway that wanders from nanometres to sliding."""

from __future__ import annotations

import time

import numpy as np

from ...figure import Figure
from ...identification.dnlrx.cost import Cost
from ...identification.dnlrx.fit import DECIMATION, DnlrxFit, fit_dnlrx
from ...identification.dnlrx.linear import rows_of
from ...record import Record
from ...verification.amthor_guideway import recorded, wandering
from ..benchmark import Benchmark

__all__ = ["BENCHMARK"]

_ORDERS = ((5, 0, 3), (5, 3, 3), (10, 0, 3))
_KEEP = 6  # of a controller at 6 kHz
_N_SAMPLES = 60_000
_TRIALS = 20


def _recording() -> Record:
    step = 1e-3 / _KEEP
    wanted = wandering(5, turns=500, sample_time=step)[: _N_SAMPLES * _KEEP]
    return recorded(wanted, 2, sample_time=step, keep=_KEEP)


def _time(record: Record, order: tuple[int, int, int] | None) -> tuple[float, DnlrxFit]:
    start = time.perf_counter()
    fit = fit_dnlrx([record], order)
    return time.perf_counter() - start, fit


def _ratio(fit: DnlrxFit) -> float:
    """Time of a trial over every sample, over that of a trial over every hundredth; measured in turn, best of several."""
    parts, order = fit.prepared.parts, fit.model.order
    costs = [Cost(parts, order, rows_of(parts, order, every)) for every in (1, DECIMATION)]
    trials = np.tile(fit.model.thresholds, (_TRIALS, 1))
    best = [np.inf, np.inf]
    for _ in range(5):
        for k, cost in enumerate(costs):
            start = time.perf_counter()
            cost.many(trials)
            best[k] = min(best[k], time.perf_counter() - start)
    return best[0] / best[1]


def run() -> list[Figure]:
    """Times after compilation."""
    record = _recording()
    assert record.n_samples >= _N_SAMPLES - _KEEP
    fit_dnlrx([record.slice(0, 10_000)], (2, 1, 2))
    figures = []
    for order in _ORDERS:
        spent, fit = _time(record, order)
        label = f"two-stage, ({','.join(map(str, order))}), {record.n_samples} samples"
        figures += [Figure(label, spent, "s", "<= 20"), Figure("its NOE", fit.noe, "%")]
        if order == _ORDERS[0]:
            figures.append(Figure("a trial over every sample, over one over every 100th", _ratio(fit), "1", ">= 30"))
    spent, fit = _time(record, None)
    figures += [Figure("two-stage with its order chosen as well", spent, "s", "<= 20"), Figure("its NOE", fit.noe, "%")]
    return figures


BENCHMARK = Benchmark("two-stage", "two-stage identification", run)
