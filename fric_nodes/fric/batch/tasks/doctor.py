"""``doctor``: faults of the instruments of each recording."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pyarrow as pa

from ...identification.screen import screened
from ...instrument import faults, inspect
from ...model import Model
from ...record import Record
from ..task import Task, number

__all__ = ["TASK"]


def _run(record: Record, model: Model | None, settings: Mapping[str, Any]) -> dict[str, Any]:
    findings = inspect([screened(record)], model, settings)
    told = [
        {"check": each.check, "verdict": each.verdict, "value": number(each.value), "detail": each.detail} for each in findings
    ]
    return {"faults": [each.check for each in faults(findings)], "checks": told}


TASK = Task(
    "doctor",
    lambda: {
        "faults": pa.list_(pa.string()),
        "checks": pa.list_(
            pa.struct({"check": pa.string(), "verdict": pa.string(), "value": pa.float64(), "detail": pa.string()})
        ),
    },
    _run,
    has_parameters=False,
)
