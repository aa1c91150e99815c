"""Methods of friction compensation on axes that are recorded, identified and tuned anew for each seed.

See :mod:`fric.bench.compensation`. ``fric compete`` prints the whole table; here are the figures that have a goal. Takes
minutes.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence

import numpy as np

from ...control.feedbacks.friction_observer import Bristles
from ...control.feedforward import Feedforward
from ...control.feedforwards.dnlrx import DnlrxForce
from ...control.many import ManyDnlrx, ManyLugre
from ...control.trial import sine
from ...figure import Figure
from ...friction.dnlrx import from_mechanics
from ...model import build_model, term
from ...record import Array
from ..benchmark import Benchmark
from ..compensation.competition import Cell, compete, interval

__all__ = ["BENCHMARK", "figures_of", "run", "step_times"]

SEEDS = range(50_001, 50_003)
"""Of the figures; the methods were made on seeds 1 to 4."""

_GOALS = {
    # What a good model does against what is in use: factor of the peak at reversals.
    ("slide", "pid + pre-sliding model", "pid + velocity"): ">= 20",
    ("slide", "pid + pre-sliding model", "pid + table"): ">= 5",
    ("slide", "pid + pre-sliding model", "pid + pulse"): ">= 5",
}
_REPEATS = 20_000  # numerical: steps that a time is taken over
_JOINTS = 100
_MICROSECONDS, _MILLISECOND = "<= 10", "<= 1000"


def _ratio(cells: dict[tuple[str, str], Cell], axis: str, better: str, worse: str, name: str) -> Array:
    top, bottom = cells.get((axis, worse)), cells.get((axis, better))
    if top is None or bottom is None:
        return np.array([math.nan])
    return np.asarray(top.values(name) / bottom.values(name))


def figures_of(cells: Sequence[Cell]) -> list[Figure]:
    """Figures of a comparison."""
    by_name = {(cell.axis, cell.method): cell for cell in cells}
    figures = []
    for (axis, better, worse), goal in _GOALS.items():
        if (axis, better) in by_name and (axis, worse) in by_name:
            middle, low, high = interval(_ratio(by_name, axis, better, worse, "peak"))
            title = f"{axis}: peak at reversals, {worse} over {better}"
            figures += [Figure(title, middle, "1", goal), Figure(f"{title}, interval from", low, "1")]
            figures.append(Figure(f"{title}, to", high, "1"))
    for cell in cells:
        rms = cell.values("rms")
        title = f"{cell.axis}: {cell.method}"
        figures += [
            Figure(f"{title}: tracking RMS", float(np.median(rms)), "x"),
            Figure(f"{title}: largest over smallest of the seeds", float(np.max(rms) / np.min(rms)), "1"),
            Figure(f"{title}: peak at reversals", float(np.median(cell.values("peak"))), "x"),
            Figure(f"{title}: command RMS", float(np.median(cell.values("force"))), "F"),
        ]
    return figures


def step_times() -> list[Figure]:
    """Time of one step of a compensator, for one axis in Python, and for a hundred in one call."""
    model = build_model(
        "rigid",
        {"mass": 2.0},
        [
            term("coulomb", force=6.0),
            term("viscous", coefficient=20.0),
            term("presliding", "lugre", stiffness=1e5, damping=100.0),
        ],
    )
    forward = Feedforward(1e-3, transition_time=0.0)
    forward.set_model(model, at_once=True)
    dnlrx = DnlrxForce(from_mechanics(2.0, 20.0, 0.0, [1e4] * 10, (1e-6 * np.arange(1, 11)).tolist(), 1e-3, order=3), 1e-3)
    motion = sine(1e-3, 0.05, 0.7, 1e-3 * _REPEATS)
    rows = np.stack([motion.time, motion.position, motion.velocity, motion.acceleration], axis=1).tolist()
    figures = []
    for title, force in (("LuGre", forward), ("DNLRX (10,0,3)", dnlrx)):
        force.step(-1e-3, 0.0, 0.0, 0.0)
        start = time.process_time()
        for row in rows:
            force.step(*row)
        spent = 1e6 * (time.process_time() - start) / _REPEATS
        figures.append(Figure(f"step of the {title} compensator", spent, "us", _MICROSECONDS))
    return [*figures, *_many(rows)]


def _many(rows: list[list[float]]) -> list[Figure]:
    """A hundred joints in one call, of which a thousand a second have to be made."""
    n, springs, thresholds = _JOINTS, [1e4] * 10, (1e-6 * np.arange(1, 11)).tolist()
    lugre = ManyLugre([Bristles(6.0, 7.0, 1e-2, 1e5, 100.0)] * n, np.full(n, 2.0), np.full(n, 20.0), 1e-3)
    dnlrx = ManyDnlrx([from_mechanics(2.0, 20.0, 0.0, springs, thresholds, 1e-3, order=3)] * n, np.zeros(n))
    each = np.linspace(0.5, 1.0, n)
    motion = np.array(rows[: _REPEATS // 10])[:, :, None] * each
    steps: dict[str, Callable[[Array], Array]] = {
        "LuGre": lambda row: lugre.step(row[2], row[3]),
        "DNLRX (10,0,3)": lambda row: dnlrx.step(row[1]),
    }
    figures = []
    for title, step in steps.items():
        start = time.process_time()
        for row in motion:
            step(row)
        spent = 1e6 * (time.process_time() - start) / motion.shape[0]
        figures.append(Figure(f"step of {n} {title} compensators in one call", spent, "us", _MILLISECOND))
    return figures


def run(seeds: Sequence[int] = SEEDS) -> list[Figure]:
    """All axes and methods, and the step times."""
    return [*figures_of(compete(seeds)), *step_times()]


BENCHMARK = Benchmark("compensation", "methods of friction compensation, each tuned from a recording", run, long=True)
