"""Two masses, compliances with one and several modes, and play, held against closed forms and an independent integration.

With a spring k and a damper c between m_m and m_l, in the frequency domain: v_m/v_l = 1 - m_l w^2/(k + j c w), whose real part
vanishes at the antiresonance sqrt(k/m_l), and u/(j w v_l) = m_m + m_l - m_m m_l w^2/(k + j c w), whose real part vanishes at
the resonance sqrt(k/m_m + k/m_l), both but for (c w/k)^2. Appendages add
m_i (w_i^2 + 2 zeta_i w_i s)/(s^2 + 2 zeta_i w_i s + w_i^2) to the body's mass.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from scipy.integrate import quad, solve_ivp

from ..figure import Figure
from ..model import Model, Term, build_model, term
from ..record import Array
from ..report.figures import Curve, scatter_and_curves, stacked
from ..simulation import Simulator
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

Spectrum = NDArray[np.complexfloating[Any, Any]]

_MOTOR, _LOAD, _SPRING, _DAMPER = 1.0, 3.0, 3.0e4, 2.0
_MODES = ((0.6, 14.0, 0.01), (0.3, 37.0, 0.02), (0.15, 81.0, 0.03))  # mass [kg], frequency [Hz], damping ratio
_STEP = 1e-4  # [s]


def _bed(*terms: Term, motor_coulomb: float = 0.0, motor_viscous: float = 0.0) -> Model:
    values = {"motor_mass": _MOTOR, "load_mass": _LOAD, "motor_coulomb": motor_coulomb, "motor_viscous": motor_viscous}
    return build_model("two_mass", values, terms)


def _response(model: Model, top: float, columns: Sequence[int]) -> tuple[Array, Spectrum]:
    """Angular frequencies [1/s] and complex response of the velocities in ``columns`` to the force, ``(n_columns, n)``.

    A multisine of 2 s period, repeated until the transient is gone; the half step by which a held force lags is taken out.
    """
    period = round(2.0 / _STEP)
    lines = np.arange(4, round(2.0 * top) + 1)
    phases = np.random.default_rng(1).uniform(0.0, 2.0 * np.pi, lines.shape[0])
    t = _STEP * np.arange(period)
    force = np.sum(np.cos(np.pi * lines[:, None] * t + phases[:, None]), axis=0)
    states, _ = Simulator(model).run(np.tile(force, 16), _STEP, 4)
    last = states[-period - 1 : -1]
    w = np.asarray(np.pi * lines, dtype=np.float64)
    spectrum = np.fft.rfft(last[:, list(columns)], axis=0)[lines].T / np.fft.rfft(force)[lines]
    # A held force is sin(x)/x of the wave at its middle, x = w h/2.
    held = np.exp(-0.5j * w * _STEP) * np.sinc(w * _STEP / (2.0 * np.pi))
    response: Spectrum = spectrum / held
    return w, response


def _crossing(w: Array, values: Array) -> float:
    """Frequency [1/s] at which ``values``, nearly linear in w^2, go through zero."""
    at = int(np.flatnonzero(values[:-1] * values[1:] < 0.0)[0])
    a, b = w[at] ** 2, w[at + 1] ** 2
    return math.sqrt(a - values[at] * (b - a) / (values[at + 1] - values[at]))


def _two_masses() -> tuple[list[Figure], tuple[go.Figure, str]]:
    w, (load, motor) = _response(_bed(term("compliance", stiffness=_SPRING, damping=_DAMPER)), 60.0, (1, 3))
    link = _SPRING + 1j * _DAMPER * w
    load_form = 1.0 / (1j * w * (_MOTOR + _LOAD - _MOTOR * _LOAD * w**2 / link))
    motor_form = load_form * (1.0 - _LOAD * w**2 / link)
    anti, resonance = math.sqrt(_SPRING / _LOAD), math.sqrt(_SPRING / _MOTOR + _SPRING / _LOAD)
    found = _crossing(w, (motor / load).real), _crossing(w, (1.0 / (1j * w * load)).real)
    figures = [
        Figure("antiresonance off sqrt(k/m_l)", abs(found[0] / anti - 1.0), "1", "<= 1e-3"),
        Figure("resonance off sqrt(k/m_m + k/m_l)", abs(found[1] / resonance - 1.0), "1", "<= 1e-3"),
        Figure("motor's response off the closed form, 4 to 60 Hz, RMS", _relative(motor, motor_form), "1", "<= 1e-3"),
        Figure("load's response off the closed form, 4 to 60 Hz, RMS", _relative(load, load_form), "1", "<= 1e-3"),
    ]
    f = w / (2.0 * np.pi)
    curves = [
        Curve("motor, simulated", f, _decibel(motor), "after", width=3.0),
        Curve("load, simulated", f, _decibel(load), "second", width=3.0),
        Curve("closed form", f, _decibel(motor_form), "true", "dot"),
        Curve("closed form ", f, _decibel(load_form), "true", "dot"),
    ]
    plot = scatter_and_curves(None, curves, "frequency [Hz]", "velocity per force [dB]", 360)
    return figures, (plot, "Two masses on a spring: the motor's response has an antiresonance, the load's has none.")


def _decibel(response: Spectrum) -> Array:
    result: Array = 20.0 * np.log10(np.abs(response))
    return result


def _relative(found: Spectrum, expected: Spectrum) -> float:
    return float(np.sqrt(np.mean(np.abs(found - expected) ** 2) / np.mean(np.abs(expected) ** 2)))


def _modes() -> tuple[list[Figure], tuple[go.Figure, str]]:
    terms = [term("compliance", "appendage", mass=m, frequency=f, damping=zeta) for m, f, zeta in _MODES]
    body = 2.0
    model = build_model(
        "pendulum", {"inertia": body, "proportional": 0.0, "derivative": 0.0, "gravity": 0.0, "start": 0.0}, terms
    )
    w, (found,) = _response(model, 120.0, (1,))
    s = 1j * w
    mass = np.full(w.shape, body, dtype=complex)
    for m, f, zeta in _MODES:
        own = 2.0 * np.pi * f
        mass += m * (own**2 + 2.0 * zeta * own * s) / (s**2 + 2.0 * zeta * own * s + own**2)
    expected = 1.0 / (s * mass)
    figures = [
        Figure("three modes: response off the closed form, 4 to 120 Hz, RMS", _relative(found, expected), "1", "<= 1e-3"),
        *_free_modes(body),
    ]
    hertz = w / (2.0 * np.pi)
    curves = [
        Curve("simulated", hertz, _decibel(found), "after", width=3.0),
        Curve("closed form", hertz, _decibel(expected), "true", "dot"),
        Curve(
            "rigid body of the whole mass",
            hertz,
            _decibel(1.0 / (s * (body + sum(m for m, _, _ in _MODES)))),
            "reference",
            "dash",
        ),
    ]
    plot = scatter_and_curves(None, curves, "frequency [Hz]", "velocity per force [dB]", 360)
    return figures, (plot, "Summed-mode compliance: a body with three vibrating appendages.")


def _free_modes(body: float) -> list[Figure]:
    """Momentum and energy of body and undamped appendages after a push."""
    terms = [term("compliance", "appendage", mass=m, frequency=f, damping=0.0) for m, f, _ in _MODES]
    model = build_model(
        "pendulum", {"inertia": body, "proportional": 0.0, "derivative": 0.0, "gravity": 0.0, "start": 0.0}, terms
    )
    simulator = Simulator(model)
    effort = np.zeros(20_000)
    effort[:30] = 10.0
    impulse = np.cumsum(effort) * _STEP
    energies, misses = [], []
    for k in range(200):
        part = effort[100 * k : 100 * k + 100]
        simulator.run(part, _STEP, 1)
        v = float(simulator.states[1])
        momentum, energy = body * v, 0.5 * body * v**2
        for number, (m, f, _) in enumerate(_MODES):
            r, speed = simulator.memory_of(number)[:2]
            momentum += m * float(speed)
            energy += 0.5 * m * float(speed) ** 2 + 0.5 * m * (2.0 * math.pi * f * float(r)) ** 2
        misses.append(momentum / float(impulse[100 * k + 99]) - 1.0)
        energies.append(energy)
    spread = float(np.max(np.abs(np.array(energies) / energies[0] - 1.0)))
    return [
        Figure("three modes: momentum off the impulse", float(np.max(np.abs(misses))), "1", "<= 1e-12"),
        Figure("three undamped modes: energy over 2 s, largest change", spread, "1", "<= 1e-6"),
    ]


def _hardening() -> list[Figure]:
    k, k_3, reach = _SPRING, 3.0e9, 5e-3
    mass = _MOTOR * _LOAD / (_MOTOR + _LOAD)
    simulator = Simulator(_bed(term("compliance", "hardening", stiffness=k, hardening=k_3, damping=0.0)))
    # Centre of mass at rest, deflection at its largest.
    simulator.states[:] = -reach * mass / _LOAD, 0.0, reach * mass / _MOTOR, 0.0
    states, _ = simulator.run(np.zeros(100_000), _STEP, 4)
    e = states[:, 2] - states[:, 0]
    rate = states[:, 3] - states[:, 1]
    up = np.flatnonzero((e[:-1] < 0.0) & (e[1:] >= 0.0))
    times = _STEP * (up + e[up] / (e[up] - e[up + 1]))
    period = float((times[-1] - times[0]) / (times.shape[0] - 1))

    def quarter(angle: float) -> float:
        # e = A sin(angle) takes the root of the energy integral away
        return 1.0 / math.sqrt(k + 0.5 * k_3 * reach**2 * (1.0 + math.sin(angle) ** 2))

    expected = 4.0 * math.sqrt(mass) * quad(quarter, 0.0, 0.5 * math.pi)[0]
    energy = 0.5 * mass * rate**2 + 0.5 * k * e**2 + 0.25 * k_3 * e**4
    linear = 2.0 * math.pi * math.sqrt(mass / k)
    return [
        Figure("hardening spring: period off the elliptic integral", abs(period / expected - 1.0), "1", "<= 1e-3"),
        Figure("hardening spring: period as a share of the linear one", period / linear, "1"),
        Figure(
            "hardening spring: energy over 10 s, largest change", float(np.max(np.abs(energy / energy[0] - 1))), "1", "<= 1e-9"
        ),
    ]


def _balance() -> list[Figure]:
    """What the motor gives is in the bodies and the spring, or gone into the load's friction; with play, slips and rests."""
    coulomb = 2.0
    model = _bed(term("compliance", stiffness=_SPRING), term("backlash", gap=2e-3), term("coulomb", force=coulomb))
    n = 40_000
    u = 6.0 * np.sin(2.0 * np.pi * 1.3 * _STEP * (np.arange(n) + 0.5))
    states, friction = Simulator(model).run(u, _STEP, 1)
    ways = np.diff(np.vstack([np.zeros(4), states]), axis=0)
    e = np.maximum(np.abs(states[:, 2] - states[:, 0]) - 1e-3, 0.0)
    held = 0.5 * _MOTOR * states[:, 3] ** 2 + 0.5 * _LOAD * states[:, 1] ** 2 + 0.5 * _SPRING * e**2
    given, taken = np.cumsum(u * ways[:, 2]), np.cumsum(coulomb * np.abs(ways[:, 0]))
    work = float(np.sum(np.abs(u * ways[:, 2])))
    rests = int(np.sum(ways[:, 0] == 0.0))
    return [
        Figure(
            "play, spring and dry friction: energy balance, of the work",
            float(np.max(np.abs(given - taken - held))) / work,
            "1",
            "<= 1e-6",
        ),
        Figure("steps in which the load rested exactly, of 40000", rests, "", ">= 100"),
        Figure("largest friction while it rested", float(np.max(np.abs(friction))), "N", f"<= {coulomb}"),
    ]


