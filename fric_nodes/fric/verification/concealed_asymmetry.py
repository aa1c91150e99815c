"""A pendulum whose friction differs between its directions, diagnosed from a model with symmetric friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..diagnosis.prove.laws import compiled_loop
from ..model import build_model, term
from ..record import Array, Record, Units
from .concealed_reference import Case, Limits, evidence, found_in
from .verification import Evidence, Verification

__all__ = ["VERIFICATION", "swing"]

_STEP = 2e-3  # [s], between samples
_FINER = 100  # steps of the integration per sample
_RESOLUTION = 2e-5  # [rad]
_NOISE = 4e-4  # [N m]


@dataclass(frozen=True)
class Pendulum:
    """The truth, after de Marchi's experiment: inertia, feedback and weight as he has them, friction by direction.

    Attributes:
        inertia: [N m s^2].
        stiffness: of the internal feedback [N m/rad].
        weight: torque at 90 deg [N m].
        coulomb: forward and backward [N m].
        viscous: forward and backward [N m s].
    """

    inertia: float = 0.0116
    stiffness: float = 0.6
    weight: float = 0.4
    coulomb: tuple[float, float] = (0.036, 0.028)
    viscous: tuple[float, float] = (0.010, 0.004)


@compiled_loop
def swing(numbers: Any, torque: Any, h: float, finer: int, angle: Any) -> None:
    """Lead the pendulum by semi-implicit Euler with rest as an event; writes the angle at each sample [rad].

    Args:
        numbers: inertia, stiffness, weight, and Coulomb and viscous coefficients forward and backward, shape ``(7,)``.
        torque: from its sample to the next [N m], shape ``(n,)``.
        h: step of the integration [s].
        finer: steps per sample.
        angle: shape ``(n,)``.
    """
    inertia, stiffness, weight, up, down, rub_up, rub_down = numbers
    q, v = 0.0, 0.0
    for k in range(torque.shape[0]):
        angle[k] = q
        for _ in range(finer):
            push = torque[k] - stiffness * q - weight * math.sin(q)
            if v == 0.0:
                if push > up:
                    v = h / inertia * (push - up)
                elif push < -down:
                    v = h / inertia * (push + down)
            else:
                against = up + rub_up * v if v > 0.0 else -down + rub_down * v
                after = v + h / inertia * (push - against)
                # A turn needs a stop: whether it goes on from there is the next step's question.
                v = 0.0 if after * v < 0.0 else after
            q += h * v


def _torque(random: np.random.Generator, duration: float) -> Array:
    """Pulls to either side that are let go, so that it swings freely in between, and a slow sweep [N m]."""
    n = round(duration / _STEP)
    torque = np.zeros(n)
    k = round(0.3 / _STEP)
    while k < n:
        rise, hold, free = (round(float(t) / _STEP) for t in random.uniform((0.3, 0.05, 1.5), (0.8, 0.3, 3.5)))
        size = random.choice((-1.0, 1.0)) * random.uniform(0.3, 0.8)
        pull = size * np.concatenate([0.5 - 0.5 * np.cos(np.pi * np.arange(rise) / rise), np.ones(hold)])
        torque[k : k + pull.shape[0]] = pull[: max(n - k, 0)]
        k += pull.shape[0] + free
    t = _STEP * np.arange(n)
    tones = random.uniform(0.2, 2.0, 4)
    slow = np.sum(np.sin(2 * np.pi * np.outer(t, tones) + random.uniform(0, 2 * np.pi, 4)), axis=1)
    result: Array = torque + 0.08 * slow * (t > 0.6 * duration)
    return result


def _recorded(truth: Pendulum, duration: float, seed: int, name: str) -> Record:
    random = np.random.default_rng(seed)
    torque = _torque(random, duration)
    angle = np.empty_like(torque)
    numbers = np.array([truth.inertia, truth.stiffness, truth.weight, *truth.coulomb, *truth.viscous])
    swing(numbers, torque, _STEP / _FINER, _FINER, angle)
    return Record(
        time=_STEP * np.arange(torque.shape[0], dtype=np.float64),
        position=np.round(angle / _RESOLUTION) * _RESOLUTION,
        effort=torque + _NOISE * random.standard_normal(torque.shape[0]),
        joint="pendulum",
        units=Units("rad", "N m"),
        source=name,
        effort_hold="following",
    )


def _case() -> Case:
    truth = Pendulum()
    nominal = build_model(
        "pendulum",
        {"inertia": 1.15 * truth.inertia, "proportional": 0.9 * truth.stiffness, "gravity": truth.weight},
        [term("coulomb", force=0.025), term("viscous", coefficient=0.009)],
        units=Units("rad", "N m"),
        joint="pendulum",
    )
    return Case([_recorded(truth, 30.0, 3, "training")], [_recorded(truth, 20.0, 4, "validation")], nominal)


def _run() -> Evidence:
    truth = Pendulum()
    notes = [
        f"Concealed: Coulomb torque of {truth.coulomb[0]:g} N m forward and {truth.coulomb[1]:g} N m backward, viscous"
        f" coefficient of {truth.viscous[0]:g} and {truth.viscous[1]:g} N m s. The nominal model has one of each.",
        f"Integrated by another method with {_FINER} steps per sample.",
    ]
    case = _case()
    return evidence(case, found_in(case), ("asymmetry",), ("guideway friction",), Limits(), notes)


VERIFICATION = Verification(
    id="concealed_asymmetry",
    title="Concealed: friction that differs between directions behind a pendulum with symmetric friction",
    source="de Marchi 1998, asymmetric kinetic and viscous friction under internal feedback, integrated from rest to rest",
    run=_run,
)
