"""The text form of tensor-product friction, ``format: fric-tensor-product/1`` (YAML): read, check, write.

A table over velocity isn't a list of effects, so it has a format of its own beside ``fric-model/1``. Numbers are written with
all their digits: what is read back is the same to the last bit.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from io import StringIO
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import YAMLError

from ..files import write_text
from ..record import Array, Units
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

_STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
_Number = Annotated[float, Field(strict=True)]
_Positive = Annotated[float, Field(strict=True, gt=0.0)]
_SUM = 1e-9


class _UnitsEntry(BaseModel):
    model_config = _STRICT
    position: Literal["m", "rad"]
    force: str = Field(min_length=1)


class _Branch(BaseModel):
    model_config = _STRICT
    vertices: Annotated[list[_Number], Field(min_length=1)]
    velocity: Annotated[list[_Number], Field(min_length=4)]
    weights: Annotated[list[list[_Number]], Field(min_length=4)]


class _File(BaseModel):
    model_config = _STRICT
    format: Literal["fric-tensor-product/1"]
    units: _UnitsEntry
    mass: _Positive
    speeding_up: _Branch
    slowing_down: _Branch


def _row(values: Array) -> CommentedSeq:
    held = CommentedSeq(float(value) for value in values)
    held.fa.set_flow_style()
    return held


def _entry(branch: TensorProduct) -> CommentedMap:
    return CommentedMap(
        {
            "vertices": _row(branch.vertices[:, 0, 0]),
            "velocity": _row(branch.grids[0]),
            "weights": CommentedSeq(_row(each) for each in branch.weights[0]),
        }
    )


def tensor_product_to_text(law: TensorProductFriction, units: Units | None = None) -> str:
    """``law`` as the text of a file; ``units`` are those of its positions and forces, m and N unless given."""
    units = Units() if units is None else units
    x, f = units.position, units.force
    root = CommentedMap({"format": FORMAT, "units": CommentedMap({"position": x, "force": f})})
    root["units"].fa.set_flow_style()
    root["mass"] = float(law.mass)
    root["speeding_up"], root["slowing_down"] = _entry(law.speeding_up), _entry(law.slowing_down)
    root.yaml_set_comment_before_after_key("mass", before=f"that the vertices refer to [{f} s^2/{x}]")
    what = "a_22 = sum_i w_i(v) a_i = -F(v)/(m v)"
    root.yaml_set_comment_before_after_key(
        "speeding_up", before=f"{what}: vertices a_i [1/s], and the weights w_i at each velocity [{x}/s]"
    )
    yaml = YAML(typ="rt")
    yaml.default_flow_style = False
    yaml.width = 120
    stream = StringIO()
    yaml.dump(root, stream)
    return stream.getvalue()


def tensor_product_from_text(text: str, source: str = "tensor product") -> tuple[TensorProductFriction, Units]:
    """The friction that ``text`` describes and its units; ``source`` names it in messages.

    Raises:
        TensorProductError: with line and reason.
    """
    try:
        tree = YAML(typ="rt").load(text)
    except YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f", line {mark.line + 1}" if mark is not None else ""
        problem = str(getattr(error, "problem", None) or "is not YAML")
        raise TensorProductError(f"{source}{line}", problem, "correct the YAML") from None
    if not isinstance(tree, Mapping):
        raise TensorProductError(source, "is not a tensor-product file", f"start it with 'format: {FORMAT}'")
    try:
        entry = _File.model_validate(tree)
    except ValidationError as error:
        # A misspelt key shows as one unknown and one missing: the unknown one says more.
        first = min(error.errors(), key=lambda found: found["type"] != "extra_forbidden")
        name = ".".join(str(part) for part in first["loc"])
        raise TensorProductError(
            f"{source}, line {_line(tree, first['loc'])}", f"'{name}': {first['msg'].lower()}", "see the format's description"
        ) from None
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


def _line(tree: Any, location: tuple[int | str, ...]) -> int:
    """Line, counted from 1, of the entry at ``location``, or of the nearest one around it."""
    line = 1
    for key in location:
        try:
            at = tree.lc.item(key) if isinstance(key, int) else tree.lc.key(key)
            line = int(at[0]) + 1
            tree = tree[key]
        except (KeyError, IndexError, TypeError, AttributeError):
            break
    return line


def read_tensor_product(path: str | os.PathLike[str]) -> tuple[TensorProductFriction, Units]:
    """The friction in the file ``path``, and its units.

    Raises:
        TensorProductError: the file can't be read or doesn't hold valid tensor-product friction.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise TensorProductError(path, f"cannot be read ({error})", f"give the path of a {FORMAT} text file") from None
    return tensor_product_from_text(text, str(path))


def write_tensor_product(law: TensorProductFriction, path: str | os.PathLike[str], units: Units | None = None) -> None:
    """Write ``law`` to ``path``, all or nothing.

    Raises:
        InputError: the file can't be written.
    """
    write_text(path, tensor_product_to_text(law, units))
