"""Verification of frictional lag: loops of friction over velocity, and how their area grows with frequency."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import plotly.graph_objects as go
from scipy.integrate import quad, solve_ivp

from ..figure import Figure
from ..model import Model, build_model, term
from ..record import Array
from ..report.figures import Curve, scatter_and_curves
from ..simulation import Predictor
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

F_C, SURPLUS, V_S = 4.0, 3.0, 0.02
TAU = 0.02
MEAN, AMPLITUDE = 0.025, 0.015  # velocity [m/s]
_FREQUENCIES = (0.5, 1.0, 2.0, 4.0)
_SMALL = 1e-4  # amplitude for the closed form [m/s]


def _steady(v: Array) -> Array:
    return np.asarray(F_C + SURPLUS * np.exp(-((v / V_S) ** 2)))


def _slope(v: float) -> float:
    return float(-2.0 * v / V_S**2 * SURPLUS * np.exp(-((v / V_S) ** 2)))


def _model(law: str) -> Model:
    terms = [term("coulomb", force=F_C), term("stribeck", force=SURPLUS, velocity=V_S), term("frictional_lag", law, time=TAU)]
    return build_model("rigid", {"mass": 1.0}, terms)


def _loop(law: str, frequency: float, amplitude: float = AMPLITUDE) -> tuple[Array, Array, Array]:
    """Velocity, acceleration and friction over one period, after as many as the lag needs to settle; the ends meet."""
    h = 1.0 / (2000.0 * frequency)
    settle = int(np.ceil(20.0 * TAU * frequency))
    t = np.arange(2000 * (settle + 1) + 1, dtype=np.float64) * h
    omega = 2.0 * np.pi * frequency
    v = MEAN - amplitude * np.cos(omega * t)
    a = amplitude * omega * np.sin(omega * t)
    _, friction = Predictor(_model(law)).run(t, np.zeros_like(t), v, a, h)
    return v[-2001:], a[-2001:], friction[-2001:]


def _area(v: Array, friction: Array) -> float:
    return float(np.trapezoid(friction, v))


def _expected_area(law: str, frequency: float) -> float:
    """The same from the law's own equation, by quadrature or by a fine integration."""
    omega = 2.0 * np.pi * frequency

    def v(t: float) -> float:
        return MEAN - AMPLITUDE * float(np.cos(omega * t))

    def rate(t: float) -> float:
        return AMPLITUDE * omega * float(np.sin(omega * t))

    if law == "delay":
        return float(
            quad(lambda t: float(_steady(np.array(v(t - TAU)))) * rate(t), 0.0, 1.0 / frequency, epsrel=1e-10, limit=200)[0]
        )
    begin = 20.0 * TAU
    settled = solve_ivp(
        lambda t, y: [(float(_steady(np.array(v(t)))) - y[0]) / TAU], (0.0, begin), [F_C], "LSODA", rtol=1e-10, atol=1e-12
    )
    found = solve_ivp(
        lambda t, y: [(float(_steady(np.array(v(t)))) - y[0]) / TAU, y[0] * rate(t)],
        (begin, begin + 1.0 / frequency),
        [settled.y[0, -1], 0.0],
        "LSODA",
        rtol=1e-10,
        atol=1e-12,
    )
    return float(found.y[1, -1])


_CLOSED: dict[str, Callable[[float], float]] = {
    "delay": lambda omega: float(np.sin(omega * TAU)),
    "first_order": lambda omega: float(omega * TAU / (1.0 + (omega * TAU) ** 2)),
}


