"""Clean recordings of ordinary tests: ramps, steps, sines, moves, holds against gravity, one direction, short ones.

A body with friction, stepped after Moreau: with the free velocity v* = v + h/m (u - c v - G(q)), the friction force is the
one that brings it to rest, at most F(v) = F_C + F_S exp(-(v/v_S)^2). G is a constant (a vertical axis) or G sin q (an arm).
It shares no code with :mod:`fric.simulation`. Each seed draws the axis, the motion, the controller (PD or PID, its own
rate, with or without the gravity's force known), the encoder, the force signal (command or measurement, noise, steps), and
which signals are recorded. Nothing is wrong with any of these recordings: a fault that a check finds in one is a false one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numba
import numpy as np

from ...model import Model, build_model, term
from ...record import Array, Record, Units

__all__ = ["KINDS", "Ordinary", "ordinary"]

_RATES = (80.0, 100.0, 125.0, 200.0, 250.0, 400.0, 500.0, 1000.0, 1000.0, 2000.0, 4000.0, 5000.0)  # [Hz] of the log
_FINEST = 1e-4  # [s] step of the simulation, at most
_CONTROL = 1000.0  # [Hz] of the controller, at least
_PER_PERIOD = 16.0  # samples of the log in a period of the controller's bandwidth, at least: else it isn't a clean recording
_MOST = 60_000  # samples of a recording, at most

Random = np.random.Generator


@dataclass(frozen=True, eq=False)
class Ordinary:
    """A clean recording.

    Attributes:
        record: what was recorded.
        model: mass and friction of the axis as a maker would state them, up to 15 % off.
        kind: of the test.
        gravity: force that holds it [F]; 0 for a level axis.
    """

    record: Record
    model: Model
    kind: str
    gravity: float


@dataclass(frozen=True)
class _Axis:
    """What is moved: mass, friction (Coulomb, Stribeck surplus and speed, viscous), gravity, whether it is an arm."""

    mass: float
    coulomb: float
    surplus: float
    stribeck: float
    viscous: float
    gravity: float
    arm: bool


@dataclass(frozen=True)
class _Plan:
    """How it is moved: what is wanted, by time; whether that is a force; typical speed [x/s]; duration [s]."""

    wanted: Callable[[Array], Array]
    force: bool
    duration: float


def _between(random: Random, low: float, high: float) -> float:
    """Drawn evenly on a logarithmic scale."""
    return math.exp(random.uniform(math.log(low), math.log(high)))


def _moves(times: Array, places: Array, smooth: bool) -> Callable[[Array], Array]:
    """Moves from place to place, each from an even to the next odd time, at constant speed or along a quintic."""

    def wanted(time: Array) -> Array:
        k = np.clip(np.searchsorted(times[::2], time, side="right") - 1, 0, times.shape[0] // 2 - 1)
        share = np.clip((time - times[2 * k]) / (times[2 * k + 1] - times[2 * k]), 0.0, 1.0)
        share = np.where(time < times[0], 0.0, share)
        part = share**3 * (10.0 - 15.0 * share + 6.0 * share**2) if smooth else share
        return np.asarray(places[k] + (places[k + 1] - places[k]) * part)

    return wanted


def _schedule(random: Random, places: Array, move: float, rest: float, smooth: bool) -> _Plan:
    n = places.shape[0] - 1
    spans = np.empty(2 * n)
    spans[::2] = rest * random.uniform(0.5, 1.5, n) if rest else 0.0
    spans[0] = 0.2 * move
    spans[1::2] = move * random.uniform(0.7, 1.4, n)
    times = np.cumsum(spans)
    return _Plan(_moves(times, places, smooth), False, float(times[-1]) + (rest or 0.0))


def _ramp(random: Random, travel: float, move: float) -> _Plan:
    return _schedule(random, np.array([0.0, travel]), 3.0 * move, 0.5 * move, False)


def _triangle(random: Random, travel: float, move: float) -> _Plan:
    return _schedule(
        random, np.asarray(travel * (np.arange(int(random.integers(4, 10))) % 2), dtype=np.float64), move, 0.0, False
    )


def _steps(random: Random, travel: float, move: float) -> _Plan:
    n = int(random.integers(3, 9))
    up = np.linspace(0.0, travel, n)
    places = (
        np.concatenate([up, up[-2::-1]]) if random.uniform() < 0.6 else np.concatenate([[0.0], travel * random.uniform(size=n)])
    )
    return _schedule(random, places, 2e-3, move, False)


def _sine(random: Random, travel: float, move: float) -> _Plan:
    rate, phase = math.pi / move, float(random.choice([0.0, 0.5 * math.pi]))
    duration = float(random.uniform(3.0, 12.0)) * 2.0 * move
    return _Plan(lambda time: np.asarray(0.5 * travel * (np.sin(rate * time + phase) - math.sin(phase))), False, duration)


def _point_to_point(random: Random, travel: float, move: float) -> _Plan:
    n = int(random.integers(4, 14))
    places = np.concatenate([[0.0], travel * random.uniform(-0.5, 0.5, n)])
    return _schedule(random, places, move, float(random.uniform(0.1, 1.0)) * move, random.uniform() < 0.7)


def _two_places(random: Random, travel: float, move: float) -> _Plan:
    places = np.asarray(travel * (np.arange(int(random.integers(3, 9))) % 2), dtype=np.float64)
    return _schedule(random, places, move, float(random.uniform(0.3, 3.0)) * move, random.uniform() < 0.7)


def _holds(random: Random, travel: float, move: float) -> _Plan:
    n = int(random.integers(2, 7))
    places = np.concatenate([[0.0], travel * random.choice([0.0, 0.3, 0.6, 1.0], n)])
    places[1] = travel
    return _schedule(random, places, move, float(random.uniform(0.5, 3.0)), random.uniform() < 0.5)


def _held(random: Random, travel: float, move: float) -> _Plan:
    return _schedule(random, np.array([0.0, 0.0]), move, 3.0 * move, True)


def _one_way(random: Random, travel: float, move: float) -> _Plan:
    n = int(random.integers(3, 8))
    places = np.concatenate([[0.0], np.cumsum(random.uniform(0.2, 1.0, n))])
    rest = 0.0 if random.uniform() < 0.5 else float(random.uniform(0.2, 1.0)) * move
    return _schedule(random, travel / places[-1] * places, move, rest, random.uniform() < 0.5)


def _short(random: Random, travel: float, move: float) -> _Plan:
    pick = (_sine, _triangle, _two_places, _ramp, _steps)[int(random.integers(5))]
    plan = pick(random, travel, move)
    return replace(plan, duration=float(random.uniform(0.6, 1.8)) * move)


def _multisine(random: Random, travel: float, move: float) -> _Plan:
    frequency = np.geomspace(0.1, float(random.uniform(0.8, 2.0)), 7) / move
    phase = random.uniform(0.0, 2.0 * math.pi, 7)
    size = 0.5 * travel / np.sqrt(7.0) * (frequency[0] / frequency) ** 0.5
    at_zero = float(np.sin(phase) @ size)
    return _Plan(
        lambda time: np.asarray(np.sin(2.0 * math.pi * np.outer(time, frequency) + phase) @ size - at_zero), False, 16.0 * move
    )


def _force_sine(random: Random, travel: float, move: float) -> _Plan:
    rate, size = math.pi / move, _between(random, 1.5, 5.0)
    return _Plan(lambda time: np.asarray(size * np.cos(rate * time)), True, float(random.uniform(3.0, 10.0)) * 2.0 * move)


def _force_steps(random: Random, travel: float, move: float) -> _Plan:
    size = _between(random, 1.5, 4.0) * random.uniform(0.7, 1.3, 40)
    signs = np.where(np.arange(40) % 2, -1.0, 1.0) * (np.arange(40) % 3 != 2)
    return _Plan(lambda time: np.asarray((size * signs)[np.minimum(time / move, 39).astype(np.int64)]), True, 8.0 * move)


def _force_ramp(random: Random, travel: float, move: float) -> _Plan:
    top = _between(random, 1.5, 3.0)
    return _Plan(lambda time: np.asarray(top * np.minimum(time / (4.0 * move), 1.0)), True, 5.0 * move)


KINDS: dict[str, Callable[[Random, float, float], _Plan]] = {
    "ramp": _ramp, "triangle": _triangle, "steps": _steps, "sine": _sine, "point to point": _point_to_point,
    "between two places": _two_places, "holds against gravity": _holds, "held still": _held, "one direction": _one_way,
    "short": _short, "multisine": _multisine, "force sine": _force_sine, "force steps": _force_steps,
    "force ramp": _force_ramp,
}  # fmt: skip
"""Plans of motion by kind; each from a generator, a travel [x] and the time of a move [s]. Forces are in units of friction."""


@numba.njit(cache=True)
def _march(axis, gains, wanted, forced, control, fine, encoder):  # type: ignore[no-untyped-def]  # pragma: no cover
    """Position and force at the controller's samples."""
    mass, coulomb, surplus, stribeck, viscous, gravity, arm = axis
    p, d, i, known = gains
    n = wanted.shape[0]
    h = control / fine
    position, velocity, force = np.empty(n), np.empty(n), np.empty(n)
    q = v = before = total = 0.0
    seen = 0.0
    for k in range(n):
        position[k], velocity[k] = q, v
        seen = np.round(q / encoder) * encoder
        if forced:
            u = wanted[k]
        else:
            error = wanted[k] - seen
            rate = (wanted[k] - wanted[max(k - 1, 0)] - (seen - before)) / control
            total += error * control
            u = p * error + d * rate + i * total + known * (gravity * np.sin(q) if arm else gravity)
        before = seen
        force[k] = u
        for _ in range(fine):
            weight = gravity * np.sin(q) if arm else gravity
            free = (v + h / mass * (u - weight)) / (1.0 + h * viscous / mass)
            most = h / mass * (coulomb + surplus * np.exp(-((v / stribeck) ** 2)))
            v = 0.0 if abs(free) <= most else free - most * np.sign(free)
            q += h * v
    return position, velocity, force


