"""The text form of a tensor-product controller, ``format: fric-tp-controller/1`` (YAML): write, read, prove again.

    format: fric-tp-controller/1
    units: {position: m, force: N}
    states: [integral, error, velocity]      # in this order everywhere
    domain: [0.01, 0.01, 0.5]                # largest magnitude of each; what follows is over it, and over the limit
    limit: 30.0
    input: F                                 # F: a force; 1: an opening from -1 to 1
    decay: 3.0                               # [1/s]
    scheduling: [{name: velocity, grid: [...], weights: [[...], ...]}]
    vertices: [{gain: [...], variants: [{a: [[...], ...], b: [...]}]}]
    lyapunov: [[...], ...]                   # P of V = x' P x

Decay rate and input bound are proved anew on every reading: a file that somebody changed is refused unless it still holds.
"""

from __future__ import annotations

import os
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, Field
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from ...files import write_text
from ...record import Array
from ...text_form import STRICT, Number, Positive, UnitsEntry, dumped, loaded, row, text_of, validated
from .certificate import certify
from .design import TensorProductController
from .quasi_lpv import TensorProductControlError

__all__ = ["FORMAT", "controller_from_text", "controller_to_text", "read_tp_controller", "write_tp_controller"]

FORMAT = "fric-tp-controller/1"

_CONVEX = 1e-9  # numerical tolerance, as in :mod:`.polytope`
_STATES = ["integral", "error", "velocity", "force"]

Row = Annotated[list[Number], Field(min_length=1)]


class _Variant(BaseModel):
    model_config = STRICT
    a: Annotated[list[Row], Field(min_length=3, max_length=4)]
    b: Row


class _Vertex(BaseModel):
    model_config = STRICT
    gain: Row
    variants: Annotated[list[_Variant], Field(min_length=1)]


class _Table(BaseModel):
    model_config = STRICT
    name: Literal["velocity", "position"]
    grid: Annotated[list[Number], Field(min_length=2)]
    weights: Annotated[list[Row], Field(min_length=2)]


class _File(BaseModel):
    model_config = STRICT
    format: Literal["fric-tp-controller/1"]
    units: UnitsEntry
    states: Annotated[list[str], Field(min_length=3, max_length=4)]
    domain: list[Positive]
    limit: Positive
    input: Literal["F", "1"]
    decay: Positive
    scheduling: Annotated[list[_Table], Field(min_length=1, max_length=2)]
    vertices: Annotated[list[_Vertex], Field(min_length=1)]
    lyapunov: list[Row]


def _rows(values: Array) -> CommentedSeq:
    return CommentedSeq(row(each) for each in values)


def controller_to_text(controller: TensorProductController) -> str:
    """``controller`` as the text of a file."""
    root = CommentedMap({"format": FORMAT})
    root["units"] = CommentedMap({"position": controller.units[0], "force": controller.units[1]})
    root["units"].fa.set_flow_style()
    root["states"] = CommentedSeq(controller.states)
    root["states"].fa.set_flow_style()
    root["domain"] = row(controller.domain)
    root["limit"], root["input"], root["decay"] = float(controller.limit), controller.input_unit, float(controller.decay)
    root["scheduling"] = CommentedSeq(
        CommentedMap({"name": name, "grid": row(grid), "weights": _rows(weights)}) for name, grid, weights in controller.tables
    )
    vertices = CommentedSeq()
    for gain, a, b in zip(controller.gains, controller.a, controller.b, strict=True):
        variants = CommentedSeq(CommentedMap({"a": _rows(x), "b": row(y)}) for x, y in zip(a, b, strict=True))
        vertices.append(CommentedMap({"gain": row(gain), "variants": variants}))
    root["vertices"] = vertices
    root["lyapunov"] = _rows(controller.p)
    root.yaml_set_comment_before_after_key("domain", before="largest magnitude of each state; gains and vertices are over it")
    root.yaml_set_comment_before_after_key("lyapunov", before="P of V = x' P x")
    return dumped(root)


