"""Verification of static maps on simulated experiments whose truth is known: closed forms with noise, ripple and drift.

Ladder: constant velocities, force from the curve with a ripple of the screw, autoregressive noise and a scatter from run to
run. Loops: after a reversal at constant level g bristles give F = g (1 - 2 exp(-sigma d/g)), d = d_c + F/k_r with a rig in
series. Break-away: a force that rises slowly until the joint slides. Stick-slip: slips v = V sin^2(pi t/T) with one friction
while speeding up and another while slowing down. Nothing of it is computed by the laws or integrators that the method's model
uses.
"""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from ..figure import Figure
from ..identification.methods.static_map import static_map
from ..identification.result import Options
from ..identification.start import start_model
from ..identification.static_maps.curve import Points, choose
from ..identification.static_maps.presliding import SHARE
from ..identification.static_maps.result import StaticMap
from ..record import Array, Record, Units
from ..report.figures import Curve, scatter_and_curves
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_SPEEDS = np.geomspace(0.002, 0.2, 11)
_COULOMB, _SURPLUS, _STRIBECK, _VISCOUS, _BIAS = 5.0, 1.2, 0.01, 12.0, 0.7
_SCATTER = 0.08
_REPEATS = 100
_LEVELS = (2.0, 4.0, 6.0)  # friction at three loads [N]
_DISTANCE = 40e-6  # of the contact, the same at every load [m]
_RIG = 2.5e5  # [N/m]
_MASS = 0.5


def _truth(velocity: Array, surplus: float) -> Array:
    level = _COULOMB + surplus * np.exp(-((velocity / _STRIBECK) ** 2))
    return np.asarray(np.sign(velocity) * level + _VISCOUS * velocity + _BIAS, dtype=np.float64)


def _coloured(rng: np.random.Generator, n: int, size: float, rho: float = 0.9) -> Array:
    from scipy.signal import lfilter

    white = rng.standard_normal(n + 200)
    return np.asarray(size * np.sqrt(1.0 - rho**2) * lfilter([1.0], [1.0, -rho], white)[200:], dtype=np.float64)


def _ladder(rng: np.random.Generator, surplus: float) -> list[Record]:
    """One recording per velocity and direction, 600 samples each."""
    records = []
    for velocity in np.concatenate([_SPEEDS, -_SPEEDS]).tolist():
        time: Array = 0.005 * np.arange(600, dtype=np.float64)
        position = velocity * time
        ripple = 0.3 * np.sin(2.0 * np.pi * position / 0.004 + rng.uniform(0.0, 2.0 * np.pi))
        force = _truth(np.array([velocity]), surplus)[0] + ripple + _coloured(rng, 600, 0.25) + _SCATTER * rng.standard_normal()
        records.append(
            Record(time, position, force, velocity=velocity * (1.0 + 0.01 * rng.standard_normal(600)), source=f"{velocity:g}")
        )
    return records


def _points(rng: np.random.Generator, surplus: float) -> Points:
    """The means of a ladder, with honest errors, and a scatter from run to run that they don't show."""
    velocity = np.concatenate([_SPEEDS, -_SPEEDS])
    error: Array = np.asarray(0.05 * rng.uniform(0.7, 1.4, velocity.shape[0]), dtype=np.float64)
    force = _truth(velocity, surplus) + np.hypot(error, _SCATTER) * rng.standard_normal(velocity.shape[0])
    return Points(velocity, force, error)


def _loop(rng: np.random.Generator, level: float, load: float) -> Record:
    """Triangular strokes at constant speed, measured behind a rig; the way is that of the contact plus F/k_r."""
    stroke, step, speed = 600e-6, 1e-3, 200e-6
    n = round(stroke / speed / step)
    sigma = np.log(10.0) * level / _DISTANCE
    way, force = [], []
    for k in range(14):
        sign = 1.0 if k % 2 == 0 else -1.0
        # The contact's way at which both together have gone the measured one: a monotone function, tabulated.
        own = np.concatenate([[0.0], np.geomspace(1e-9, stroke, 4000)])
        change = 2.0 * level * (1.0 - np.exp(-sigma * own / level))
        measured = own + change / _RIG
        d = speed * step * np.arange(n)
        f = np.interp(d, measured, change)
        way.append(d if sign > 0 else stroke - d)
        force.append(sign * (f - level))
    effort = np.concatenate(force) + _coloured(rng, 14 * n, 0.02, 0.5)
    time: Array = step * np.arange(effort.shape[0], dtype=np.float64)
    position = np.concatenate(way) + 2e-8 * rng.standard_normal(effort.shape[0])
    return Record(time, position, effort, extra={"normal_load": np.full(effort.shape[0], load)}, source=f"load {load:g}")


