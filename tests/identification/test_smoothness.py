"""What a friction curve leaves: scatter from run to run, or a shape over the speed."""

from __future__ import annotations

import numpy as np
import pytest
from fric.identification.static_maps.smoothness import structure_of
from numpy.typing import NDArray

Array = NDArray[np.float64]
SPEED: Array = np.geomspace(0.01, 1.0, 10)
VELOCITY = np.concatenate([SPEED, -SPEED])
ERROR = np.full(20, 0.01)


def hump(size: float) -> Array:
    """A hump of friction around 0.03 and a dip above, opposed to the motion in both directions."""
    return np.asarray(np.sign(VELOCITY) * size * np.sin(2.0 * np.pi * np.log(np.abs(VELOCITY)) / np.log(100.0)))


def test_scatter_is_scatter_as_often_as_the_level_says() -> None:
    found = [structure_of(VELOCITY, np.random.default_rng(seed).standard_normal(20) * 0.05, ERROR).why for seed in range(200)]
    # A hundredth of 200 is two; seven or more have a probability of half a per cent.
    assert sum(bool(why) for why in found) < 7


@pytest.mark.parametrize("seed", range(10))
def test_a_shape_over_the_speed_is_not_scatter(seed: int) -> None:
    left = hump(0.2) + 0.03 * np.random.default_rng(seed).standard_normal(20)
    assert structure_of(VELOCITY, left, ERROR).why


def test_where_it_sits() -> None:
    left = np.where(np.abs(VELOCITY) < 0.04, 0.3 * np.sign(VELOCITY), 0.0) + 0.01 * np.random.default_rng(1).standard_normal(20)
    found = structure_of(VELOCITY, left, ERROR)
    assert found.why
    assert found.low == pytest.approx(0.01)
    assert found.high < 0.04
