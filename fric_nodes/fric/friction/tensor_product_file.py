"""The text form of tensor-product friction, ``format: fric-tensor-product/1`` (YAML): read, check, write.

A table over velocity isn't a list of effects, so it has a format of its own beside ``fric-model/1``. Numbers are written with
all their digits: what is read back is the same to the last bit.
"""

from __future__ import annotations

import os
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, Field
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from ..files import write_text
from ..record import Units
from ..text_form import STRICT, Number, Positive, UnitsEntry, dumped, loaded, row, text_of, units_entry, validated
from .tensor_product import TensorProductFriction
from .tensor_product_transformation import TensorProduct, TensorProductError

__all__ = [
    "FORMAT",
    "read_tensor_product",
    "tensor_product_from_text",
    "tensor_product_to_text",
    "write_tensor_product",
]

FORMAT = "fric-tensor-product/1"

_SUM = 1e-9


class _Branch(BaseModel):
    model_config = STRICT
    vertices: Annotated[list[Number], Field(min_length=1)]
    velocity: Annotated[list[Number], Field(min_length=4)]
    weights: Annotated[list[list[Number]], Field(min_length=4)]


class _File(BaseModel):
    model_config = STRICT
    format: Literal["fric-tensor-product/1"]
    units: UnitsEntry
    mass: Positive
    speeding_up: _Branch
    slowing_down: _Branch


def _entry(branch: TensorProduct) -> CommentedMap:
    return CommentedMap(
        {
            "vertices": row(branch.vertices[:, 0, 0]),
            "velocity": row(branch.grids[0]),
            "weights": CommentedSeq(row(each) for each in branch.weights[0]),
        }
    )


def tensor_product_to_text(law: TensorProductFriction, units: Units | None = None) -> str:
    """``law`` as the text of a file; ``units`` are those of its positions and forces, m and N unless given."""
    units = Units() if units is None else units
    x, f = units.position, units.force
    root = CommentedMap({"format": FORMAT, "units": units_entry(units)})
    root["mass"] = float(law.mass)
    root["speeding_up"], root["slowing_down"] = _entry(law.speeding_up), _entry(law.slowing_down)
    root.yaml_set_comment_before_after_key("mass", before=f"that the vertices refer to [{f} s^2/{x}]")
    what = "a_22 = sum_i w_i(v) a_i = -F(v)/(m v)"
    root.yaml_set_comment_before_after_key(
        "speeding_up", before=f"{what}: vertices a_i [1/s], and the weights w_i at each velocity [{x}/s]"
    )
    return dumped(root)


def tensor_product_from_text(text: str, source: str = "tensor product") -> tuple[TensorProductFriction, Units]:
    """The friction that ``text`` describes and its units; ``source`` names it in messages.

    Raises:
        TensorProductError: with line and reason.
    """
    tree = loaded(text, source, "a tensor-product file", FORMAT, TensorProductError)
    entry = validated(_File, tree, tree, source, TensorProductError)
    branches = [_branch(entry.speeding_up, source, "speeding_up"), _branch(entry.slowing_down, source, "slowing_down")]
    return TensorProductFriction(entry.mass, *branches), Units(entry.units.position, entry.units.force)


def _branch(entry: _Branch, source: str, name: str) -> TensorProduct:
    velocity = np.array(entry.velocity)
    if np.any(np.diff(velocity) <= 0.0) or not (velocity[0] < 0.0 < velocity[-1]) or np.any(velocity == 0.0):
        raise TensorProductError(
            source, f"'{name}.velocity' isn't a grid", "give ascending values on both sides of 0, without it"
        )
    n, count = velocity.shape[0], len(entry.vertices)
    if len(entry.weights) != n or any(len(row) != count for row in entry.weights):
        raise TensorProductError(
            source, f"'{name}.weights' isn't {n} rows of {count}", "give one weight per velocity and vertex"
        )
    weights = np.array(entry.weights)
    if np.max(np.abs(weights.sum(axis=1) - 1.0)) > _SUM or np.min(weights) < -_SUM:
        raise TensorProductError(source, f"'{name}.weights' isn't convex", "let each row sum to one, with nothing below zero")
    return TensorProduct((velocity,), (weights,), np.array(entry.vertices)[:, None, None], (), 0.0)


def read_tensor_product(path: str | os.PathLike[str]) -> tuple[TensorProductFriction, Units]:
    """The friction in the file ``path``, and its units.

    Raises:
        TensorProductError: the file can't be read or doesn't hold valid tensor-product friction.
    """
    return tensor_product_from_text(text_of(path, FORMAT, TensorProductError), str(path))


def write_tensor_product(law: TensorProductFriction, path: str | os.PathLike[str], units: Units | None = None) -> None:
    """Write ``law`` to ``path``, all or nothing.

    Raises:
        InputError: the file can't be written.
    """
    write_text(path, tensor_product_to_text(law, units))