def _stick_slip(rng: np.random.Generator) -> Record:
    """Forty slips forward with friction 3 + 2 v while speeding up and 2.6 + 2 v while slowing down."""
    step, slip, rest, top = 1e-4, 0.06, 0.2, 0.08
    one, wait = np.arange(round(slip / step)) * step, np.full(round(rest / step), 0.0)
    v_slip = top * np.sin(np.pi * one / slip) ** 2
    a_slip = top * np.pi / slip * np.sin(2.0 * np.pi * one / slip)
    f_slip = np.where(a_slip >= 0.0, 3.0, 2.6) + 2.0 * v_slip + _MASS * a_slip
    velocity = np.tile(np.concatenate([wait, v_slip]), 40)
    acceleration = np.tile(np.concatenate([wait, a_slip]), 40) + 0.05 + 0.03 * rng.standard_normal(velocity.shape[0])
    ramp = np.linspace(2.4, 3.0, wait.shape[0])
    force = np.tile(np.concatenate([ramp, f_slip]), 40) + 0.01 * rng.standard_normal(velocity.shape[0])
    time: Array = step * np.arange(velocity.shape[0], dtype=np.float64)
    return Record(time, step * np.cumsum(velocity), force, extra={"acceleration": acceleration}, source="stick-slip")


def _mapped(records: list[Record], mass: float = 1.0) -> StaticMap:
    return static_map(start_model(["coulomb"], "axis", Units()).with_value("mass", mass), records, Options())


def _decisions(rng: np.random.Generator) -> tuple[float, float, float]:
    """Share of ladders with a Stribeck effect in which it is found, without in which it is, and coverage of 90 % intervals."""
    hits = false = inside = asked = 0
    at = np.concatenate([np.geomspace(0.02, 0.18, 4), -np.geomspace(0.02, 0.18, 4)])
    for _ in range(_REPEATS):
        for surplus in (_SURPLUS, 0.0):
            choice = choose(_points(rng, surplus))
            there = bool(choice.best.candidate.stribeck)
            hits += there and surplus > 0.0
            false += there and surplus == 0.0
            off = np.abs(choice.best.force(at) - _truth(at, surplus))
            inside += int(np.sum(off <= choice.best.half_width(at, 0.9)))
            asked += at.shape[0]
    return hits / _REPEATS, false / _REPEATS, inside / asked