def _independent() -> Figure:
    k_3, c, c_m, c_l = 3.0e9, 20.0, 5.0, 8.0
    model = _bed(
        term("compliance", "hardening", stiffness=_SPRING, hardening=k_3, damping=c),
        term("viscous", coefficient=c_l),
        motor_viscous=c_m,
    )
    n = 10_000
    states, _ = Simulator(model).run(np.full(n, 30.0), _STEP)

    def right_side(t: float, y: Array) -> list[float]:
        q, v, x, w = y
        pull = _SPRING * (x - q) + k_3 * (x - q) ** 3 + c * (w - v)
        return [v, (pull - c_l * v) / _LOAD, w, (30.0 - pull - c_m * w) / _MOTOR]

    theirs = solve_ivp(right_side, (0.0, n * _STEP), np.zeros(4), method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    within = solve_ivp(right_side, (0.0, 0.1), np.zeros(4), method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    span = np.ptp(states, axis=0)
    off = max(float(np.max(np.abs(states[-1] - theirs) / span)), float(np.max(np.abs(states[999] - within) / span)))
    return Figure("hardening, damped, pushed: states off an independent integration", off, "of the range", "<= 1e-3")


def _play() -> tuple[list[Figure], tuple[go.Figure, str]]:
    gap, n = 2e-3, 40_000
    t = _STEP * np.arange(1, n + 1, dtype=np.float64)
    u = 12.0 * np.sin(2.0 * np.pi * 0.5 * t)
    friction = (term("coulomb", force=3.0), term("viscous", coefficient=400.0))
    plain = Simulator(_bed(term("backlash", gap=gap), *friction)).run(u, _STEP, 1)[0]
    elastic_stop = term("impact_backlash", gap=gap, stiffness=1e5, damping=50.0)
    elastic = Simulator(_bed(elastic_stop, *friction)).run(u, _STEP, 1)[0]
    e = plain[:, 2] - plain[:, 0]
    still = term("coulomb", force=50.0)
    held = Simulator(_bed(elastic_stop, still)).run(u, _STEP, 1)[0]
    figures = [
        Figure("plain backlash: width of the loop off the gap", abs(float(np.ptp(e)) / gap - 1.0), "1", "<= 1e-9"),
        Figure(
            "load under less than break-away, while the motor strikes it: way", float(np.max(np.abs(held[:, 0]))), "m", "== 0"
        ),
    ]
    first = slice(n // 2, n)
    curves = [
        Curve("with impact", 1e3 * elastic[first, 2], 1e3 * elastic[first, 0], "after"),
        Curve("plain backlash", 1e3 * plain[first, 2], 1e3 * plain[first, 0], "before", "dot"),
    ]
    plot = scatter_and_curves(None, curves, "motor [mm]", "load [mm]", 360)
    return figures, (
        plot,
        "Load over motor with 2 mm of backlash: the classical loop; the load rests while the motor crosses the gap.",
    )


def _chain() -> tuple[go.Figure, str]:
    n = 8000
    t = _STEP * np.arange(1, n + 1, dtype=np.float64)
    u = 12.0 * np.sign(np.sin(2.0 * np.pi * 2.5 * t))
    friction = (term("coulomb", force=3.0), term("viscous", coefficient=40.0))
    cases = (
        ("rigid", "reference", ()),
        ("compliance", "second", (term("compliance", stiffness=_SPRING, damping=10.0),)),
        ("backlash with impact", "after", (term("impact_backlash", gap=2e-3, stiffness=1e5, damping=20.0),)),
    )
    runs = [(name, colour, Simulator(_bed(*link, *friction)).run(u, _STEP)[0]) for name, colour, link in cases]
    panels = [
        ("motor [m/s]", [Curve(name, t, states[:, 3], colour) for name, colour, states in runs]),
        ("load [m/s]", [Curve(name, t, states[:, 1], colour) for name, colour, states in runs]),
    ]
    return stacked(panels, "time [s]"), "The test bed under a square wave of 12 N with three transmissions."


def _evidence() -> Evidence:
    masses, masses_plot = _two_masses()
    modes, modes_plot = _modes()
    play, play_plot = _play()
    notes = [
        "The responses are measured with a multisine, each value of which is held for 0.1 ms and calculated in four steps. What"
        " is left lies at the resonances, which the midpoint rule puts low by (w h)^2/12 of their frequency.",
    ]
    figures = [*masses, *modes, *_hardening(), *_balance(), *play, _independent()]
    return Evidence(figures, [masses_plot, modes_plot, play_plot, _chain()], notes)


VERIFICATION = Verification(
    id="transmission",
    title="Transmission: two masses, compliances, several modes, play",
    source="closed-form responses; elliptic integral; balance of energy; independent integration",
    run=_evidence,
)
