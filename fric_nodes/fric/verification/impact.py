"""Backlash with impact, held against conservation laws, the derived restitution, and an integration from event to event.

The closed forms are typed here anew. For a stop that only pushes, with m the reduced mass and zeta = c/(2 sqrt(k m)):

    restitution exp(-2 zeta arccos(zeta)/sqrt(1 - zeta^2)), duration 2 arccos(zeta)/(w_0 sqrt(1 - zeta^2))

(arcosh and zeta^2 - 1 beyond zeta = 1), and for Hunt and Crossley's,
lambda v_0 (1 + r) = ln((1 + lambda v_0)/(1 - lambda r v_0)). The integration by an explicit method of high order knows none of
them: it ends where the force vanishes.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable

import numpy as np
import plotly.graph_objects as go
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from ..figure import Figure
from ..model import Model, Term, build_model, term
from ..record import Array
from ..report.figures import Curve, scatter_and_curves, stacked
from ..simulation import Simulator, substeps
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_MOTOR, _LOAD = 1.0, 3.0  # [kg]
_REDUCED = _MOTOR * _LOAD / (_MOTOR + _LOAD)
_STIFFNESS = 1e5  # [N/m]
_SPEED = 0.2  # [m/s], of the motor towards the resting load
_RATE = math.sqrt(_STIFFNESS / _REDUCED)
_ZETAS = (0.0, 0.01, 0.03, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9, 1.0, 1.3, 2.0, 4.0)
_SAMPLE = 1e-4  # [s]


def _model(stop: Term, motor_coulomb: float = 0.0, terms: tuple[Term, ...] = ()) -> Model:
    values = {"motor_mass": _MOTOR, "load_mass": _LOAD, "motor_coulomb": motor_coulomb, "motor_viscous": 0.0}
    return build_model("two_mass", values, [stop, *terms])


def _viscoelastic(zeta: float, gap: float) -> Model:
    damping = 2.0 * zeta * math.sqrt(_STIFFNESS * _REDUCED)
    return _model(term("impact_backlash", "viscoelastic", gap=gap, stiffness=_STIFFNESS, damping=damping))


def _hunt_crossley(damping: float, gap: float) -> Model:
    return _model(term("impact_backlash", "hunt_crossley", gap=gap, stiffness=_STIFFNESS, damping=damping))


def _run(
    model: Model, n: int, speed: float = _SPEED, start: float = 0.0, sample: float = _SAMPLE, n_sub: int | None = None
) -> Array:
    """States (load, load velocity, motor, motor velocity), ``(n + 1, 4)``; the motor starts ``start`` [m] ahead of the load."""
    simulator = Simulator(model)
    simulator.states[:] = 0.0, 0.0, start, speed
    before = simulator.states.copy()
    states, _ = simulator.run(np.zeros(n), sample, n_sub)
    return np.vstack([before, states])


def _restitution(states: Array) -> float:
    return float(-(states[-1, 3] - states[-1, 1]) / (states[0, 3] - states[0, 1]))


def _once(model: Model, gap: float, speed: float = _SPEED) -> float:
    """Restitution of one impact; the gap is wide enough for one only."""
    return _restitution(_run(model, 300, speed, 0.5 * gap - 3.3 * speed * _SAMPLE))


def _phase(zeta: float) -> float:
    """arccos(zeta)/sqrt(1 - zeta^2) through the complex plane."""
    return 1.0 if zeta == 1.0 else abs(cmath.acos(zeta)) / abs(cmath.sqrt(1.0 - zeta * zeta))


def _closed(zeta: float) -> float:
    return math.exp(-2.0 * zeta * _phase(zeta))


def _implicit(d: float) -> float:
    """Hunt and Crossley's restitution for lambda v_0 = ``d``."""

    def excess(r: float) -> float:
        return d * (1.0 + r) - math.log((1.0 + d) / (1.0 - d * r))

    return float(brentq(excess, 1e-9, min(1.0, (1.0 - 1e-12) / d), xtol=1e-15))


def _integrated(law: Callable[[float, float], float], speed: float) -> tuple[float, float]:
    """Restitution and duration of one impact with the force ``law(a, da/dt)``, until it vanishes."""

    def right_side(t: float, y: Array) -> list[float]:
        return [y[1], -law(y[0], y[1]) / _REDUCED]

    def ends(t: float, y: Array) -> float:
        return law(y[0], y[1]) if t > 1e-9 else 1.0

    ends.terminal = True  # type: ignore[attr-defined]
    ends.direction = -1.0  # type: ignore[attr-defined]
    found = solve_ivp(
        right_side, (0.0, 1.0), [1e-30, speed], method="DOP853", rtol=1e-12, atol=1e-15, events=ends, max_step=1e-3
    )
    return float(-found.y[1, -1] / speed), float(found.t[-1])


def _kelvin_voigt(damping: float) -> Callable[[float, float], float]:
    return lambda a, v: _STIFFNESS * a + damping * v


