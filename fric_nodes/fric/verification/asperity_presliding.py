"""Pre-sliding hysteresis of the asperity model: return-point memory and rate independence, as in Fig. 5."""

from __future__ import annotations

import numpy as np

from ..figure import Figure
from ..friction.asperity import AsperityParameters, AsperityPopulation
from ..record import Array
from ..report.figures import Curve, scatter_and_curves
from .nested_loops import NestedLoops
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_N = 10_000
_TIP = 200  # amplitude of the outer loop, in steps; 0.1 w_0
_STEP = 0.1 / _TIP
_LOOPS = NestedLoops(_TIP, ((-40, -120), (80, 0)))
_DURATION = 1000.0  # of the slowest run, with inner loops [tau]
_RATES = (1, 5, 20)


def _force(inner: bool, rate: int) -> Array:
    """Force over each step of the path, after a rest of 100 tau."""
    population = AsperityPopulation(AsperityParameters(), _N)
    population.run(np.zeros(2), 100.0)
    sample_time = _DURATION / (_LOOPS.path().shape[0] - 1) / rate
    return population.run(_STEP * _LOOPS.path(inner), sample_time).force


def _run() -> Evidence:
    figures, curves = [], []
    slowest: Array = np.zeros(0)
    path = _LOOPS.path()
    middle = 0.5 * (path[1:] + path[:-1]) * _STEP
    for rate, colour, dash in zip(_RATES, ("after", "before", "true"), ("solid", "dash", "dot"), strict=True):
        plain, looped = _force(False, rate), _force(True, rate)
        span = float(np.ptp(plain))
        for number, off in enumerate(_LOOPS.deviations(plain, looped), start=1):
            name = f"at {rate}x: off the outer curve after inner loop {number}, of the force's range"
            figures.append(Figure(name, 100.0 * off / span, "%", "<= 1"))
        if rate == 1:
            slowest = looped
        else:
            off = float(np.max(np.abs(looped - slowest))) / float(np.ptp(slowest))
            figures.append(Figure(f"loops at {rate}x off those at 1x, of the force's range", 100.0 * off, "%", "<= 1"))
        curves.append(Curve(f"{rate}x", middle, looped, colour, dash, 1.6))
    plot = scatter_and_curves(None, curves, "x* = x/w_0 [1]", "F_t* [1]")
    caption = f"Two inner loops on the last rising branch, {_N} asperities. At 1x the whole takes {_DURATION:.0f} tau."
    notes = [
        "Memory isn't perfect by construction: on the way some asperities lose their contact, and a new one is weaker until "
        "it is as old as the others. What is measured here is that this doesn't show.",
        "Rate independence ends where the way through a loop takes less time than contacts need to strengthen; the paper "
        "doesn't print the time of its reference signal.",
    ]
    return Evidence(figures, [(plot, caption)], notes)


VERIFICATION = Verification(
    id="asperity-presliding",
    title="Asperity model: return-point memory and rate independence",
    source="Al-Bender, Lampaert, Swevers 2004, Sec. 8, Fig. 5",
    run=_run,
)
