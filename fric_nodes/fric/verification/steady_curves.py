"""Verification of the steady curves: each law, as the compiled model gives it, beside its equation typed a second time."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots
from scipy.optimize import brentq

from ..figure import Figure
from ..model import Model, Term, build_model, term
from ..record import Array
from ..report.figures import COLOURS, Curve, scatter_and_curves
from ..simulation import Simulator, predict_force
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

# Szell, section 5.1, Model A.
F_C, F_S, F_V, V_S = 2.447, 3.7, 15.0, 0.019
_SURPLUS = F_S - F_C
_MASS = 0.5
_COULOMB, _VISCOUS = term("coulomb", force=F_C), term("viscous", coefficient=F_V)

Curves = dict[str, tuple[list[Term], Callable[[Array], Array]]]

_OVER_VELOCITY: Curves = {
    "Coulomb and viscous": ([_COULOMB, _VISCOUS], lambda v: np.sign(v) * F_C + F_V * v),
    "Stribeck, delta = 2": (
        [_COULOMB, _VISCOUS, term("stribeck", "exponential", force=_SURPLUS, velocity=V_S)],
        lambda v: np.sign(v) * (F_C + (F_S - F_C) * np.exp(-((v / V_S) ** 2))) + F_V * v,
    ),
    "Stribeck, delta = 0.5": (
        [_COULOMB, _VISCOUS, term("stribeck", "exponential", force=_SURPLUS, velocity=V_S, exponent=0.5)],
        lambda v: np.sign(v) * (F_C + (F_S - F_C) * np.exp(-np.sqrt(np.abs(v) / V_S))) + F_V * v,
    ),
    "Hess and Soom": (
        [_COULOMB, _VISCOUS, term("stribeck", "hess_soom", force=_SURPLUS, velocity=V_S)],
        lambda v: np.sign(v) * (F_C + (F_S - F_C) / (1.0 + (v / V_S) ** 2)) + F_V * v,
    ),
    "quadratic drag": (
        [_COULOMB, term("quadratic_drag", coefficient=200.0)],
        lambda v: np.sign(v) * (F_C + 200.0 * v**2),
    ),
    "asymmetric": (
        [_COULOMB, _VISCOUS, term("asymmetry", force=0.4, coefficient=5.0)],
        lambda v: np.sign(v) * F_C + 0.4 + F_V * v + 5.0 * np.abs(v),
    ),
}
_OVER_POSITION: Curves = {
    "ripple": (
        [term("ripple", cosine=0.6, sine=-0.4, period=0.02)],
        lambda q: 0.6 * np.cos(100 * np.pi * q) - 0.4 * np.sin(100 * np.pi * q),
    ),
    "stiffness": ([term("stiffness", stiffness=40.0, position=0.01)], lambda q: 40.0 * (q - 0.01)),
    "hardening stiffness": ([term("nonlinear_stiffness", stiffness=2e4)], lambda q: 2e4 * q**3),
    "periodic level": (
        [_COULOMB, term("position_dependence", "periodic", cosine=0.2, sine=0.1, period=0.02)],
        lambda q: F_C * (1.0 + 0.2 * np.cos(100 * np.pi * q) + 0.1 * np.sin(100 * np.pi * q)),
    ),
    "local level": (
        [_COULOMB, term("position_dependence", "local", amplitude=0.5, position=0.02, width=0.005)],
        lambda q: F_C * (1.0 + 0.5 * np.exp(-20000.0 * (q - 0.02) ** 2)),
    ),
}
_WITH_SURROUNDINGS: dict[str, tuple[str, list[Term], Callable[[Array], Array]]] = {
    "load": ("N/N_0 [1]", [_COULOMB, term("load_dependence", coefficient=0.8)], lambda x: F_C * (1.0 + 0.8 * (x - 1.0))),
    "temperature": (
        "T [K]",
        [_COULOMB, _VISCOUS, term("temperature", level_change=-0.01, viscous_change=-0.3)],
        lambda x: F_C * (1.0 - 0.01 * x) + (F_V - 0.3 * x) * 0.05,
    ),
    "time, run-in": (
        "t [s]",
        [_COULOMB, term("time_drift", "exponential", change=-0.3, time=10.0)],
        lambda x: F_C * (1.0 - 0.3 * (1.0 - np.exp(-x / 10.0))),
    ),
    "time, linear": ("t [s]", [_COULOMB, term("time_drift", "linear", rate=0.01)], lambda x: F_C * (1.0 + 0.01 * x)),
}


def _model(terms: Sequence[Term]) -> Model:
    return build_model("rigid", {"mass": _MASS}, terms)


def _deviation(found: Array, expected: Array) -> float:
    return float(np.max(np.abs(found - expected)) / np.max(np.abs(expected)))


def _over_velocity(v: Array) -> tuple[dict[str, Array], float]:
    zero = np.zeros_like(v)
    found = {name: predict_force(_model(terms), zero, zero, v, zero, 1e-6) for name, (terms, _) in _OVER_VELOCITY.items()}
    return found, max(_deviation(found[name], law(v)) for name, (_, law) in _OVER_VELOCITY.items())


def _over_position(q: Array) -> tuple[dict[str, Array], float]:
    zero = np.zeros_like(q)
    # A creeping body: its friction has the sign of the motion, and nothing else depends on the velocity.
    found = {
        name: predict_force(_model(terms), zero, q, zero + 1e-9, zero, 1e-6) for name, (terms, _) in _OVER_POSITION.items()
    }
    return found, max(_deviation(found[name], law(q)) for name, (_, law) in _OVER_POSITION.items())


def _surrounded(name: str, x: Array) -> Array:
    zero, one = np.zeros_like(x), np.ones_like(x)
    unit, terms, _ = _WITH_SURROUNDINGS[name]
    return predict_force(
        _model(terms),
        x if unit == "t [s]" else zero,
        zero,
        zero + 0.05,
        zero,
        1e-6,
        load=x if unit == "N/N_0 [1]" else one,
        temperature=x if unit == "T [K]" else zero,
    )


def _terminal_velocity(push: float) -> tuple[float, float]:
    """Speed that a body ends at under a constant force, and where the printed curve takes that force."""
    terms, law = _OVER_VELOCITY["Hess and Soom"]
    states, _ = Simulator(_model(terms), velocity=0.2).run(np.full(2000, push), 1e-3)
    expected = brentq(lambda v: float(law(np.array(v))) - push, 0.05, 1.0, xtol=1e-14)
    return float(states[-1, 1]), float(expected)


def _break_away(terms: Sequence[Term]) -> float:
    """Force of a slow ramp, 1e-4 N a step, at which the body starts to move [N]."""
    simulator = Simulator(_model(terms))
    u = 3.6 + 1e-4 * np.arange(2000, dtype=np.float64)
    states, _ = simulator.run(u, 1e-3)
    return float(u[np.flatnonzero(states[:, 1])[0]])


def _panel(panels: Sequence[tuple[str, str, Array, Array, Array]]) -> go.Figure:
    """Small pictures side by side, each ``(title, x label, x, found, expected)``."""
    plot = make_subplots(rows=1, cols=len(panels), subplot_titles=[panel[0] for panel in panels])
    for column, (_, label, x, found, expected) in enumerate(panels, start=1):
        style = {"color": COLOURS["after"], "width": 3}
        plot.add_trace(go.Scatter(x=x, y=found, line=style, name="model", showlegend=column == 1), row=1, col=column)
        style = {"color": COLOURS["true"], "width": 1.2, "dash": "dash"}
        plot.add_trace(go.Scatter(x=x, y=expected, line=style, name="equation", showlegend=column == 1), row=1, col=column)
        plot.update_xaxes(title_text=label, row=1, col=column)
    plot.update_yaxes(title_text="force [N]", row=1, col=1)
    plot.update_layout(template="plotly_white", height=300, margin={"l": 60, "r": 16, "t": 46, "b": 46})
    return plot


def run() -> Evidence:
    """Find the evidence."""
    v = np.concatenate([-np.linspace(1e-6, 0.12, 1500)[::-1], np.linspace(1e-6, 0.12, 1500)])
    q = np.linspace(-0.04, 0.04, 1001)
    over_v, worst_v = _over_velocity(v)
    over_q, worst_q = _over_position(q)
    ranges = {"load": (0.2, 3.0), "temperature": (-10.0, 30.0)}
    grids = {name: np.linspace(*ranges.get(name, (0.0, 40.0)), 401) for name in _WITH_SURROUNDINGS}
    around = {name: _surrounded(name, x) for name, x in grids.items()}
    worst_s = max(_deviation(around[name], law(grids[name])) for name, (_, _, law) in _WITH_SURROUNDINGS.items())
    speed, expected_speed = _terminal_velocity(5.0)
    static = _break_away([_COULOMB, term("stribeck", "static", force=_SURPLUS)])
    hess_soom = _break_away(_OVER_VELOCITY["Hess and Soom"][0])
    figures = [
        Figure("laws over velocity against their equations, largest deviation of the range", worst_v, "1", "<= 1e-12"),
        Figure("forces and levels over position, the same", worst_q, "1", "<= 1e-12"),
        Figure("levels over load, temperature and time, the same", worst_s, "1", "<= 1e-12"),
        Figure("speed under 5 N against the root of Szell's curve", abs(speed / expected_speed - 1.0), "1", "<= 1e-9"),
        Figure("break-away with static friction, off F_S = 3.7 N", abs(static - F_S), "N", "<= 2e-4"),
        Figure("break-away on the Hess-Soom curve, off F_S = 3.7 N", abs(hess_soom - F_S), "N", "<= 2e-4"),
    ]
    dashes = ["solid", "solid", "dash", "solid", "dot", "dash"]
    colours = ["reference", "after", "after", "before", "second", "measured"]
    curves = [
        Curve(name, v, force, colour, dash, 2.0)
        for (name, force), colour, dash in zip(over_v.items(), colours, dashes, strict=True)
    ]
    plots = [
        (
            scatter_and_curves(None, curves, "velocity [m/s]", "force [N]"),
            "Steady friction over velocity as the compiled models give it, with the parameters of Szell's Model A.",
        ),
        (
            _panel([(name, "position [m]", q, over_q[name], law(q)) for name, (_, law) in _OVER_POSITION.items()]),
            "Forces over position, and friction levels that depend on it (slow forward motion), with the equations.",
        ),
        (
            _panel(
                [
                    (name, unit, grids[name], around[name], law(grids[name]))
                    for name, (unit, _, law) in _WITH_SURROUNDINGS.items()
                ]
            ),
            "Friction at 0.05 m/s as load, temperature and time change it, with the equations.",
        ),
    ]
    notes = [
        "Szell's Eq. 10 prints the exponent without the brackets that make delta act on |v/v_S|; with them 1/e is left at v_S.",
        "Static friction is a surplus at a velocity of exactly zero; it holds a body to the last bit, and goes as it moves.",
    ]
    return Evidence(figures, plots, notes)


VERIFICATION = Verification(
    id="steady-curves",
    title="Steady friction curves",
    source="Szell, Eqs. 6 to 11 with the parameters of Model A; the other equations typed a second time",
    run=run,
)
