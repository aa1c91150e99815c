"""Online estimators side by side: time to follow a step of friction, wandering at rest, time per sample, coverage.

The axis follows a multisine under a PD law that reads its quantised position; the recorded force has noise that never
acted. For the step its Coulomb friction changes from one sample to the next; for the rest it stands for ten minutes while
the drive pushes below break-away and the encoder flickers by a count. Intervals are counted over 200 recordings of
:mod:`fric.identification.calibration`, each from its first sample to its last; takes several minutes.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from ...figure import Figure
from ...identification.calibration import AXES, recording
from ...identification.online import ESTIMATORS, make_estimator
from ...identification.online.trials import Moved, feed, follow, made, moved, wander
from ..benchmark import Benchmark
from ..trials import Finding, count, figures_of

__all__ = ["BENCHMARK"]

# None of these recordings was looked at while the estimators were made.
_SEEDS = range(31_000, 31_200)


def _microseconds(kind: str) -> float:
    """Of one sample at 1 kHz, once the estimator is under way."""
    axis = AXES["rigid"]
    run = moved(axis, [(25.0, axis.truth)], 3)
    estimator = made(kind, axis)
    half = run.time.size // 2
    feed(estimator, Moved(run.time[:half], run.position[:half], run.force[:half]))
    start = time.perf_counter()
    feed(estimator, Moved(run.time[half:], run.position[half:], run.force[half:]))
    return 1e6 * (time.perf_counter() - start) / (run.time.size - half)


@dataclass(frozen=True)
class _Trial:
    """An estimator over one recording of an axis."""

    kind: str
    axis: str

    def __call__(self, seed: int) -> Finding:
        axis = AXES[self.axis]
        record = recording(axis, seed)
        # Bristles can't be told from nothing: they start half as stiff again, and as damped.
        near = {p.name: 1.5 * p.value for p in axis.truth.parameters() if p.name.startswith("presliding")}
        start = axis.start
        for name, value in near.items():
            start = start.with_value(name, value)
        estimator = make_estimator(self.kind, start, hold="following")
        feed(estimator, Moved(record.time, record.position, record.effort))
        found = estimator.estimate()
        rows = zip(found.names, found.values.tolist(), found.standard_errors.tolist(), strict=True)
        return {name: (value - axis.truth.value(name), error) for name, value, error in rows}


def run() -> list[Figure]:
    """Figures per estimator."""
    figures: list[Figure] = []
    for kind in ESTIMATORS:
        for factor in (1.5, 0.7):
            settled = max(follow(kind, factor, seed).settled for seed in range(4))
            figures.append(Figure(f"{kind}: Coulomb friction times {factor}, within 5 %, slowest of 4", settled, "s", "<= 3"))
        found = wander(kind)
        figures += [
            Figure(f"{kind}: 10 min at rest, largest change in standard errors", found.errors, "1", "<= 0.5"),
            Figure(f"{kind}: 10 min at rest, largest change of a value", found.share, "1", "<= 0.01"),
            Figure(f"{kind}: 10 min at rest, growth of a standard error", found.widened, "1", "<= 0.1"),
            Figure(f"{kind}: one sample", _microseconds(kind), "us", "<= 200"),
        ]
    for kind, axis in (("rls", "rigid"), ("ekf", "rigid"), ("ukf", "rigid"), ("ekf", "bristled"), ("ukf", "bristled")):
        calibration, refused = count(_Trial(kind, axis), _SEEDS)
        figures += figures_of(f"{kind}, {axis} axis", calibration, refused)
    return figures


BENCHMARK = Benchmark("online", "online estimators side by side", run, long=True)