def controller_from_text(text: str, source: str = "tensor-product controller") -> TensorProductController:
    """The controller that ``text`` describes; ``source`` names it in messages.

    Raises:
        TensorProductControlError: with line and reason; or decay rate and input bound don't hold.
    """
    tree = loaded(text, source, "a tensor-product controller", FORMAT, TensorProductControlError)
    entry = validated(_File, tree, tree, source, TensorProductControlError)
    n, r = len(entry.states), len(entry.vertices)
    if entry.states != _STATES[:n] or len(entry.domain) != n:
        raise TensorProductControlError(source, f"states {entry.states}", f"give {', '.join(_STATES)}, or the first three")
    tables = tuple(_table(each, source) for each in entry.scheduling)
    if [table[0] for table in tables] != ["velocity", "position"][: len(tables)]:
        raise TensorProductControlError(
            source, "the scheduling isn't that of a design", "give velocity, or velocity and position"
        )
    if int(np.prod([table[2].shape[1] for table in tables])) != r:
        raise TensorProductControlError(source, f"{r} vertices for these weights", "give one for each combination of weights")
    a = _array([[v.a for v in each.variants] for each in entry.vertices], (r, -1, n, n), source, "a")
    b = _array([[v.b for v in each.variants] for each in entry.vertices], (r, a.shape[1], n), source, "b")
    gains = _array([each.gain for each in entry.vertices], (r, n), source, "gain")
    p = _array(entry.lyapunov, (n, n), source, "lyapunov")
    if not np.array_equal(p, p.T):
        raise TensorProductControlError(source, "'lyapunov' isn't symmetric", "take the file as the design wrote it")
    proof = certify(a, b, gains, p)
    if proof.decay < entry.decay or not proof.input_bound:
        i, j, _ = proof.pair
        lost = f"decay rate {proof.decay:.4g} 1/s" if proof.decay < entry.decay else "a command beyond the limit"
        problem = (
            f"the proof of {entry.decay:g} 1/s within the limit fails: {lost}, least at the vertex pair {i + 1} and {j + 1}"
        )
        raise TensorProductControlError(source, problem, "design it again")
    return TensorProductController(
        tuple(entry.states), np.array(entry.domain), entry.limit, entry.input, (entry.units.position, entry.units.force),
        tables, a, b, gains, p, entry.decay, proof,
    )  # fmt: skip


def _array(values: Any, shape: tuple[int, ...], source: str, name: str) -> Array:
    try:
        return np.array(values, dtype=np.float64).reshape(shape)
    except ValueError:
        wanted = " x ".join("any" if size < 0 else str(size) for size in shape)
        raise TensorProductControlError(source, f"'{name}' hasn't the shape {wanted}", "give rows of equal length") from None


def _table(entry: _Table, source: str) -> tuple[str, Array, Array]:
    grid = np.array(entry.grid)
    weights = _array(entry.weights, (grid.shape[0], -1), source, "weights")
    if np.any(np.diff(grid) <= 0.0):
        raise TensorProductControlError(source, f"the grid of {entry.name} doesn't increase", "sort it and drop what is double")
    if np.max(np.abs(weights.sum(axis=1) - 1.0)) > _CONVEX or np.min(weights) < -_CONVEX:
        raise TensorProductControlError(
            source, f"the weights of {entry.name} aren't convex", "let each row sum to one, none below 0"
        )
    return entry.name, grid, weights


def read_tp_controller(path: str | os.PathLike[str]) -> TensorProductController:
    """The controller in the file ``path``.

    Raises:
        TensorProductControlError: the file can't be used, or what it claims doesn't hold.
    """
    return controller_from_text(text_of(path, FORMAT, TensorProductControlError), str(path))


def write_tp_controller(controller: TensorProductController, path: str | os.PathLike[str]) -> None:
    """Write ``controller`` to ``path``, all or nothing.

    Raises:
        InputError: the file can't be written.
    """
    write_text(path, controller_to_text(controller))