def _hunted(damping: float) -> Callable[[float, float], float]:
    return lambda a, v: _STIFFNESS * a * (1.0 + damping * v)


def _momentum(states: Array) -> float:
    total = _MOTOR * states[:, 3] + _LOAD * states[:, 1]
    return float(np.max(np.abs(total / total[0] - 1.0)))


def _compression(states: Array, gap: float) -> Array:
    result: Array = np.maximum(np.abs(states[:, 2] - states[:, 0]) - 0.5 * gap, 0.0)
    return result


def _energy(states: Array, gap: float) -> Array:
    result: Array = (
        0.5 * _MOTOR * states[:, 3] ** 2 + 0.5 * _LOAD * states[:, 1] ** 2 + 0.5 * _STIFFNESS * _compression(states, gap) ** 2
    )
    return result


def _impacts(states: Array, gap: float) -> int:
    apart = _compression(states, gap) == 0.0
    return int(np.sum(apart[:-1] & ~apart[1:]))


def _force(states: Array, sample: float) -> Array:
    """Force on the load, mean over each step, from the momentum that it takes."""
    result: Array = _LOAD * np.diff(states[:, 1]) / sample
    return result


def _duration(zeta: float, sample: float = 5e-6) -> float:
    """How long the sides push on each other in the simulation [s]."""
    gap, early = 0.1, 10.5 * sample
    states = _run(_viscoelastic(zeta, gap), 4000, start=0.5 * gap - _SPEED * early, sample=sample, n_sub=1)
    force = _force(states, sample)
    last = int(np.flatnonzero(force > 0.0)[-1])
    # The step in which the force ends is only partly under force: its end is where the line through the two before it leads.
    one, two = force[last - 2], force[last - 1]
    return float((last - 0.5 + two / (one - two)) * sample - early)


def _conservation() -> list[Figure]:
    gap = 1e-3
    elastic = _run(_viscoelastic(0.0, gap), 400_000)
    damped = _run(_viscoelastic(0.02, gap), 20_000)
    crossley = _run(_hunt_crossley(0.5, gap), 20_000)
    plastic = _run(_model(term("backlash", gap=gap)), 1000)
    energy = _energy(elastic, gap)
    lost = 1.0 - float(_energy(plastic, gap)[-1] / energy[0])
    common = _MOTOR * _SPEED / (_MOTOR + _LOAD)
    passive = max(float(np.max(np.diff(_energy(each, gap)))) for each in (damped, crossley)) / energy[0]
    return [
        Figure("momentum over elastic impacts: largest change", _momentum(elastic), "1", "<= 1e-12"),
        Figure("momentum over damped impacts: largest change", _momentum(damped), "1", "<= 1e-12"),
        Figure("momentum over Hunt-Crossley impacts: largest change", _momentum(crossley), "1", "<= 1e-12"),
        Figure("momentum over a plastic impact: largest change", _momentum(plastic), "1", "<= 1e-12"),
        Figure("elastic impacts in the run", _impacts(elastic, gap), "", ">= 1000"),
        Figure("energy without damping over these impacts: largest change", _spread(energy), "1", "<= 1e-6"),
        Figure("damped impacts: largest gain of energy in any step", max(passive, 0.0), "1", "<= 1e-14"),
        Figure("plain backlash: restitution", abs(_restitution(plastic)), "1", "== 0"),
        Figure("plain backlash: common velocity off the momentum's", abs(plastic[-1, 3] / common - 1.0), "1", "<= 1e-12"),
        Figure("plain backlash: energy lost off m v_0^2/2", abs(lost / (_REDUCED / _MOTOR) - 1.0), "1", "<= 1e-12"),
    ]


def _spread(energy: Array) -> float:
    return float(np.max(np.abs(energy / energy[0] - 1.0)))


