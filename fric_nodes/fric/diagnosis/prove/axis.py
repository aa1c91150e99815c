"""An axis for a case: its scale, its visible physics, its loop and its sensors, drawn from a seed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .excitation import Axis
from .physics import Physics

__all__ = ["Setting", "draw_setting"]

_RATES = (250.0, 500.0, 1000.0, 2000.0)
_RATES_TO_CHANGE = (500.0, 1000.0)
"""Rates [Hz] that stay within 250 to 2000 Hz at half and at twice their value."""


@dataclass(frozen=True)
class Setting:
    """What a case is built on.

    Attributes:
        physics: what the nominal model knows, with its true values.
        parts: of the nominal structure besides the mass.
        travel: [m].
        top_speed: [m/s].
        acceleration: usual [m/s^2].
        bandwidth: of the controller [rad/s].
        sample_time: [s].
        train_time: [s].
        validation_time: [s].
        resolution: of the encoder [m], before noise is set.
    """

    physics: Physics
    parts: tuple[str, ...]
    travel: float
    top_speed: float
    acceleration: float
    bandwidth: float
    sample_time: float
    train_time: float
    validation_time: float
    resolution: float

    @property
    def friction(self) -> float:
        """A level to measure concealed forces by [N]: of a sliding contact on this axis, whether it is concealed or not."""
        return self.physics.coulomb if self.physics.coulomb > 0.0 else 0.5 * self.physics.mass * self.acceleration

    @property
    def band(self) -> float:
        """Highest frequency [Hz] at which the recording still tells forces apart."""
        return min(0.1 / self.sample_time, 100.0)

    def axis(self, break_away: float) -> Axis:
        """The scale for an excitation."""
        return Axis(self.travel, self.top_speed, self.acceleration, break_away, self.sample_time)


def draw_setting(
    random: np.random.Generator, required: frozenset[str], forbidden: frozenset[str], rate_factor: float
) -> Setting:
    """An axis whose nominal structure has the ``required`` parts and none that are ``forbidden``.

    Args:
        random: the case's own.
        required: parts that the nominal structure must have.
        forbidden: parts that must not be known to it; they aren't in the physics either.
        rate_factor: by which the sampling rate differs from the usual one; 1: none.
    """
    mass = _spread(random, 0.2, 50.0)
    travel = _spread(random, 0.005, 0.5)
    top_speed = travel * float(random.uniform(1.0, 2.5))
    acceleration = top_speed * float(random.uniform(8.0, 16.0))
    rate = float(random.choice(_RATES if rate_factor == 1.0 else _RATES_TO_CHANGE)) * rate_factor
    coulomb = mass * acceleration * _spread(random, 0.15, 1.5)
    viscous = coulomb * float(random.uniform(0.2, 0.9)) / top_speed
    parts = {"coulomb", "viscous"}
    if random.random() < 0.5:
        parts.add("bias")
    extra = float(random.random())
    if extra < 0.15:
        parts.add("stribeck")
    elif extra < 0.3:
        parts.add("presliding")
    if "stribeck" in required:
        parts.discard("presliding")
    parts = (parts | required) - forbidden
    physics = Physics(
        mass=mass,
        coulomb=coulomb if "coulomb" in parts else 0.0,
        viscous=viscous if "viscous" in parts else 0.0,
        bias=coulomb * float(random.uniform(0.1, 0.4) * random.choice([-1.0, 1.0])) if "bias" in parts else 0.0,
    )
    if "stribeck" in parts:
        physics = physics.using(
            {
                "stribeck": coulomb * float(random.uniform(0.3, 0.8)),
                "stribeck_velocity": top_speed * _spread(random, 0.02, 0.06),
            }
        )
    if "presliding" in parts:
        physics = physics.using(with_bristle(mass, coulomb, 2.0 * math.pi * _spread(random, 12.0, 40.0)))
    order = ("coulomb", "viscous", "bias", "stribeck", "presliding")
    return Setting(
        physics=physics,
        parts=tuple(part for part in order if part in parts),
        travel=travel,
        top_speed=top_speed,
        acceleration=acceleration,
        bandwidth=min(2.0 * math.pi * float(random.uniform(6.0, 11.0)), 0.2 * rate),
        sample_time=1.0 / rate,
        train_time=float(random.uniform(24.0, 40.0)),
        validation_time=float(random.uniform(20.0, 30.0)),
        resolution=travel * _spread(random, 1e-6, 1e-5),
    )


def with_bristle(mass: float, level: float, frequency: float) -> dict[str, float]:
    """A bristle on which the mass swings at ``frequency`` [rad/s]."""
    displacement = level / (mass * frequency**2)
    return {"presliding": 1.0, "displacement": displacement, "presliding_damping": 0.3 * mass * frequency}


def _spread(random: np.random.Generator, low: float, high: float) -> float:
    return float(math.exp(random.uniform(math.log(low), math.log(high))))
