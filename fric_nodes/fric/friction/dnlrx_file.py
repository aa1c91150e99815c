"""The text form of a DNLRX, ``format: fric-dnlrx/1`` (YAML): read, check, write.

A DNLRX isn't a list of effects and only means something at its own sample time, so it has a format of its own beside
``fric-model/1``. Numbers are written with all their digits: what is read back is the same to the last bit.
"""

from __future__ import annotations

import os
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, Field
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from ..files import write_text
from ..record import Units
from ..text_form import STRICT, Number, Positive, UnitsEntry, dumped, line_of, loaded, row, text_of, units_entry, validated
from .dnlrx import DnlrxError, DnlrxModel

__all__ = ["FORMAT", "dnlrx_from_text", "dnlrx_to_text", "read_dnlrx", "write_dnlrx"]

FORMAT = "fric-dnlrx/1"


class _File(BaseModel):
    model_config = STRICT
    format: Literal["fric-dnlrx/1"]
    units: UnitsEntry
    sample_time: Positive
    thresholds: list[Positive]
    position_filter: Annotated[list[Number], Field(min_length=1)]
    deformation_filter: Annotated[list[list[Number]], Field(min_length=1)]
    offset: Number = 0.0


def dnlrx_to_text(model: DnlrxModel, units: Units | None = None) -> str:
    """``model`` as the text of a file; ``units`` are those of its positions and forces, m and N unless given."""
    units = Units() if units is None else units
    x, f = units.position, units.force

    root = CommentedMap({"format": FORMAT, "units": units_entry(units)})
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
    return dumped(root)


def dnlrx_from_text(text: str, source: str = "DNLRX") -> tuple[DnlrxModel, Units]:
    """The DNLRX that ``text`` describes and its units; ``source`` names it in messages.

    Raises:
        DnlrxError: with line and reason.
    """
    tree = loaded(text, source, "a DNLRX file", FORMAT, DnlrxError)
    entry = validated(_File, tree, tree, source, DnlrxError)
    for number, theta in enumerate(entry.deformation_filter):
        if len(theta) != len(entry.thresholds):
            where = f"{source}, line {line_of(tree, ('deformation_filter', number))}"
            problem = f"'deformation_filter.{number}' has {len(theta)} numbers for {len(entry.thresholds)} thresholds"
            raise DnlrxError(where, problem, "give one number for each threshold")
    theta_rows = np.array(entry.deformation_filter, dtype=np.float64).reshape(len(entry.deformation_filter), -1)
    model = DnlrxModel(entry.sample_time, np.array(entry.thresholds), np.array(entry.position_filter), theta_rows, entry.offset)
    return model, Units(entry.units.position, entry.units.force)


def read_dnlrx(path: str | os.PathLike[str]) -> tuple[DnlrxModel, Units]:
    """The DNLRX in the file ``path``, and its units.

    Raises:
        DnlrxError: the file can't be read or doesn't hold a valid DNLRX.
    """
    return dnlrx_from_text(text_of(path, FORMAT, DnlrxError), str(path))


def write_dnlrx(model: DnlrxModel, path: str | os.PathLike[str], units: Units | None = None) -> None:
    """Write ``model`` to ``path``, all or nothing.

    Raises:
        InputError: the file can't be written.
    """
    write_text(path, dnlrx_to_text(model, units))