def run() -> Evidence:
    """Find the evidence."""
    figures: list[Figure] = []
    plots = []
    areas: dict[str, list[float]] = {}
    for law, title in (("first_order", "one time constant"), ("delay", "pure delay")):
        speeds = np.linspace(MEAN - AMPLITUDE, MEAN + AMPLITUDE, 200)
        curves = [Curve("steady curve", speeds, _steady(speeds), "true", "dot", 2.0)]
        inside = 0.0
        worst = 0.0
        areas[law] = []
        for frequency, colour in zip(_FREQUENCIES, ("second", "after", "before", "measured"), strict=True):
            v, a, friction = _loop(law, frequency)
            curves.append(Curve(f"{frequency:g} Hz", v, friction, colour))
            areas[law].append(abs(_area(v, friction)))
            worst = max(worst, abs(_area(v, friction) / _expected_area(law, frequency) - 1.0))
            # Around the turning points friction crosses the curve, a lag later than the velocity turns.
            late = np.abs(a) > 0.7 * np.max(np.abs(a))
            inside = max(inside, float(np.mean((friction[late] - _steady(v[late])) * a[late] <= 0.0)))
        growth = min(after / before for before, after in zip(areas[law], areas[law][1:], strict=False))
        closed = max(
            abs(
                abs(_area(*_loop(law, frequency, _SMALL)[::2]))
                / (np.pi * abs(_slope(MEAN)) * _SMALL**2 * _CLOSED[law](2.0 * np.pi * frequency))
                - 1.0
            )
            for frequency in (*_FREQUENCIES, 12.0)
        )
        figures += [
            Figure(
                f"{title}: loop area, 0.5 to 4 Hz, smallest growth from one frequency to its double", growth, "times", ">= 1.3"
            ),
            Figure(f"{title}: area off the law's own equation, integrated", worst, "1", "<= 1e-3"),
            Figure(f"{title}: area of a small loop off the closed form", closed, "1", "<= 1e-3"),
            Figure(
                f"{title}: share of the loop below the curve while speeding up, or above it while slowing down",
                inside,
                "1",
                "== 0",
            ),
        ]
        caption = (
            f"Friction over a sinusoidal velocity, {title} of {1e3 * TAU:.0f} ms: above the steady curve while the speed rises."
        )
        plots.append((scatter_and_curves(None, curves, "velocity [m/s]", "friction [N]"), caption))
    plots.append(_areas_over_frequency())
    notes = [
        "A falling curve that comes late lies above itself while the speed rises and below while it falls. The share on either "
        "side is taken where the acceleration is above 0.7 of its largest: friction crosses the curve a lag after the "
        "velocity turns.",
        "The area grows with frequency up to omega tau = 1 with one time constant, and up to omega tau = pi/2 with a delay; "
        "beyond, friction cannot follow, and the loop gets flat again.",
    ]
    return Evidence(figures, plots, notes)


def _areas_over_frequency() -> tuple[go.Figure, str]:
    """Picture of the small loops' area over frequency, found and in closed form."""
    frequency = np.geomspace(0.5, 0.5 / TAU, 40)
    curves = []
    for law, title, colour in (("first_order", "one time constant", "after"), ("delay", "pure delay", "before")):
        scale = np.pi * abs(_slope(MEAN)) * _SMALL**2
        found = np.array([abs(_area(*_loop(law, float(f), _SMALL)[::2])) / scale for f in frequency])
        closed = np.array([abs(_CLOSED[law](2.0 * np.pi * float(f))) for f in frequency])
        curves += [
            Curve(title, frequency, found, colour, width=3.0),
            Curve(f"{title}, closed form", frequency, closed, "true", "dash"),
        ]
    plot = scatter_and_curves(None, curves, "frequency [Hz]", "loop area / (pi |slope| amplitude^2)")
    plot.update_xaxes(type="log")
    return (
        plot,
        "Area of small loops over frequency, against the closed forms sin(omega tau) and omega tau / (1 + (omega tau)^2).",
    )


VERIFICATION = Verification(
    id="frictional-lag",
    title="Frictional lag",
    source="Hess and Soom 1990; Al-Bender, Lampaert, Swevers 2004, section 11 and Fig. 7; closed form of small loops",
    run=run,
)
