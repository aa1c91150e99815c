"""DNLRX: against the mechanical system that it stands for, its own inverse, and the paper's account of the force's steps."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import plotly.graph_objects as go
from scipy.integrate import solve_ivp
from scipy.signal import butter, filtfilt

from ..figure import Figure
from ..friction.dnlrx import DnlrxModel, DnlrxPredictor, DnlrxSimulator, from_mechanics
from ..friction.dnlrx_regression import deformations, from_coefficients, noe, regressors, sliding_start
from ..model import build_model, term
from ..record import Array
from ..report.figures import Curve, scatter_and_curves, stacked
from ..simulation import simulate
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_MASS, _DAMPING, _STIFFNESS = 1.2, 8.0, 50.0  # [kg], [N s/m], [N/m]
_SPRINGS = np.array([4e4, 2e4, 1e4, 5e3, 2e3])  # [N/m]
_THRESHOLDS = np.array([5e-6, 1e-5, 2e-5, 5e-5, 1e-4])  # [m]
_T = 1e-3  # [s]
# By the name that the paper would give them: M, n_delta, n. (5,0,3) tells the number of springs from the second filter.
_ORDERS = (("(5,3,3)", 5, 3, 3), ("(5,0,3)", 5, 0, 3), ("(10,0,3)", 10, 0, 3), ("(10,3,0)", 10, 3, 0))


def _mechanics(**changes: object) -> DnlrxModel:
    given = {"sample_time": _T} | changes
    return from_mechanics(_MASS, _DAMPING, _STIFFNESS, _SPRINGS.tolist(), _THRESHOLDS.tolist(), **given)  # type: ignore[arg-type]


def _against_closed_form() -> Figure:
    """A cosine whose turns fall on samples: its differences and Masing's branches between turns in closed form."""
    half = 500  # samples from turn to turn
    amplitude, omega = 1e-3, np.pi / (half * _T)
    k = np.arange(8 * half + 1)
    x = amplitude * np.cos(omega * _T * k)
    found = DnlrxPredictor(_mechanics(), position=amplitude).run(x)
    back = np.exp(-1j * omega * _T)  # what a delay of one sample does to exp(j omega t)
    speed = (1.5 - 2.0 * back + 0.5 * back**2) / _T
    acceleration = (1.0 - back) ** 2 / _T**2
    linear = np.real((_MASS * acceleration + _DAMPING * speed + _STIFFNESS) * amplitude * np.exp(1j * omega * _T * k))
    falling = (k // half) % 2 == 0
    way = np.where(falling, amplitude - x, x + amplitude)[:, None]  # since the last turn
    branch = np.minimum(way, 2.0 * _THRESHOLDS) - _THRESHOLDS
    closed = linear + np.where(falling, -1.0, 1.0) * (branch @ _SPRINGS)
    later = slice(2 * half + 2, None)  # by then all springs have slid
    error = float(np.max(np.abs(found[later] - closed[later]))) / float(np.ptp(closed))
    return Figure("force of the discretised system against its closed form, of the range", error, "1", "<= 1e-9")


def _against_integration() -> list[Figure]:
    """Its motion under a force, against the continuous system integrated at tight tolerance."""
    duration = 0.25

    def force(t: float | Array) -> float | Array:
        return np.asarray(3.0 * np.sin(2 * np.pi * 4.0 * t) + 1.5 * np.sin(2 * np.pi * 11.0 * t))

    def rate(t: float, y: Array) -> Array:
        x, v, delta = y[0], y[1], y[2:]
        slides = (np.abs(delta) >= _THRESHOLDS) & (delta * v > 0.0)
        a = (force(t) - _DAMPING * v - _STIFFNESS * x - _SPRINGS @ np.clip(delta, -_THRESHOLDS, _THRESHOLDS)) / _MASS
        return np.concatenate([[v, a], np.where(slides, 0.0, v)])

    at = np.linspace(0.0, duration, 26)
    exact = solve_ivp(rate, (0.0, duration), np.zeros(7), t_eval=at, rtol=1e-8, atol=1e-12, max_step=1e-4).y[0]
    errors = []
    for refined in (100, 200):
        step = (at[1] - at[0]) / refined
        t = step * np.arange(1, refined * 25 + 1)
        x = DnlrxSimulator(_mechanics(sample_time=step, order=4)).run(np.asarray(force(t)))
        errors.append(float(np.max(np.abs(np.append(0.0, x[refined - 1 :: refined]) - exact))) / float(np.ptp(exact)))
    return [
        Figure(
            "motion at 10 kHz (order 4) against an integration of the continuous system, of the range",
            errors[0],
            "1",
            "<= 1e-4",
        ),
        Figure("the same error at 10 kHz over that at 20 kHz", errors[0] / errors[1], "1", ">= 4"),
    ]


def _against_itself() -> Figure:
    """Force from motion, then motion from that force."""
    t = _T * np.arange(20_000)
    x = 1e-3 * np.sin(2 * np.pi * 0.7 * t) + 2e-4 * np.sin(2 * np.pi * 5.1 * t)
    worst = 0.0
    for order, damped in ((2, False), (4, False), (2, True)):
        model = _mechanics(order=order, spring_damping=(_SPRINGS * 2e-3).tolist() if damped else None)
        again = DnlrxSimulator(model).run(DnlrxPredictor(model).run(x))
        worst = max(worst, float(np.max(np.abs(again - x))) / float(np.ptp(x)))
    return Figure("motion from the force of a motion against that motion, 20,000 samples, of the range", worst, "1", "<= 1e-9")


def _memory() -> tuple[Figure, tuple[go.Figure, str]]:
    """Two inner loops on the rising branch of an outer one; multiples of 2^-20 m, so that nothing is rounded."""
    step = 2.0**-20
    thresholds = step * np.array([5.0, 10.0, 21.0, 52.0, 105.0])
    outer = [0, 400, -400]
    inner = [*outer, -330, -380, -250, -310, 400]
    curves = []
    ends = []
    for corners in ([*outer, 400], inner):
        parts = [np.arange(a, b, 1 if b > a else -1) for a, b in pairwise(corners)]
        x = step * np.append(np.concatenate(parts), corners[-1])
        friction = deformations(x, thresholds) @ _SPRINGS
        curves.append((1e6 * x, friction))
        ends.append(friction[-650:])  # from where the second loop closes
    off = float(np.max(np.abs(ends[0] - ends[1]))) / float(np.ptp(ends[0]))
    plot = scatter_and_curves(
        None,
        [Curve("with two inner loops", *curves[1], "after"), Curve("outer loop alone", *curves[0], "true", "dot")],
        "displacement [µm]",
        "friction [N]",
    )
    figure = Figure("off the outer curve after two inner loops, of the range", off, "1", "== 0")
    return figure, (
        plot,
        "Return-point memory of the deformations: after each inner loop the outer curve goes on as if it had not been.",
    )


def _steps_of_a_damper() -> tuple[list[Figure], tuple[go.Figure, str]]:
    """One spring with a damper in parallel on a motion of constant velocity: the force steps as the spring begins to slide."""
    v, stiffness, threshold, damping = 1e-3, 1e4, 2.05e-5, 100.0
    t = np.asarray(_T * np.arange(60), dtype=np.float64)
    with_damper = from_mechanics(0.0, 0.0, 0.0, [stiffness], [threshold], _T, spring_damping=[damping])
    without = from_mechanics(0.0, 0.0, 0.0, [stiffness], [threshold], _T)
    stepping = DnlrxPredictor(with_damper).run(v * t)
    smooth = DnlrxPredictor(without).run(v * t)
    slid = int(np.argmax(v * t >= threshold))
    fall = float(stepping[slid - 1] - stepping[slid + 1]) + stiffness * (threshold - v * float(t[slid - 1]))
    error = abs(fall - damping * v) / (damping * v)
    curves = [Curve("n_delta = 1", 1e3 * t, stepping, "before"), Curve("n_delta = 0", 1e3 * t, smooth, "after")]
    caption = (
        "A spring of 1e4 N/m that slides from 20.5 µm on, moved at 1 mm/s. With a second tap in the filter of its deformation "
        "(here a damper of 100 N s/m) the force falls by 0.1 N as it begins to slide; with one tap only its slope changes."
    )
    return [Figure("step as a spring begins to slide against v T sum j Theta_j, relative", error, "1", "<= 1e-9")], (
        scatter_and_curves(None, curves, "time [ms]", "force [N]", 320),
        caption,
    )


def _recording() -> tuple[Array, Array]:
    """Displacement [m] and force [N] of a guideway with GMS friction: 1 kHz, low-pass at 50 Hz as in the paper."""
    guideway = build_model(
        "rigid",
        {"mass": 1.0},
        [
            term("coulomb", force=2.0),
            term("viscous", coefficient=20.0),
            term("presliding", "gms", stiffness=2e5, attraction=200.0, damping=200.0),
        ],
    )
    generator = np.random.default_rng(3)
    n = 20_000
    t = _T * np.arange(n)
    force = sum(a * np.sin(2 * np.pi * f * t + p) for a, f, p in ((1.6, 0.4, 0.0), (1.5, 1.13, 1.0), (0.8, 2.9, 2.0)))
    force = np.asarray(force)
    position = simulate(guideway, force, _T).position + 1e-9 * generator.standard_normal(n)
    low_pass = butter(2, 50.0, fs=1.0 / _T)
    return filtfilt(*low_pass, position), filtfilt(*low_pass, force + 0.01 * generator.standard_normal(n))


def _identified() -> tuple[list[Figure], tuple[go.Figure, str]]:
    """Orders of the paper, fitted to the first half of a recording (thresholds given) and used on the second."""
    x, u = _recording()
    start = sliding_start(x)
    x, u = x[start.sample :], u[start.sample :]
    figures = []
    shown: dict[str, Array] = {}
    roughness: dict[str, float] = {}
    for name, n_springs, n_delta, n in _ORDERS:
        thresholds = np.geomspace(1e-6, 4e-5, n_springs)
        at = start.direction * thresholds
        rows = regressors(x, thresholds, n, n_delta, at)
        first = max(n, n_delta)
        half = rows.shape[0] // 2
        scale = np.linalg.norm(rows[:half], axis=0)
        fitted = np.linalg.lstsq(rows[:half] / scale, u[first : first + half], rcond=None)[0] / scale
        model = from_coefficients(fitted, thresholds, n, n_delta, _T)
        predicted = DnlrxPredictor(model, float(x[0]), at).run(x)[first + half :]
        measured = u[first + half :]
        rough = np.diff(predicted - measured)
        roughness[name] = float(np.max(np.abs(rough))) / float(np.ptp(measured))
        shown[name] = predicted
        figures.append(
            Figure(f"DNLRX {name}: NOE on the other half", noe(measured, predicted), "%", "" if n == 0 else "<= 1.33")
        )
        figures.append(
            Figure(f"DNLRX {name}: largest step of the force beside the measured one, of the range", roughness[name], "1")
        )
    ratio = roughness["(5,3,3)"] / roughness["(10,0,3)"]
    figures.append(Figure("steps of (5,3,3) over steps of (10,0,3)", ratio, "1", ">= 2"))
    worst = int(np.argmax(np.abs(np.diff(shown["(5,3,3)"] - measured))))
    part = slice(max(worst - 60, 0), worst + 60)
    t = np.asarray(_T * np.arange(measured.shape[0])[part], dtype=np.float64)
    plot = stacked(
        [
            ("force [N]", [Curve("measured", t, measured[part], "measured"), Curve(name, t, shown[name][part], colour)])
            for name, colour in (("(5,3,3)", "before"), ("(10,0,3)", "after"))
        ],
        "time [s]",
    )
    return figures, (
        plot,
        "Force predicted around the largest step of (5,3,3), as in the paper's Figs. 8 and 9: springs that begin to slide or "
        "stick again make (5,3,3) step, since its second filter has taps beside the first.",
    )


def _run() -> Evidence:
    memory, memory_plot = _memory()
    damper, damper_plot = _steps_of_a_damper()
    fitted, fitted_plot = _identified()
    figures = [_against_closed_form(), *_against_integration(), _against_itself(), memory, *damper, *fitted]
    notes = [
        "Eq. 13 is printed with + before the deformations on the right-hand side; Eqs. 8 and 12 give -, and only that agrees "
        "with Eq. 14. The c of g_j belongs to g_0 alone.",
        "(M, n_delta, n_x) is the order of the numbers: read as (M, n_x, n_delta), (10, 0, 3) has no way to express mass "
        "and damping, and it keeps the filter that makes the steps. That reading is shown as (10,3,0) "
        "here: its NOE and steps are worst.",
        "The goal of the NOE is the paper's 1.33 % on its validation data; thresholds are given here, not searched for.",
    ]
    return Evidence(figures, [memory_plot, damper_plot, fitted_plot], notes)


VERIFICATION = Verification(
    id="dnlrx",
    title="DNLRX: inverse model, simulator, and the steps of its second filter",
    source="Amthor et al. 2008, Eqs. 8-14, 17, 19 and Figs. 8, 9; closed forms; an integration of the continuous system",
    run=_run,
)
