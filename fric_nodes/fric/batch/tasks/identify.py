"""``identify``: the parameters of a model from each recording."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pyarrow as pa

from ...errors import InputError
from ...facade.identifying import identify
from ...model import Model
from ...record import Record
from ..task import Task, estimates, number

__all__ = ["TASK"]


def _run(record: Record, model: Model | None, settings: Mapping[str, Any]) -> dict[str, Any]:
    if model is None:
        raise InputError("identify", "has no model", "give --model or --terms")
    found = identify(record, model, **settings).result
    return {
        "parameters": estimates(found.model),
        "force_error": number(found.train.relative_force_error_percent),
        "noe": number(found.train.noe),
        "verdict": found.status,
        "warnings": list(found.warnings),
    }


TASK = Task(
    "identify",
    lambda: {
        "force_error": pa.float64(),
        "noe": pa.float64(),
        "verdict": pa.string(),
        "warnings": pa.list_(pa.string()),
    },
    _run,
    lambda record, model, settings: identify(record, model, **settings).report(),
)
