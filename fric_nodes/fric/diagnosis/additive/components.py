"""The components of a machine, each with the functions along the measured motion that physics left out there would show as.

A component says where something is missing, not by which law. Its columns span what smooth functions of its own arguments can
do: friction over speed, force over position, friction over time, and so on. They are evaluated in the middle of each
interval of the recording and then seen through the same observer as the missing force.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...record import Array

__all__ = ["BY_ID", "COMB", "COMPONENTS", "OTHERS", "OTHER_OF", "Along", "Component", "Ranges", "comb_cycles"]

COMB = "ripple"
"""The component whose function repeats over position."""


_SPEEDS, _PLACES, _TIMES = 9, 9, 8  # functions that a smooth course over the whole range needs: a resolution of an eighth
_FEWEST_CYCLES, _MOST_CYCLES = 4, 120  # over the travel: fewer are a smooth force over position; more cost time
_WAYS = 5  # lengths of a decay, in equal ratios


@dataclass(frozen=True, eq=False)
class Along:
    """Signals of one run, in the middle of its intervals; arrays of shape ``(n,)``.

    Attributes:
        time: [s].
        position: [x].
        velocity: [x/s].
        acceleration: [x/s^2].
        sign: of the velocity; 0 where the axis may rest.
        way: since the last reversal [x].
        force: that the model needs along the motion [F].
        step: between samples [s].
        load: relative normal load [1].
        temperature: [K] from reference.
    """

    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    sign: Array
    way: Array
    force: Array
    step: float
    load: Array
    temperature: Array


@dataclass(frozen=True, eq=False)
class Ranges:
    """What all runs of a recording cover.

    Attributes:
        low: lowest position [x].
        high: highest position [x].
        speed: fast motion [x/s].
        first: time at which the first run begins [s].
        last: time at which the last one ends [s].
        finest: shortest period that the observer sees [x].
        grain: smallest way that the sensor tells [x].
    """

    low: float
    high: float
    speed: float
    first: float
    last: float
    finest: float
    grain: float


@dataclass(frozen=True, eq=False)
class Component:
    """One place where physics may be missing.

    Attributes:
        id: its name in reports for programs.
        title: its name in a sentence.
        place: part of the machine.
        columns: functions along one run, shape ``(n, k)``, with the same k for every run.
        of_force: True where they depend on the force that the model needs along the motion.
    """

    id: str
    title: str
    place: str
    columns: Callable[[Along, Ranges], Array]
    of_force: bool = False


def _bumps(x: Array, n: int, low: float, high: float) -> Array:
    """Gaussians as wide as they are apart, shape ``(len(x), n)``."""
    spread = max(high - low, 1e-300)
    return np.exp(-0.5 * ((x[:, None] - np.linspace(low, high, n)) * (n - 1) / spread) ** 2)


def _over_speed(s: Along, r: Ranges) -> Array:
    """Over the root of the speed: friction changes most where it is slow."""
    return _bumps(np.sqrt(np.abs(s.velocity)), _SPEEDS, 0.0, np.sqrt(r.speed))


def _over_place(s: Along, r: Ranges) -> Array:
    return _bumps(s.position, _PLACES, r.low, r.high)


def _over_time(s: Along, r: Ranges) -> Array:
    return _bumps(s.time, _TIMES, r.first, r.last)


def comb_cycles(r: Ranges) -> Array:
    """Cycles over the travel, as fine as two periods can be told apart: whole numbers."""
    return np.arange(_FEWEST_CYCLES, min(int((r.high - r.low) / r.finest), _MOST_CYCLES) + 1, dtype=np.float64)


def _comb(s: Along, r: Ranges) -> Array:
    travel, cycles = r.high - r.low, comb_cycles(r)
    if not cycles.size:
        return np.zeros((s.position.shape[0], 2))
    angle = 2.0 * np.pi * (s.position[:, None] - r.low) / travel * cycles
    return np.concatenate([np.cos(angle), np.sin(angle)], axis=1)


def _decay(s: Along, r: Ranges) -> Array:
    lengths = np.geomspace(max(3.0 * r.grain, 1e-5 * (r.high - r.low)), 0.03 * (r.high - r.low), _WAYS)
    return np.exp(-s.way[:, None] / lengths) * s.sign[:, None]


def _command(s: Along, r: Ranges) -> Array:
    """First-order changes by a lag, by a knee at small forces, and by one at large ones."""
    size = max(float(np.sqrt(np.mean(s.force**2))), 1e-300)
    relative = s.force / size
    rate = np.gradient(s.force, s.step)
    second = np.gradient(rate, s.step)
    return np.stack(
        [rate, second, size * np.tanh(4.0 * relative), size * relative * np.abs(relative), size * relative**3], axis=1
    )


def _conditions(s: Along, r: Ranges) -> Array:
    columns = [
        each * way for each in (s.load - 1.0, s.temperature) for way in (s.sign, s.velocity / r.speed, np.ones_like(s.sign))
    ]
    return np.stack([np.broadcast_to(each, s.sign.shape) for each in columns], axis=1)


COMPONENTS: tuple[Component, ...] = (
    Component("friction-speed", "friction over speed", "guideway friction", lambda s, r: _over_speed(s, r) * s.sign[:, None]),
    Component("direction", "difference between the directions", "guideway friction", _over_speed),
    Component(
        "friction-acceleration",
        "friction that differs between speeding up and slowing down",
        "guideway friction",
        lambda s, r: _over_speed(s, r) * (s.sign * np.sign(s.velocity * s.acceleration))[:, None],
    ),
    Component("friction-reversal", "friction over the way since a reversal", "guideway friction", _decay),
    Component(
        "friction-position", "friction over position", "guideway friction", lambda s, r: _over_place(s, r) * s.sign[:, None]
    ),
    Component("friction-time", "friction over time", "guideway friction", lambda s, r: _over_time(s, r) * s.sign[:, None]),
    Component("friction-conditions", "load or temperature", "guideway friction", _conditions),
    Component(
        "friction-force",
        "friction that follows the driving force",
        "transmission",
        lambda s, r: (np.abs(s.force) * s.sign)[:, None],
        of_force=True,
    ),
    Component("force-position", "force over position", "load", _over_place),
    Component(COMB, "force that repeats over position", "load", _comb),
    Component("force-time", "force over time", "load", _over_time),
    Component("inertia-time", "inertia over time", "load", lambda s, r: _over_time(s, r) * s.acceleration[:, None]),
    Component("inertia-position", "inertia over position", "load", lambda s, r: _over_place(s, r) * s.acceleration[:, None]),
    Component("command", "command path", "command path", _command, of_force=True),
)
"""The components with functions along the measured motion."""


def _nothing(s: Along, r: Ranges) -> Array:
    return np.zeros((s.sign.shape[0], 1))


OTHERS: dict[str, Component] = {
    each.id: each
    for each in (
        Component("command", "command path", "command path", _command, of_force=True),
        Component("transmission", "transmission between drive and body", "transmission", _nothing),
        Component("friction-states", "friction before it slides", "guideway friction", _nothing),
        Component("load-states", "what hangs on the body", "load", _nothing),
        Component("sensor", "sensor", "sensor", _nothing),
    )
}
"""Components for laws that no function along the measured motion resembles; these laws are their functions, at first order."""

OTHER_OF: dict[str, str] = {each.place: each.id for each in OTHERS.values()}
"""The same by the part of the machine."""

BY_ID: dict[str, Component] = {**{each.id: each for each in COMPONENTS}, **OTHERS}
"""Every component."""