def _laws() -> tuple[list[Figure], list[tuple[go.Figure, str]]]:
    gap = 0.1
    found = np.array([_once(_viscoelastic(zeta, gap), gap) for zeta in _ZETAS])
    expected = np.array([_closed(zeta) for zeta in _ZETAS])
    damping = [2.0 * zeta * math.sqrt(_STIFFNESS * _REDUCED) for zeta in _ZETAS]
    integrated = np.array([_integrated(_kelvin_voigt(c), _SPEED) for c in damping])
    periods = np.array([_duration(zeta) for zeta in _ZETAS])
    durations = np.array([2.0 * _phase(zeta) / _RATE for zeta in _ZETAS])
    hits = np.array([0.05, 0.2, 0.5, 1.0, 2.0, 5.0])  # lambda v_0
    crossley = np.array([_once(_hunt_crossley(d / _SPEED, gap), gap) for d in hits])
    implicit = np.array([_implicit(d) for d in hits])
    soft = np.array([_integrated(_hunted(d / _SPEED), _SPEED)[0] for d in hits.tolist()])
    figures = [
        Figure("restitution at 13 dampings, 0 to 4 times critical: off the derived", _off(found, expected), "1", "<= 1e-3"),
        Figure("the derived restitution off the integration", _off(expected, integrated[:, 0]), "1", "<= 1e-9"),
        Figure("duration of the impact: off the derived", _off(periods, durations), "1", "<= 1e-3"),
        Figure("the derived duration off the integration", _off(durations, integrated[:, 1]), "1", "<= 1e-6"),
        Figure("duration without damping off pi sqrt(m/k)", abs(periods[0] * _RATE / math.pi - 1.0), "1", "<= 1e-4"),
        Figure("Hunt-Crossley, 6 closing speeds: restitution off the derived", _off(crossley, implicit), "1", "<= 1e-3"),
        Figure("its derived restitution off the integration", _off(implicit, soft), "1", "<= 1e-9"),
        *(Figure(f"restitution at zeta = {zeta:g}", found[_ZETAS.index(zeta)], "1") for zeta in (0.01, 0.1, 0.5, 1.0)),
        Figure("steps per sample of 0.1 ms that the model chose", substeps(_viscoelastic(0.1, gap), _SAMPLE), ""),
    ]
    fine = np.linspace(0.0, 4.0, 401)
    held = np.array([math.exp(-math.pi * z / math.sqrt(1.0 - z * z)) if z < 1.0 else 0.0 for z in fine])
    curves = [
        Curve("derived: parts where the force vanishes", fine, np.array([_closed(z) for z in fine]), "after"),
        Curve("held together until the compression vanishes", fine, held, "before", "dot"),
    ]
    over_speed = np.linspace(0.01, 5.0, 200)
    law = [Curve("derived", over_speed, np.array([_implicit(d) for d in over_speed]), "after")]
    plots = [
        (
            _with_marks(curves, np.array(_ZETAS), found, "damping zeta = c/(2 sqrt(k m)) [1]"),
            "Restitution over damping. Sides that can't pull on each other part earlier, and rebound more, than the common"
            " formula exp(-pi zeta/sqrt(1 - zeta^2)) has it; beyond critical damping they still rebound.",
        ),
        (
            _with_marks(law, hits, crossley, "closing speed times damping, lambda v_0 [1]"),
            "Restitution over closing speed after Hunt and Crossley: hard blows rebound less.",
        ),
    ]
    return figures, plots


def _off(found: Array, expected: Array) -> float:
    return float(np.max(np.abs(found / expected - 1.0)))


def _with_marks(curves: list[Curve], x: Array, y: Array, label: str) -> go.Figure:
    plot = scatter_and_curves(None, curves, label, "restitution [1]", 360)
    plot.add_trace(go.Scatter(x=x, y=y, mode="markers", name="simulated", marker={"size": 8, "color": "#1d2733"}))
    return plot


def _pictures() -> list[tuple[go.Figure, str]]:
    sample = 2e-5
    colours = {0.0: "before", 0.1: "after", 0.5: "second", 2.0: "reference"}
    blows = []
    for zeta, colour in colours.items():
        states = _run(_viscoelastic(zeta, 0.1), 500, start=0.05, sample=sample, n_sub=1)
        time = 1e3 * sample * (np.arange(500) + 0.5)
        blows.append(Curve(f"zeta = {zeta:g}", np.asarray(time), _force(states, sample), colour))
    gap, n = 1e-3, 4000
    t = _SAMPLE * np.arange(n + 1, dtype=np.float64)
    loose = _run(_viscoelastic(0.05, gap), n)
    rigid = _run(_model(term("backlash", gap=gap)), n)
    motion = [
        (
            "y - q [mm]",
            [
                Curve("impact, zeta = 0.05", t, 1e3 * (loose[:, 2] - loose[:, 0]), "after"),
                Curve("plain backlash", t, 1e3 * (rigid[:, 2] - rigid[:, 0]), "before"),
            ],
        ),
        (
            "motor [m/s]",
            [Curve("impact, zeta = 0.05", t, loose[:, 3], "after"), Curve("plain backlash", t, rigid[:, 3], "before")],
        ),
    ]
    return [
        (stacked([("force [N]", blows)], "time since contact [ms]", 320), "The force of one impact at four dampings."),
        (stacked(motion, "time [s]"), "Motor and load in a gap of 1 mm: with rebound, and with plastic stops."),
    ]


def _evidence() -> Evidence:
    laws, plots = _laws()
    notes = [
        "The sides of a gap can't pull, so an impact ends where the force vanishes and not where the compression does: it lasts"
        " 2 arccos(zeta)/w_d, which is pi/w_d only without damping. The slides give no formula.",
        "The damping of the stop is the parameter and not the restitution, since the restitution depends on both masses too;"
        " fric.effects.impact_backlash.damping_for gives the one from the other.",
    ]
    return Evidence([*_conservation(), *laws], [*plots, *_pictures()], notes)


VERIFICATION = Verification(
    id="impact",
    title="Backlash with elastic-dissipative impact",
    source="conservation of momentum and energy; closed forms typed anew; integration from event to event",
    run=_evidence,
)
