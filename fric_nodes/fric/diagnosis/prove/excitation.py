"""What the examiner's axis is made to do: a reference rich enough that every effect shows, another one for every seed.

Pieces in random order, each from rest to rest at one place: a multisine, slow reversals at graded speeds, nested loops of
force around rest, small moves after rests of graded length, a ladder of speeds there and back, and quick steps. Between
them the axis goes smoothly to another place, so that the whole travel is visited.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...record import Array

__all__ = ["Axis", "Piece", "drawn_reference"]

_ACCELERATION_TIME = 0.12  # of a move's ends [s] at the least


@dataclass(frozen=True)
class Axis:
    """Scale of an axis.

    Attributes:
        travel: [m].
        top_speed: [m/s].
        acceleration: usual [m/s^2].
        break_away: [N].
        sample_time: [s].
    """

    travel: float
    top_speed: float
    acceleration: float
    break_away: float
    sample_time: float


Piece = tuple[Array, Array]
"""Reference [m] and force [N]."""


def drawn_reference(axis: Axis, duration: float, random: np.random.Generator) -> Piece:
    """Reference [m] and added force [N] of a recording of about ``duration`` [s], each of shape ``(n_samples,)``."""
    makers = [_multisine, _slow_reversals, _loops, _rests, _ladder, _quick_steps]
    order = random.permutation(len(makers))
    share = {"_multisine": 0.24, "_slow_reversals": 0.16, "_loops": 0.09, "_rests": 0.18, "_ladder": 0.12, "_quick_steps": 0.08}
    reference, force = [np.zeros(round(0.3 / axis.sample_time))], [np.zeros(round(0.3 / axis.sample_time))]
    place = 0.0
    for number in order:
        maker = makers[number]
        goal = float(random.uniform(-0.3, 0.3)) * axis.travel
        reference.append(_move(axis, place, goal, 0.6 * axis.top_speed))
        force.append(np.zeros_like(reference[-1]))
        place = goal
        path, push = maker(axis, share[maker.__name__] * duration, place, random)
        reference.append(path)
        force.append(push)
        place = float(path[-1])
    # Pieces end where they end: cutting the last one off could take away what would have shown the effect.
    return np.concatenate(reference), np.concatenate(force)


def _move(axis: Axis, start: float, goal: float, speed: float) -> Array:
    """A smooth move at a constant speed between smooth ends."""
    distance = goal - start
    h = axis.sample_time
    ends = max(_ACCELERATION_TIME, speed / axis.acceleration)
    cruise = abs(distance) / max(speed, 1e-12) - ends
    if cruise < 0.0:
        ends = max(_ACCELERATION_TIME, np.sqrt(abs(distance) / axis.acceleration))
        cruise = 0.0
    n_ends, n_cruise = max(round(ends / h), 2), round(cruise / h)
    ramp = 0.5 - 0.5 * np.cos(np.pi * (np.arange(n_ends) + 0.5) / n_ends)
    rate = np.concatenate([ramp, np.ones(n_cruise), ramp[::-1]])
    path = np.cumsum(rate)
    return np.asarray(start + distance * path / path[-1])


def _dwell(axis: Axis, place: float, time: float) -> Array:
    return np.full(max(round(time / axis.sample_time), 1), place)


def _multisine(axis: Axis, time: float, place: float, random: np.random.Generator) -> Piece:
    n = max(round(time / axis.sample_time), 8)
    t = np.arange(n) * axis.sample_time
    count = 10
    lowest = max(1.0 / time, 0.15)
    tones = np.geomspace(lowest, random.uniform(4.0, 8.0), count) * random.uniform(0.95, 1.05, count)
    phase = random.uniform(0, 2 * np.pi, count)
    window = np.minimum(1.0, np.minimum(t, t[-1] - t) / min(0.5, 0.2 * time))
    window = np.sin(0.5 * np.pi * window) ** 2
    path = window * np.sum(np.sin(2 * np.pi * np.outer(t, tones) + phase) / tones, axis=1)
    speed = np.max(np.abs(np.gradient(path, axis.sample_time)))
    quick = np.max(np.abs(np.gradient(np.gradient(path, axis.sample_time), axis.sample_time)))
    room = 0.5 * axis.travel - abs(place)
    size = min(axis.top_speed / speed, 4.0 * axis.acceleration / quick, room / np.max(np.abs(path)))
    return place + size * path, np.zeros(n)


def _slow_reversals(axis: Axis, time: float, place: float, random: np.random.Generator) -> Piece:
    parts = []
    speeds = axis.top_speed * np.array([0.012, 0.03, 0.08]) * random.uniform(0.8, 1.25, 3)
    for speed in random.permutation(speeds):
        half = time / 3.0 / 4.0
        side = 1.0 if random.random() < 0.5 else -1.0
        reach = min(max(half - _ACCELERATION_TIME, 0.1) * speed, 0.3 * axis.travel)
        at = place
        for goal in (place + side * reach, place, place - side * reach, place):
            parts.append(_move(axis, at, goal, float(speed)))
            at = goal
    path = np.concatenate(parts)
    return path, np.zeros_like(path)


def _loops(axis: Axis, time: float, place: float, random: np.random.Generator) -> Piece:
    n = round(time / axis.sample_time)
    t = np.arange(n) * axis.sample_time
    push = np.zeros(n)
    levels = random.permutation(np.array([0.45, 0.7, 0.92]))
    third = n // 3
    for k, level in enumerate(levels):
        part = slice(k * third, (k + 1) * third)
        local = t[part] - t[k * third]
        turns = max(round(1.3 * local[-1]), 1) / max(local[-1], 1e-9)
        phase = 2 * np.pi * turns * local
        push[part] = level * axis.break_away * (np.sin(phase) + 0.25 * np.sin(3 * phase)) / 1.1
    return np.full(n, place), push


def _rests(axis: Axis, time: float, place: float, random: np.random.Generator) -> Piece:
    parts = []
    at, side, spent = place, 1.0, 0.0
    waits = random.permutation(np.array([0.04, 0.12, 0.35, 1.0, 0.04, 0.12, 0.35, 2.0]))
    for wait in np.tile(waits, 4):
        goal = at + side * axis.travel * random.uniform(0.015, 0.03)
        step = np.concatenate(
            [_dwell(axis, at, float(wait)), _move(axis, at, goal, axis.top_speed * random.uniform(0.05, 0.15))]
        )
        if spent + step.shape[0] * axis.sample_time > time:
            continue
        spent += step.shape[0] * axis.sample_time
        parts.append(step)
        at, side = goal, -side if random.random() < 0.6 else side
    path = np.concatenate(parts)
    return path, np.zeros_like(path)


def _ladder(axis: Axis, time: float, place: float, random: np.random.Generator) -> Piece:
    parts = []
    speeds = axis.top_speed * random.permutation(np.array([0.15, 0.35, 0.65, 1.0])) * random.uniform(0.9, 1.0, 4)
    at = place
    for speed in speeds:
        reach = min(0.8 * axis.travel, max(time / 8.0, 0.3) * speed)
        low = float(np.clip(at - 0.5 * reach, -0.45 * axis.travel, 0.45 * axis.travel - reach))
        for goal in (low + reach, low):
            parts.append(_move(axis, at, goal, float(speed)))
            at = goal
    path = np.concatenate(parts)
    return path, np.zeros_like(path)


def _quick_steps(axis: Axis, time: float, place: float, random: np.random.Generator) -> Piece:
    parts, spent, at = [], 0.0, place
    while spent < time:
        room = 0.45 * axis.travel
        goal = float(np.clip(at + random.choice([-1.0, 1.0]) * random.uniform(0.03, 0.2) * axis.travel, -room, room))
        parts.append(
            np.concatenate([_move(axis, at, goal, 0.8 * axis.top_speed), _dwell(axis, goal, random.uniform(0.03, 0.15))])
        )
        spent += parts[-1].shape[0] * axis.sample_time
        at = goal
    path = np.concatenate(parts)
    return path, np.zeros_like(path)
