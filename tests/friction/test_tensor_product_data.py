"""Tensor-product models of friction from measurements."""

from __future__ import annotations

import numpy as np
import pytest
from fric.friction.tensor_product import from_data
from fric.friction.tensor_product_transformation import TensorProductError
from numpy.typing import NDArray

Array = NDArray[np.float64]

C, S, VISCOUS, SPEED, MASS = 2.447, 3.7, 15.0, 0.019, 0.102


def rising(v: Array) -> Array:
    return np.asarray((C + (S - C) / (1 + (v / SPEED) ** 2)) * np.sign(v) + VISCOUS * v)


def falling(v: Array) -> Array:
    return np.asarray(C * np.sign(v) + VISCOUS * v)


def motion() -> tuple[Array, Array]:
    """Velocity and acceleration that pass each speed up to 0.05 m/s, up and down, in both directions."""
    t = np.linspace(0, 2 * np.pi, 40_001)
    return 0.05 * np.sin(t), 0.05 * np.cos(t)


def test_data_give_the_friction_that_they_hold() -> None:
    v, a = motion()
    friction = np.where(v * a >= 0, rising(v), falling(v))
    law = from_data(v, a, friction, MASS, largest=0.05, size=1000)
    probe = np.linspace(1e-3, 0.0495, 200)
    for side in (1.0, -1.0):
        np.testing.assert_allclose(law.force(side * probe), rising(side * probe), rtol=2e-4)
        np.testing.assert_allclose(law.force(side * probe, False), falling(side * probe), rtol=2e-4)
    assert law.speeding_up.vertices[1, 0, 0] == pytest.approx(law.slowing_down.vertices[1, 0, 0], rel=1e-12)


def test_repeated_measurements_average_noise_out() -> None:
    v, a = motion()
    clean = np.where(v * a >= 0, rising(v), falling(v))
    noisy = clean + 0.2 * np.random.default_rng(6).standard_normal(v.shape[0])
    law = from_data(v, a, noisy, MASS, largest=0.05, size=40, least_speed=1e-3)
    probe = np.linspace(0.005, 0.045, 50)
    # 20 intervals of 1000 samples and more in each branch.
    assert np.max(np.abs(law.force(probe) - rising(probe))) < 0.03
    assert np.max(np.abs(law.force(probe, False) - falling(probe))) < 0.03


def test_directions_apart() -> None:
    v, a = motion()
    friction = falling(v) * np.where(v > 0, 1.0, 2.0)
    law = from_data(v, a, friction, MASS, largest=0.05, size=400, symmetric=False)
    probe = np.linspace(0.001, 0.049, 40)
    np.testing.assert_allclose(law.force(probe), falling(probe), rtol=1e-6)
    np.testing.assert_allclose(law.force(-probe), 2 * falling(-probe), rtol=1e-6)
    assert law.break_away(-1.0) / law.break_away() == pytest.approx(2.0, rel=1e-3)
    together = from_data(v, a, friction, MASS, largest=0.05, size=400)
    np.testing.assert_allclose(together.force(probe), 1.5 * falling(probe), rtol=1e-2)


def test_what_says_nothing_is_left_out() -> None:
    v, a = motion()
    friction = np.where(v * a >= 0, rising(v), falling(v))
    friction[np.abs(v) < 1e-3] = 1e9
    friction[np.abs(a) < 5e-3] = -1e9
    law = from_data(v, a, friction, MASS, largest=0.0495, size=200, least_speed=1e-3, least_acceleration=5e-3)
    assert law.break_away() == pytest.approx(S, rel=1e-2)
    assert np.max(np.abs(law.force(np.linspace(-0.049, 0.049, 99)))) < 4.0


def test_a_branch_without_data_is_refused() -> None:
    v, a = np.abs(motion()[0]) + 1e-3, np.ones(40_001)
    with pytest.raises(TensorProductError, match="slowing down"):
        from_data(v, a, rising(v), MASS, largest=0.05)


# --- the mass that slides on it ---
