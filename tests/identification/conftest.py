"""An axis to identify, moved by an integrator that shares nothing with fric's: Moreau time stepping in plain Python."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from fric.record import Record
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Truth:
    """m dv/dt = u - c v - d |v| - b - friction; friction level F_C + F_D exp(-(v/v_S)^2); bristles when stiffness is given."""

    mass: float = 2.0
    coulomb: float = 8.0
    viscous: float = 15.0
    bias: float = 0.8
    asymmetry: float = 2.0
    surplus: float = 0.0
    stribeck: float = 0.02
    stiffness: float = 0.0
    damping: float = 0.0

    def respond(
        self, control: Callable[[int, float, float], float], n: int, step: float, fine: int = 20
    ) -> tuple[Array, Array]:
        """Positions and forces at ``n`` samples; the force of a sample acts until the next one."""
        h = step / fine
        q = v = z = 0.0
        positions, forces = [], []
        for k in range(n):
            u = control(k, q, v)
            positions.append(q)
            forces.append(u)
            for _ in range(fine):
                level = self.coulomb + (self.surplus * math.exp(-((v / self.stribeck) ** 2)) if self.surplus else 0.0)
                push = u - self.viscous * v - self.asymmetry * abs(v) - self.bias
                if self.stiffness:
                    rate = v - self.stiffness * abs(v) / level * z
                    push -= self.stiffness * z + self.damping * rate
                    v += h / self.mass * push
                    # Implicit in z, so that fast sliding doesn't make it unstable.
                    z = (z + h * v) / (1.0 + h * self.stiffness * abs(v) / level)
                else:
                    free = v + h / self.mass * push
                    v = math.copysign(max(abs(free) - h / self.mass * level, 0.0), free)
                q += h * v
        return np.array(positions), np.array(forces)


@dataclass(frozen=True)
class Run:
    """A recorded motion."""

    time: Array
    position: Array
    force: Array
    truth: Truth

    def record(self, noise: float = 0.0, resolution: float = 0.0, seed: int = 1, colour: float = 0.0) -> Record:
        """As an instrument would have it: quantised position, force with noise, white or AR(1) with coefficient ``colour``."""
        rng = np.random.default_rng(seed)
        white = rng.standard_normal(self.force.shape[0])
        if colour:
            coloured = np.empty_like(white)
            coloured[0] = white[0]
            for k in range(1, white.shape[0]):
                coloured[k] = colour * coloured[k - 1] + math.sqrt(1.0 - colour**2) * white[k]
            white = coloured
        position = np.round(self.position / resolution) * resolution if resolution else self.position
        return Record(self.time, position, self.force + noise * white, effort_hold="following")


def wanted(time: Array, seed: int, travel: float, top: float) -> tuple[Array, Array]:
    """A multisine up to ``top`` Hz with a smooth start: position and velocity."""
    rng = np.random.default_rng(seed)
    frequency = np.geomspace(0.1, top, 7)
    phase = rng.uniform(0.0, 2.0 * np.pi, 7)
    amplitude = travel / frequency / np.sum(1.0 / frequency)
    w = 2.0 * np.pi * frequency
    angle = np.outer(time, w) + phase
    q, v = np.sin(angle) @ amplitude, np.cos(angle) @ (amplitude * w)
    s = np.clip(time, 0.0, 1.0)
    fade, slope = s**2 * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s)
    q = q - q[0]
    return q * fade, v * fade + q * slope


def move_and_rest(truth: Truth, moving: float = 6.0, resting: float = 5.0, step: float = 1e-3) -> Run:
    """As :func:`move`, with a rest in the middle during which the drive pushes as it likes, below break-away."""
    n, n_rest = round(moving / step), round(resting / step)
    # Time of the reference: runs, slows down within half a second, stands, and starts again.
    ramp = np.linspace(1.0, 0.0, round(0.5 / step))
    pace = np.concatenate([np.ones(n), ramp, np.zeros(n_rest), ramp[::-1], np.ones(n)])
    inner = step * np.cumsum(pace)
    q_d, v_d = wanted(inner, 3, 0.3, 3.0)
    target, speed = q_d.tolist(), (v_d * pace).tolist()
    first = n + ramp.shape[0]
    time = step * np.arange(pace.shape[0])

    def control(k: int, q: float, v: float) -> float:
        if first + 100 < k < first + n_rest - 100:
            return 4.0 * math.sin(0.013 * k) + 1.0
        return 4000.0 * (target[k] - q) + 120.0 * (speed[k] - v)

    position, force = truth.respond(control, time.shape[0], step)
    return Run(time, position, force, truth)


def move(truth: Truth, duration: float = 20.0, seed: int = 3, travel: float = 0.3, top: float = 3.0, step: float = 1e-3) -> Run:
    """``truth`` under a PD controller along a multisine."""
    time = step * np.arange(round(duration / step))
    q_d, v_d = wanted(time, seed, travel, top)
    target, speed = q_d.tolist(), v_d.tolist()

    def control(k: int, q: float, v: float) -> float:
        return 4000.0 * (target[k] - q) + 120.0 * (speed[k] - v)

    position, force = truth.respond(control, time.shape[0], step)
    return Run(time, position, force, truth)


@pytest.fixture(scope="session")
def slider() -> Run:
    """Coulomb, viscous, asymmetric viscous friction and bias."""
    return move(Truth())


@pytest.fixture(scope="session")
def creeper() -> Run:
    """With a Stribeck effect, at speeds that show it."""
    return move(replace(Truth(), surplus=4.0), travel=0.05, top=2.0)


@pytest.fixture(scope="session")
def bristled() -> Run:
    """With bristles."""
    return move(replace(Truth(), stiffness=2e5, damping=400.0), duration=15.0, travel=0.03, top=4.0)


@pytest.fixture(scope="session")
def pauser() -> Run:
    """It rests for five seconds between two motions."""
    return move_and_rest(Truth())


@pytest.fixture(scope="session")
def mover() -> Callable[..., Run]:
    """``move`` for tests with an axis of their own; ``mover(Truth-fields..., duration=...)``."""

    def make(duration: float = 20.0, seed: int = 3, travel: float = 0.3, top: float = 3.0, **fields: float) -> Run:
        return move(replace(Truth(), **fields), duration, seed, travel, top)

    return make
