"""``diagnose``: which physics a model leaves out of each recording, half of whose blocks are held back for the test."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pyarrow as pa

from ...errors import InputError
from ...facade.diagnosing import Diagnosed, diagnose
from ...model import Model
from ...record import Record
from ..task import Task, estimates, number

__all__ = ["TASK"]


def _found(record: Record, model: Model, settings: Mapping[str, Any]) -> Diagnosed:
    return diagnose(record, model, blocks=int(settings.get("blocks", 6)), at_most=settings.get("at_most"))


def _run(record: Record, model: Model | None, settings: Mapping[str, Any]) -> dict[str, Any]:
    if model is None:
        raise InputError("diagnose", "has no model", "give --model")
    found = _found(record, model, settings).result
    causes = [
        {
            "effect": each.effect,
            "law": each.law,
            "presence": number(each.confidence),
            "component": each.component,
            "share": number(each.share),
        }
        for each in found.findings
    ]
    limits = [
        {"effect": each.effect, "parameter": each.parameter, "size": number(each.size), "unit": each.unit, "why": each.why}
        for each in found.limits
    ]
    tested = found.validation
    return {
        "parameters": estimates(found.refit),
        "mismatch": bool(found.mismatch),
        "verdict": found.sentence,
        "notes": list(found.notes),
        "causes": causes,
        "completeness": number(1.0 - found.unexplained.share),
        "limits": limits,
        "noe": number(tested.noe_refit),
        "noe_augmented": number(tested.noe_augmented),
        "force_error": None if found.force_errors is None else number(found.force_errors[0]),
    }


TASK = Task(
    "diagnose",
    lambda: {
        "mismatch": pa.bool_(),
        "verdict": pa.string(),
        "notes": pa.list_(pa.string()),
        "causes": pa.list_(
            pa.struct(
                {
                    "effect": pa.string(),
                    "law": pa.string(),
                    "presence": pa.float64(),
                    "component": pa.string(),
                    "share": pa.float64(),
                }
            )
        ),
        "completeness": pa.float64(),
        "limits": pa.list_(
            pa.struct(
                {
                    "effect": pa.string(),
                    "parameter": pa.string(),
                    "size": pa.float64(),
                    "unit": pa.string(),
                    "why": pa.string(),
                }
            )
        ),
        "noe": pa.float64(),
        "noe_augmented": pa.float64(),
        "force_error": pa.float64(),
    },
    _run,
    lambda record, model, settings: _found(record, model, settings).report(),
)
