"""The file of tensor-product friction: what is written is what is read, and what can't be read is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fric.errors import InputError
from fric.friction.tensor_product import TensorProductFriction, from_points
from fric.friction.tensor_product_file import (
    read_tensor_product,
    tensor_product_from_text,
    tensor_product_to_text,
    write_tensor_product,
)
from fric.record import Units


def law() -> TensorProductFriction:
    v = np.array([-0.1, -0.03, -0.01, 0.01, 0.02, 0.1])
    return from_points((v, np.sign(v) * 3.0 + 5.0 * v), (v, np.sign(v) * 2.0 + 5.0 * v), 0.5)


def test_what_is_written_is_read_back_to_the_last_bit(tmp_path: Path) -> None:
    written = law()
    write_tensor_product(written, tmp_path / "map.yaml", Units("rad", "N m"))
    read, units = read_tensor_product(tmp_path / "map.yaml")
    assert units == Units("rad", "N m")
    assert read.mass == written.mass
    for one, other in ((read.speeding_up, written.speeding_up), (read.slowing_down, written.slowing_down)):
        np.testing.assert_array_equal(one.grids[0], other.grids[0])
        np.testing.assert_array_equal(one.weights[0], other.weights[0])
        np.testing.assert_array_equal(one.vertices, other.vertices)
    v = np.array([-0.05, 0.005, 0.015, 0.07])
    np.testing.assert_array_equal(read.force(v, False), written.force(v, False))
    assert read.force(np.array([0.015]))[0] == pytest.approx(3.0 + 5.0 * 0.015)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda text: text.replace("mass:", "mas:"), "mas"),
        (lambda text: text.replace("mass: 0.5", "mass: -1.0"), "mass"),
        (lambda text: text.replace("-0.1,", "0.0,", 1), "velocity"),
        (lambda text: text.replace("fric-tensor-product/1", "fric-model/1"), "format"),
        (lambda text: "- 1", "not a tensor-product file"),
        (lambda text: text + "\n  x: [", "line"),
    ],
)
def test_what_is_wrong_is_named(spoil: object, message: str) -> None:
    text = tensor_product_to_text(law())
    with pytest.raises(InputError, match=message):
        tensor_product_from_text(spoil(text), "map.yaml")  # type: ignore[operator]


def test_weights_that_are_no_weights_are_refused() -> None:
    text = tensor_product_to_text(law())
    first = text.split("weights:\n")[1].split("\n")[0]
    with pytest.raises(InputError, match="convex"):
        tensor_product_from_text(text.replace(first, "  - [0.7, 0.7]", 1))


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_tensor_product(tmp_path / "none.yaml")
