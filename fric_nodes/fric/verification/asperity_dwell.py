"""Break-away of the asperity model against dwell time: a population at rest gives back the law that was put in."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import plotly.graph_objects as go

from ..figure import Figure
from ..friction.asperity import AsperityParameters, AsperityPopulation
from ..record import Array
from ..report.figures import COLOURS, Curve, scatter_and_curves
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_N = 10_000
_STIFFNESS = 2000.0
_SPEED = 200.0  # before the rest, and pulling away after it: contacts are no older than 0.01 tau at the stop
_PULL = 2e-4  # step of the pull [w_0]
_RESTS = np.geomspace(0.1, 6.0, 7)  # [tau]

# mu* over the time at rest, typed from the paper with F_0 = 1; its C_1, C_2, C_3 as numbers. And the parameters for the same.
_LAWS: dict[str, tuple[str, dict[str, float], Callable[[Array], Array]]] = {
    "exponential": ("Eq. 1", {"growth": 5.0}, lambda t: 1.0 + (5.0 - 1.0) * (1.0 - np.exp(-t))),
    "stretched": ("Eq. 34", {"growth": 4.0, "beta": 0.6}, lambda t: 4.0 - (4.0 - 1.0) * np.exp(-(t**0.6))),
    "exponential_power": (
        "Eq. 35",
        {"growth": 4.5, "beta": 0.8, "gamma": 0.5},
        lambda t: 4.5 * (1.0 - np.exp(-(t**0.8))) ** 0.5,
    ),
    "hyperbolic": ("Eq. 36", {"growth": 3.5}, lambda t: 1.0 + (3.5 - 1.0) * t / (t + 1.0)),
    "power": ("Eq. 37", {"growth": 1.6, "beta": 0.5}, lambda t: 1.0 + 0.6 * t**0.5),
    "root": ("Eq. 38", {"growth": 6.0}, lambda t: 6.0 / ((6.0 / 1.0 - 1.0) / np.sqrt(t + 1.0) + 1.0)),
    "logarithmic": ("Eq. 39", {"growth": 1.5}, lambda t: 1.0 + 0.5 * np.log(t + 1.0)),
}


def _break_away(law: str, values: dict[str, float]) -> Array:
    """Largest force after each of the rests."""
    population = AsperityPopulation(AsperityParameters(stiffness=_STIFFNESS, law=law, **values), _N)
    population.run(0.1 * np.arange(41), 0.1 / _SPEED)
    stopped = population.states.copy()
    found = []
    for rest in _RESTS:
        population.states[:] = stopped
        population.run(np.zeros(2), float(rest))
        found.append(float(np.max(population.run(_PULL * np.arange(61), _PULL / _SPEED).force)))
    return np.array(found)


def _run() -> Evidence:
    figures: list[Figure] = []
    curves: list[Curve] = []
    points: list[go.Scatter] = []
    line = np.geomspace(0.08, 8.0, 200)
    colours = [*COLOURS, "after"]
    for (law, (equation, values, printed)), colour in zip(_LAWS.items(), colours, strict=True):
        found = _break_away(law, values)
        off = 100.0 * float(np.max(np.abs(found / printed(_RESTS) - 1.0)))
        figures.append(Figure(f"{equation} ({law.replace('_', ' ')}): break-away off the law, worst rest", off, "%", "<= 3"))
        figures.append(
            Figure(f"{equation}: least rise from one rest to the next longer", float(np.min(np.diff(found))), "1", ">= 0.001")
        )
        dash = "dash" if law == "logarithmic" else "solid"
        curves.append(Curve(f"{equation}, {law.replace('_', ' ')}", line, printed(line), colour, dash, 1.6))
        marker = {"color": COLOURS[colour], "size": 8, "line": {"color": "white", "width": 1}}
        points.append(go.Scatter(x=_RESTS, y=found, mode="markers", marker=marker, showlegend=False))
    plot = scatter_and_curves(None, curves, "time at rest [tau]", "break-away F_t* [1]")
    plot.add_traces(points)
    plot.update_xaxes(type="log")
    caption = (
        f"Largest force of {_N} asperities that slide at v* = {_SPEED:.0f}, rest, and are pulled away at that speed; k_t* = "
        f"{_STIFFNESS:.0f}. Lines: the laws put in."
    )
    notes = [
        "The rest begins with contacts that are up to 0.01 tau old, and some contacts are lost before the last has begun to "
        "slip: both are in the deviation.",
        "Appendix I as printed has Eqs. 36 and 39 falling with time and Eq. 38 without fraction bars; all are taken to rise "
        "from F_0.",
    ]
    return Evidence(figures, [(plot, caption)], notes)


VERIFICATION = Verification(
    id="asperity-dwell",
    title="Asperity model: break-away against dwell time",
    source="Al-Bender, Lampaert, Swevers 2004, Eq. 1 and Appendix I",
    run=_run,
)
