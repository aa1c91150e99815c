"""Friction lag, velocity steps and the passage through zero velocity of the asperity model, as in Figs. 7 to 9."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from scipy.optimize import curve_fit

from ..figure import Figure
from ..friction.asperity import AsperityParameters, AsperityPopulation
from ..record import Array
from ..report.figures import Curve, scatter_and_curves, stacked
from .asperity_reference import steady
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_N = 10_000
_SAMPLES = 240  # of one period
_PERIODS = 8  # that are averaged, after two that aren't
_STIFFNESS = 200.0


def _cycle(mean: float, amplitude: float, frequency: float) -> tuple[Array, Array, Array]:
    """Speed in the middle of each interval of a period, its change over the interval, and the force, averaged over periods."""
    h = 1.0 / frequency / _SAMPLES
    t = np.arange((_PERIODS + 2) * _SAMPLES + 1) * h
    omega = 2.0 * np.pi * frequency
    position = mean * t + amplitude / omega * (1.0 - np.cos(omega * t))
    force = AsperityPopulation(AsperityParameters(stiffness=_STIFFNESS), _N).run(position, h).force
    speed = np.diff(position) / h
    change = np.diff(mean + amplitude * np.sin(omega * t))
    first = 2 * _SAMPLES
    return speed[:_SAMPLES], change[:_SAMPLES], np.mean(force[first:].reshape(_PERIODS, _SAMPLES), axis=0)


def _steady_line(low: float, high: float) -> tuple[Array, Array]:
    speeds = np.linspace(low, high, 50)
    return speeds, np.array([steady(float(v), _STIFFNESS).force for v in speeds])


def _lag() -> tuple[list[Figure], tuple[go.Figure, str]]:
    """Loops around a positive mean velocity."""
    line = _steady_line(0.2, 2.8)
    figures, curves, areas = [], [Curve("steady", *line, "true", "dot", 2.0)], []
    for frequency, colour in ((0.5, "after"), (0.2, "before"), (0.1, "second")):
        speed, change, force = _cycle(1.5, 1.2, frequency)
        above = force - np.interp(speed, *line)
        areas.append(float(np.sum(force * change)))
        name = f"lag at f* = {frequency}"
        faster, slower = float(np.mean(above[change > 0])), float(np.mean(above[change < 0]))
        figures += [
            Figure(f"{name}: mean of force over the steady curve while accelerating", faster, "1", ">= 0.01"),
            Figure(f"{name}: the same while decelerating", slower, "1", "<= -0.01"),
            Figure(f"{name}: area of the loop", areas[-1], "1", ">= 0.01"),
        ]
        curves.append(Curve(f"f* = {frequency}", np.append(speed, speed[0]), np.append(force, force[0]), colour, width=1.6))
    for number, name in ((0, "0.5 over 0.2"), (1, "0.2 over 0.1")):
        figures.append(Figure(f"lag: area at f* = {name}", areas[number] / areas[number + 1], "1", ">= 1.1"))
    plot = scatter_and_curves(None, curves, "v* [1]", "F_t* [1]")
    return figures, (plot, "Lag: v* = 1.5 + 1.2 sin(2 pi f* t*), passed clockwise: above while accelerating.")


def _decay(t: Array, end: float, height: float, time: float) -> Array:
    return np.asarray(end + height * np.exp(-t / time))


def _velocity_step(before: float, after: float, mass: float) -> tuple[Array, Array, int]:
    """Times of the intervals' middles from the step on, force, and the number of intervals before the step."""
    h, settle, first, later = 0.02, 500, 50, 200
    population = AsperityPopulation(AsperityParameters(stiffness=_STIFFNESS, mass=mass), 6 * _N)
    population.run(4.0 * before * h * np.arange(settle // 4 + 1), 4.0 * h)
    speed = np.concatenate([np.full(first, before), np.full(later, after)])
    force = population.run(h * np.concatenate([[0.0], np.cumsum(speed)]), h).force
    t: Array = (np.arange(first + later, dtype=np.float64) - first + 0.5) * h
    return t, force, first


def _steps() -> tuple[list[Figure], tuple[go.Figure, str]]:
    """Force after steps of velocity, with massive tips."""
    figures, curves, times = [], [], []
    mass = 5.0
    for (before, after), colour in (((0.5, 1.25), "after"), ((0.5, 0.9), "before"), ((1.0, 1.25), "second")):
        t, force, first = _velocity_step(before, after, mass)
        name = f"v* from {before} to {after}"
        jump = float(np.mean(force[first : first + 3]) - np.mean(force[:first]))
        # The scatter comes from the tips' inertia, lost in lumps; what decays is the rest.
        light = _velocity_step(before, after, 0.0)[1]
        (end, _, time), _ = curve_fit(_decay, t[first:], light[first:], (light[-1], 1.0, 0.5))
        expected = steady(after, _STIFFNESS).force
        times.append(float(time))
        figures += [
            Figure(f"{name}: jump over m* (v_2^2 - v_1^2)/2", jump / (0.5 * mass * (after**2 - before**2)), "1", ">= 0.9"),
            Figure(f"{name}: end of the decay off steady sliding", 100.0 * abs(float(end) / expected - 1.0), "%", "<= 1"),
            Figure(f"{name}: time constant of the decay", times[-1], "tau"),
        ]
        curves.append(Curve(name, t, force, colour))
    figures.append(
        Figure("time constant after the smaller step over that after the larger", times[1] / times[0], "1", ">= 1.05")
    )
    figures.append(Figure("time constant from v* = 1.0 over that from 0.5, both to 1.25", times[2] / times[0], "1"))
    plot = stacked([("F_t* [1]", curves)], "time after the step [tau]", 380)
    return figures, (
        plot,
        f"Steps of velocity, m* = {mass:.0f}: a jump with the tips' inertia, then a decay as contacts get younger.",
    )


def _through_zero() -> tuple[list[Figure], tuple[go.Figure, str]]:
    """Reversing motion."""
    speed, change, force = _cycle(0.0, 2.0, 0.1)
    half = _SAMPLES // 2
    line = _steady_line(0.02, 2.0)
    outward = (np.abs(speed) > 0.6) & (np.abs(speed) < 1.8)
    above = force * np.sign(speed) - np.interp(np.abs(speed), *line)
    speeding_up = change * speed > 0.0
    odd = float(np.max(np.abs(force[:half] + force[half:]))) / float(np.ptp(force))
    at_zero = float(force[-1])  # the interval that ends where the velocity passes zero upwards
    faster, slower = float(np.mean(above[outward & speeding_up])), float(np.mean(above[outward & ~speeding_up]))
    figures = [
        Figure("through zero: mean of force over the steady curve while speeding up", faster, "1", ">= 0.01"),
        Figure("through zero: the same while slowing down", slower, "1", "<= -0.01"),
        Figure("through zero: both directions alike, of the range", 100.0 * odd, "%", "<= 3"),
        Figure("through zero: force left just before the velocity turns positive", at_zero, "1", "<= -1"),
    ]
    curves = [
        Curve(
            "steady", np.concatenate([-line[0][::-1], line[0]]), np.concatenate([-line[1][::-1], line[1]]), "true", "dot", 2.0
        ),
        Curve("v* = 2 sin(0.2 pi t*)", np.append(speed, speed[0]), np.append(force, force[0]), "after", width=1.6),
    ]
    plot = scatter_and_curves(None, curves, "v* [1]", "F_t* [1]")
    caption = "Through zero: at a reversal the asperities that touch relax and are stretched the other way, within a small way."
    return figures, (plot, caption)


def _run() -> Evidence:
    parts = [_lag(), _steps(), _through_zero()]
    notes = [
        "The paper's velocities and amplitudes aren't legible; frequencies are read as 0.5, 0.2 and 0.1 over tau, m* as 5.",
        "Steady curve: quadrature. A loop grows with frequency until a period is as short as the time in which contacts are "
        "renewed; beyond, around slow motion, it only gets flatter.",
    ]
    return Evidence([figure for figures, _ in parts for figure in figures], [plot for _, plot in parts], notes)


VERIFICATION = Verification(
    id="asperity-dynamics",
    title="Asperity model: lag, velocity steps, passage through zero velocity",
    source="Al-Bender, Lampaert, Swevers 2004, Secs. 10 to 12, Figs. 7 to 9; steady sliding by quadrature",
    run=_run,
)