def _draw_axis(random: Random, kind: str, travel: float, move: float) -> _Axis:
    mass = _between(random, 0.05, 20.0)
    inertial = mass * travel * (math.pi / move) ** 2
    coulomb = inertial * _between(random, 0.05, 3.0)
    speed = travel / move
    gravity, arm = 0.0, False
    if not kind.startswith("force"):
        if kind in {"holds against gravity", "held still"}:
            gravity = coulomb * _between(random, 0.5, 5.0)
        elif random.uniform() < 0.3:
            gravity = coulomb * _between(random, 0.1, 3.0)
        arm = gravity != 0.0 and random.uniform() < 0.3
    surplus = coulomb * float(random.uniform(0.1, 0.6)) if random.uniform() < 0.5 else 0.0
    return _Axis(mass, coulomb, surplus, 0.05 * speed, coulomb / speed * _between(random, 0.02, 1.0), gravity, arm)


def _bandwidth(random: Random, axis: _Axis, travel: float) -> float:
    """Of the controller [rad/s]: stiff enough to move against friction and weight."""
    least = math.sqrt(10.0 * (axis.coulomb + axis.surplus + axis.gravity) / (axis.mass * travel))
    return min(max(2.0 * math.pi * _between(random, 2.0, 12.0), least), 0.15 * _CONTROL)


