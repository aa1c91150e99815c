"""Verification of dwell time: break-away after rests of graded length, in a running model, against the six printed laws."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import plotly.graph_objects as go
from scipy.integrate import solve_ivp

from ..figure import Figure
from ..model import Model, build_model, term
from ..record import Array
from ..report.figures import COLOURS, Curve, scatter_and_curves
from ..simulation import Predictor, Simulator
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

F_C, D_0, MASS = 4.0, 1e-4, 1.5
_STEP, _SPEED = 1e-4, 0.05
_FINE, _PULL = 5e-6, 200.0  # step and rate of the ramp [s], [N/s]
_RESTS = np.geomspace(0.01, 30.0, 10)

_STYLES = (
    *(("solid", "circle"), ("solid", "square"), ("solid", "diamond")),
    *(("dash", "triangle-up"), ("dot", "triangle-down"), ("dash", "x")),
)

# The laws of Appendix I as surplus over F_C, in its own parameters F_inf, F_0, C_1, C_2, C_3; and those of the effects.
_LAWS: dict[str, tuple[int, dict[str, float], Callable[[Array], Array]]] = {
    "exponential": (
        34,
        {"force": 2.0, "initial": 0.5, "time": 0.5, "exponent": 0.8},
        lambda t: 2.0 - 1.5 * np.exp(-(0.5**-0.8) * t**0.8),
    ),
    "exponential_power": (
        35,
        {"force": 2.4, "time": 2.0, "exponent": 0.6, "power": 0.5},
        lambda t: 2.4 * (1.0 - np.exp(-(2.0**-0.6) * t**0.6)) ** 0.5,
    ),
    "hyperbolic": (36, {"force": 1.6, "initial": 0.2, "time": 1.0}, lambda t: 0.2 + 1.4 * t / (t + 1.0)),
    "power": (37, {"force": 1.0, "exponent": 0.2}, lambda t: 1.0 * t**0.2),
    "root": (38, {"force": 2.0, "ratio": 8.0, "time": 0.05}, lambda t: 2.0 / (7.0 / np.sqrt(20.0 * t + 1.0) + 1.0)),
    "logarithmic": (39, {"force": 0.15, "initial": 0.3, "time": 0.01}, lambda t: 0.3 + 0.15 * np.log(100.0 * t + 1.0)),
}


def _model(law: str) -> Model:
    terms = [term("coulomb", force=F_C), term("dwell_time", law, length=D_0, **_LAWS[law][1])]
    return build_model("rigid", {"mass": MASS}, terms)


def _stop(printed: Callable[[Array], Array]) -> tuple[float, float]:
    """When a coasting body stops, and how old its contact is then, by an integration of its own [s]."""

    def equations(_: float, y: Array) -> list[float]:
        return [-(F_C + float(printed(y[1]))) / MASS, 1.0 - y[0] * y[1] / D_0]

    def speed(_: float, y: Array) -> float:
        return float(y[0])

    speed.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(equations, (0.0, 1.0), [_SPEED, D_0 / _SPEED], "Radau", events=speed, rtol=1e-9, atol=1e-14)
    return float(found.t[-1]), float(found.y[1, -1])


def _break_away(law: str, rest: float, stop: float, age: float) -> tuple[float, float]:
    """Age of the contact when it lets go [s], counted by the clock, and the force that it takes [N]."""
    simulator = Simulator(_model(law), velocity=_SPEED)
    simulator.memory[:] = D_0 / _SPEED
    simulator.run(np.zeros(round((stop + rest) / _STEP)), _STEP)
    begin = simulator.time
    u = F_C + _PULL * _FINE * (np.arange(3000, dtype=np.float64) + 0.5)
    states, _ = simulator.run(u, _FINE)
    first = int(np.flatnonzero(states[:, 1])[0])
    # It lets go where the ramp passes the level, up to one step before the force that was found to move it.
    return age + begin - stop + first * _FINE, float(u[first]) - 0.5 * _PULL * _FINE


def _sliding(law: str) -> float:
    """Largest deviation of friction at speed v from static friction after D_0/v, relative to the surplus."""
    worst = 0.0
    for v in np.geomspace(1e-4, 0.05, 5):
        n = 300
        h = D_0 / v / 20.0
        t = np.arange(n, dtype=np.float64) * h
        _, friction = Predictor(_model(law)).run(t, v * t, np.full(n, v), np.zeros(n), h)
        expected = float(_LAWS[law][2](D_0 / v))
        worst = max(worst, abs(friction[-1] - F_C - expected) / expected)
    return worst


def run() -> Evidence:
    """Find the evidence."""
    figures: list[Figure] = []
    curves: list[Curve] = []
    points: list[go.Scatter] = []
    ages = np.geomspace(0.008, 40.0, 300)
    for (law, (number, _, printed)), colour, (dash, symbol) in zip(_LAWS.items(), COLOURS, _STYLES, strict=True):
        title = law.replace("_", " to a ")
        stop, age = _stop(printed)
        found = np.array([_break_away(law, float(rest), stop, age) for rest in _RESTS])
        expected = F_C + printed(found[:, 0])
        off = float(np.max(np.abs(found[:, 1] - expected) / expected))
        of_surplus = float(np.max(np.abs(found[:, 1] - expected) / (expected - F_C)))
        figures += [
            Figure(f"Eq. {number} ({title}): break-away off the law, of the force", 100.0 * off, "%", "<= 1"),
            Figure(
                f"Eq. {number} ({title}): the same, of the surplus over kinetic friction", 100.0 * of_surplus, "%", "<= 0.5"
            ),
        ]
        curves.append(Curve(f"Eq. {number}, {title}", ages, F_C + printed(ages), colour, dash, 1.6))
        marker = {"color": COLOURS[colour], "symbol": symbol, "size": 9, "line": {"color": "white", "width": 1}}
        points.append(go.Scatter(x=found[:, 0], y=found[:, 1], mode="markers", marker=marker, showlegend=False))
    figures.append(
        Figure(
            "F_dynamic(v) off F_static(t = D_0/v), six laws, of the surplus", 100.0 * max(map(_sliding, _LAWS)), "%", "<= 0.01"
        )
    )
    plot = scatter_and_curves(None, curves, "time at rest [s]", "break-away force [N]")
    plot.add_traces(points)
    plot.update_xaxes(type="log")
    caption = (
        "Break-away force after rests of graded length. Lines: the printed laws over a kinetic friction of 4 N. Points: a body "
        f"of {MASS} kg that coasts to rest, waits and is then pulled, from 4 N on by a ramp of {_PULL:.0f} N/s, until it moves."
    )
    notes = [
        "Eqs. 36 and 39 as scanned fall with time, from F_inf; the paper says that all of its functions rise, and from F_0 "
        "upwards they do.",
        "Eq. 38 as scanned has lost its fraction bars; taken is the arrangement that is F_0 at t = 0 and F_inf in the end.",
        "The contact's age follows d theta/dt = 1 - |v| theta / D_0: the clock at rest, D_0/v in steady sliding.",
    ]
    return Evidence(figures, [(plot, caption)], notes)


VERIFICATION = Verification(
    id="dwell-time",
    title="Static friction that rises with dwell time",
    source="Al-Bender, Lampaert, Swevers 2004, Appendix I, Eqs. 34 to 39; stop of the body by an integration of its own",
    run=run,
)