def run() -> Evidence:
    """Find the evidence."""
    rng = np.random.default_rng(7)
    hits, false, coverage = _decisions(rng)
    whole = _mapped(_ladder(rng, _SURPLUS))
    plain = _mapped(_ladder(rng, 0.0))
    loops = _mapped([_loop(rng, level, 50.0 * level) for level in _LEVELS])
    single = _mapped([_loop(rng, 4.0, 200.0)])
    slips = _mapped([_stick_slip(rng)], _MASS)
    assert loops.compliance is not None
    assert loops.loads is not None
    assert loops.loads.line is not None
    assert single.compliance is not None
    assert whole.choice is not None
    assert plain.choice is not None
    least = single.presliding[0].least(max(each.steepest for each in single.presliding))
    branch = slips.slips[0]
    up, down = 3.0 + 2.0 * branch.speed, 2.6 + 2.0 * branch.speed
    off = max(float(np.max(np.abs(branch.rising - up))), float(np.max(np.abs(branch.falling - down))))
    figures = [
        Figure("ladders with a Stribeck effect in which it is found", hits, "1", ">= 0.95"),
        Figure("ladders without in which one is found", false, "1", "<= 0.03"),
        Figure("coverage of the 90 % intervals of the chosen curve", coverage, "1", ">= 0.85"),
        Figure("the same, not too wide", coverage, "1", "<= 0.95"),
        Figure("from recordings: Stribeck chosen where it is", float(bool(whole.choice.best.candidate.stribeck)), "1", "== 1"),
        Figure(
            "from recordings: Stribeck chosen where it isn't", float(bool(plain.choice.best.candidate.stribeck)), "1", "== 0"
        ),
        Figure("Coulomb level, off 5 N", abs(whole.model.value("coulomb.force") - _COULOMB), "N", "<= 0.15"),
        Figure(
            "viscous coefficient, off 12 N s/m", abs(plain.model.value("viscous.coefficient") - _VISCOUS), "N s/m", "<= 1.5"
        ),
        Figure("bias, off 0.7 N", abs(whole.model.value("bias.force") - _BIAS), "N", "<= 0.1"),
        Figure("rig told apart under three loads", float(loops.compliance.told_apart), "1", "== 1"),
        Figure("rig's compliance against 1/k_r", abs(loops.compliance.compliance[0] * _RIG - 1.0), "1", "<= 0.1"),
        Figure("contact's own distance against 40 um", abs(loops.compliance.distance[0] / _DISTANCE - 1.0), "1", "<= 0.1"),
        Figure("friction per load against 0.02", abs(loops.loads.line.slope[0] / 0.02 - 1.0), "1", "<= 0.02"),
        Figure("one load: told apart", float(single.compliance.told_apart), "1", "== 0"),
        Figure("one load: the contact's least distance, over the truth", least / _DISTANCE, "1", "<= 1"),
        Figure("stick-slip branches, largest deviation", off, "N", "<= 0.06"),
        Figure("stick-slip loop, off 0.4 N", abs(branch.loop[0] - 0.4), "N", "<= 0.02"),
        Figure("break-away of the slips, off 3 N", abs(branch.break_away[0] - 3.0), "N", "<= 0.05"),
    ]
    return Evidence(figures, _plots(whole, loops), _NOTES)


_NOTES = (
    "Szell's Sec. 4.2 integrates the acceleration of single slips; the accelerometer's offset is removed here by the rest "
    "before and after each slip.",
    "Rig and contact are told apart on the assumption that the contact's own distance doesn't depend on the load.",
)


def _plots(whole: StaticMap, loops: StaticMap) -> list[tuple[go.Figure, str]]:
    assert whole.choice is not None
    speed = np.geomspace(0.001, 0.2, 200)
    curves = [
        Curve("true", speed, _truth(speed, _SURPLUS), "true", "dash", 2.0),
        Curve("chosen", speed, whole.choice.best.force(speed), "after", "solid", 2.0),
    ]
    forward = [mean for mean in whole.means if mean.direction > 0]
    cloud = ("settled parts", np.array([m.velocity for m in forward]), np.array([m.friction for m in forward]))
    curve = scatter_and_curves(cloud, curves, "velocity [m/s]", "force [N]", 340)
    curve.update_traces(marker={"size": 7}, selector={"mode": "markers"})
    assert loops.compliance is not None
    change = np.linspace(0.0, 12.0, 50)
    line = loops.compliance.distance[0] + SHARE * loops.compliance.compliance[0] * change
    lines = [
        Curve("true", change, 1e6 * (_DISTANCE + SHARE * change / _RIG), "true", "dash", 2.0),
        Curve("found", change, 1e6 * line, "after", "solid", 2.0),
    ]
    dots = (
        "reversals, means",
        np.array([each.change[0] for each in loops.presliding]),
        1e6 * np.array([each.distance[0] for each in loops.presliding]),
    )
    rig = scatter_and_curves(dots, lines, "change of force [N]", "break-away distance [um]", 340)
    rig.update_traces(marker={"size": 7}, selector={"mode": "markers"})
    return [
        (curve, "A ladder of simulated recordings: the curve chosen and the true one."),
        (rig, "Break-away distance under three loads: what grows with the force is the rig's."),
    ]


VERIFICATION = Verification(
    id="static-maps",
    title="Static maps",
    source="closed forms: Stribeck curve, bristles at constant level behind a spring, slips of two branches (Szell, Sec. 4.2)",
    run=run,
)