def _gains(random: Random, axis: _Axis, rate: float) -> tuple[float, float, float, float]:
    """P, D and I of the controller, and the share of gravity that it knows."""
    integral = float(random.uniform(0.1, 0.3)) * rate if random.uniform() < 0.4 else 0.0
    stiffness = axis.mass * rate**2
    return stiffness, 1.6 * axis.mass * rate, stiffness * integral, float(random.choice([0.0, 0.9, 1.0]))


def ordinary(seed: int) -> Ordinary:
    """The recording that belongs to ``seed``; the kinds take turns."""
    random = np.random.default_rng([seed, 25])
    kind = tuple(KINDS)[seed % len(KINDS)]
    travel, move = _between(random, 0.005, 2.0), _between(random, 0.3, 2.0)
    axis = _draw_axis(random, kind, travel, move)
    plan = KINDS[kind](random, travel, move)
    stiff = _bandwidth(random, axis, travel)
    rate = float(random.choice([each for each in _RATES if each >= _PER_PERIOD * stiff / (2.0 * math.pi)]))
    duration = min(plan.duration, _MOST / rate)
    every = max(math.ceil(_CONTROL / rate), 1)
    control = 1.0 / (rate * every)
    fine = max(math.ceil(control / _FINEST), 4)
    time = control * np.arange(int(duration / control) + 1, dtype=np.float64)
    wanted = plan.wanted(time) * (axis.coulomb + axis.surplus if plan.force else 1.0)
    encoder = travel / _between(random, 400.0, 1e6)
    parts = (axis.mass, axis.coulomb, axis.surplus, axis.stribeck, axis.viscous, axis.gravity, axis.arm)
    gains = _gains(random, axis, stiff)
    position, velocity, force = _march(parts, gains, wanted, plan.force, control, fine, encoder)
    record = _recorded(random, kind, every, time, (position, velocity, force, wanted), encoder, plan.force)
    off = random.uniform(0.85, 1.15, 3)
    terms = [term("coulomb", force=off[1] * axis.coulomb), term("viscous", coefficient=off[2] * axis.viscous)]
    if axis.gravity and not axis.arm:
        terms.append(term("bias", force=axis.gravity))
    model = replace(build_model("rigid", {"mass": off[0] * axis.mass}, terms), units=record.units)
    return Ordinary(replace(record, source=f"{kind}, seed {seed}"), model, kind, axis.gravity)


def _recorded(
    random: Random, kind: str, every: int, time: Array, signals: tuple[Array, ...], encoder: float, forced: bool
) -> Record:
    """What the instruments say: every ``every``-th sample of the controller."""
    position, velocity, force, wanted = (signal[::every] for signal in signals)
    n = position.shape[0]
    # A joint that rests without a weight takes no force: then the sensor's noise is all that there is.
    spread = float(np.ptp(force)) or float(np.max(np.abs(force))) or 1.0
    effort = force
    if random.uniform() < 0.7:  # measured; else the command
        effort = force + spread * _between(random, 1e-3, 0.03) * random.standard_normal(n)
    if random.uniform() < 0.3:
        low, high = np.quantile(effort, (0.02, 0.98))
        step = float(high - low or spread) / _between(random, 100.0, 4000.0)
        effort = step * np.round(effort / step)
    seen = encoder * np.round(position / encoder)
    speed = random.uniform()
    recorded = velocity if speed < 0.25 else np.gradient(seen, time[every]) if speed < 0.4 else None
    rotary = random.uniform() < 0.5
    return Record(
        time=time[::every][:n],
        position=seen,
        effort=effort,
        velocity=recorded,
        reference=wanted if not forced and random.uniform() < 0.6 else None,
        effort_hold=str(random.choice(["following", "linear"])) if every == 1 else "linear",
        units=Units("rad", "N m") if rotary else Units(),
    )
