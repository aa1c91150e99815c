"""References against their own derivatives, and the loop's delay and hold against counting."""

from __future__ import annotations

import numpy as np
import pytest
from fric.axis import Measurement
from fric.control.controller import Setpoint
from fric.control.feedforwards.iterative_learning import convergence, learnt
from fric.control.loop import LinearPlant, pid_polynomials, response
from fric.control.trial import Reference, follow, point_to_point, sine

H = 1e-3


@pytest.mark.parametrize(
    "reference",
    [sine(H, 0.02, 0.7, 4.0), point_to_point(H, [0.0, 0.1, -0.05], 0.3, 0.2), point_to_point(H, [0, 1], 0.1, 0, 0.5)],
)
def test_velocity_and_acceleration_are_the_derivatives(reference: Reference) -> None:
    inner = slice(2, -2)
    assert np.gradient(reference.position, H)[inner] == pytest.approx(reference.velocity[inner], abs=2e-3)
    assert np.gradient(reference.velocity, H)[inner] == pytest.approx(reference.acceleration[inner], abs=0.15)


def test_a_speed_is_kept() -> None:
    assert np.max(point_to_point(H, [0.0, 1.0], 0.1, 0.0, 0.5).velocity) == pytest.approx(0.5, rel=1e-3)


class Counter:
    """A body that remembers what it was commanded."""

    position = 0.0

    def __init__(self) -> None:
        self.commands: list[float] = []

    def advance(self, force: float, duration: float) -> None:
        self.commands.append(force)

    def measure(self) -> Measurement:
        return Measurement(0.0, 0.0, 0.0)


class Count:
    """A law that answers with the number of the sample."""

    limit, saturated, number = 1e9, 0, 0

    def begin(self, wanted: Setpoint, state: tuple[float, float], force: float, duration: float) -> None: ...

    def reset(self) -> None: ...

    def answer(self, wanted: Setpoint, measured: float, duration: float, feedforward: float = 0.0) -> float:
        self.number += 1
        return float(self.number)


def test_a_command_is_late_by_whole_samples() -> None:
    body = Counter()
    follow(body, Count(), sine(H, 1.0, 1.0, 0.006), delay=2)
    assert body.commands == [0.0, 0.0, 1.0, 2.0, 3.0, 4.0]


def test_learning_with_the_right_inverse_converges_at_once_and_with_a_wrong_sign_not_at_all() -> None:
    omega = np.geomspace(1.0, 0.9 * np.pi / H, 400)
    z = np.exp(1j * omega * H)
    plant = response(LinearPlant(2.0, 20.0, H).polynomials(), z)
    control = response(pid_polynomials(2e4, 2e5, 250.0, H, H), z)
    inverse = 1.0 / plant + control
    assert convergence(plant, control, inverse, omega, 50.0) < 1e-9
    assert convergence(plant, control, 0.5 * inverse, omega, 50.0) == pytest.approx(0.5, rel=1e-3)
    assert convergence(plant, control, -0.5 * inverse, omega, 50.0) > 1.0
    # As computed in the time domain, an inverse without the half sample of the hold: still convergent below the cutoff.
    s = 1j * omega
    assert convergence(plant, control, 0.6 * (2.0 * s**2 + 20.0 * s + control), omega, 50.0) < 1.0


def test_the_next_force_is_the_last_with_the_correction_smoothed() -> None:
    n = 400
    wave = np.sin(2.0 * np.pi * 5.0 * H * np.arange(n))
    found = learnt(wave, np.zeros(n), 0.5 * wave, H, 100.0)
    assert found == pytest.approx(1.5 * wave, abs=1e-4)
