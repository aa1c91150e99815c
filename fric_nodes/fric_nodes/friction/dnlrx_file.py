"""The text form of a DNLRX, ``format: fric-dnlrx/1`` (YAML): read, check, write.

A DNLRX isn't a list of effects and only means something at its own sample time, so it has a format of its own beside
``fric-model/1``. Numbers are written with all their digits: what is read back is the same to the last bit.
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
from ..record import Units
from .dnlrx import DnlrxError, DnlrxModel

__all__ = ["FORMAT", "dnlrx_from_text", "dnlrx_to_text", "read_dnlrx", "write_dnlrx"]

FORMAT = "fric-dnlrx/1"

_STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
_Number = Annotated[float, Field(strict=True)]
_Positive = Annotated[float, Field(strict=True, gt=0.0)]


class _UnitsEntry(BaseModel):
    model_config = _STRICT
    position: Literal["m", "rad"]
    force: str = Field(min_length=1)


class _File(BaseModel):
    model_config = _STRICT
    format: Literal["fric-dnlrx/1"]
    units: _UnitsEntry
    sample_time: _Positive
    thresholds: list[_Positive]
    position_filter: Annotated[list[_Number], Field(min_length=1)]
    deformation_filter: Annotated[list[list[_Number]], Field(min_length=1)]
    offset: _Number = 0.0


def dnlrx_to_text(model: DnlrxModel, units: Units | None = None) -> str:
    """``model`` as the text of a file; ``units`` are those of its positions and forces, m and N unless given."""
    units = Units() if units is None else units
    x, f = units.position, units.force

    def row(values: np.ndarray[Any, Any]) -> CommentedSeq:
        held = CommentedSeq(float(value) for value in values)
        held.fa.set_flow_style()
        return held

    root = CommentedMap({"format": FORMAT})
    root["units"] = CommentedMap({"position": x, "force": f})
    root["units"].fa.set_flow_style()
    root["sample_time"] = float(model.sample_time)
    root["thresholds"] = row(model.thresholds)
    root["position_filter"] = row(model.position_filter)
    root["deformation_filter"] = CommentedSeq(row(theta) for theta in model.deformation_filter)
    root["offset"] = float(model.offset)
    comments = {
        "sample_time": "T [s]",
        "thresholds": f"Delta_i [{x}]",
        "position_filter": f"g_j [{f}/{x}], j = 0 ... n",
        "deformation_filter": f"Theta_j [{f}/{x}], one row for each delay j = 0 ... n_delta, one number for each threshold",
        "offset": f"b [{f}]",
    }
    for key, comment in comments.items():
        root.yaml_set_comment_before_after_key(key, before=comment)
    yaml = YAML(typ="rt")
    yaml.default_flow_style = False
    yaml.width = 120
    stream = StringIO()
    yaml.dump(root, stream)
    return stream.getvalue()


def dnlrx_from_text(text: str, source: str = "DNLRX") -> tuple[DnlrxModel, Units]:
    """The DNLRX that ``text`` describes and its units; ``source`` names it in messages.

    Raises:
        DnlrxError: with line and reason.
    """
    try:
        tree = YAML(typ="rt").load(text)
    except YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f", line {mark.line + 1}" if mark is not None else ""
        raise DnlrxError(f"{source}{line}", str(getattr(error, "problem", None) or "is not YAML"), "correct the YAML") from None
    if not isinstance(tree, Mapping):
        raise DnlrxError(source, "is not a DNLRX file", f"start it with 'format: {FORMAT}'")
    try:
        entry = _File.model_validate(tree)
    except ValidationError as error:
        # A misspelt key shows as one unknown and one missing: the unknown one says more.
        first = min(error.errors(), key=lambda found: found["type"] != "extra_forbidden")
        name = ".".join(str(part) for part in first["loc"])
        where = f"{source}, line {_line(tree, first['loc'])}"
        if first["type"] == "extra_forbidden":
            raise DnlrxError(where, f"unknown key '{name}'", f"use only {', '.join(_File.model_fields)}") from None
        if first["type"] == "missing":
            raise DnlrxError(where, f"'{name}' is missing", "add it") from None
        remedy = f"{first['msg'][0].lower()}{first['msg'][1:]}"
        raise DnlrxError(where, f"'{name}' is {first['input']!r}", remedy) from None
    for number, theta in enumerate(entry.deformation_filter):
        if len(theta) != len(entry.thresholds):
            where = f"{source}, line {_line(tree, ('deformation_filter', number))}"
            problem = f"'deformation_filter.{number}' has {len(theta)} numbers for {len(entry.thresholds)} thresholds"
            raise DnlrxError(where, problem, "give one number for each threshold")
    theta_rows = np.array(entry.deformation_filter, dtype=np.float64).reshape(len(entry.deformation_filter), -1)
    model = DnlrxModel(entry.sample_time, np.array(entry.thresholds), np.array(entry.position_filter), theta_rows, entry.offset)
    return model, Units(entry.units.position, entry.units.force)


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


def read_dnlrx(path: str | os.PathLike[str]) -> tuple[DnlrxModel, Units]:
    """The DNLRX in the file ``path``, and its units.

    Raises:
        DnlrxError: the file can't be read or doesn't hold a valid DNLRX.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DnlrxError(path, f"cannot be read ({error})", f"give the path of a {FORMAT} text file") from None
    return dnlrx_from_text(text, str(path))


def write_dnlrx(model: DnlrxModel, path: str | os.PathLike[str], units: Units | None = None) -> None:
    """Write ``model`` to ``path``, all or nothing.

    Raises:
        InputError: the file can't be written.
    """
    write_text(path, dnlrx_to_text(model, units))
