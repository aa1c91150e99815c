"""The examinee's side: one case folder in, its findings out, in processes that are given nothing but the folder.

A case folder holds ``train/`` and ``validation/`` (bags) and ``nominal.yaml``. Written beside them are ``report.json``,
``prediction.csv``, ``model.yaml`` where the diagnosis grows a model, and ``done.json``, which says that the case is
finished, for which seal, and how long it took. After the key is opened, :func:`own_fit` says how well the true structure
does on the same data when it is fitted by the same means: it is handed to the diagnosis as the nominal model.
"""

from __future__ import annotations

import importlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ...bagio import read_record
from ...errors import InputError
from ...files import write_text
from ...model import Model
from ...model_file import model_from_text, read_model, write_model
from ...record import Array, Record

__all__ = ["DIAGNOSE", "Diagnosed", "entered", "examine", "own_fit"]

DIAGNOSE = "fric.diagnosis:diagnose"
"""Where the diagnosis is, as ``module:function``."""

COLUMNS = ("time", "force_measured", "force_nominal", "force_refit", "force_augmented")


class Diagnosed(Protocol):
    """What a diagnosis gives."""

    @property
    def prediction(self) -> Sequence[Any]:
        """For each validation recording its columns, by name or as attributes; arrays of shape ``(n_samples,)``."""

    def report(self) -> dict[str, Any]:
        """The content of ``report.json``."""


Diagnose = Callable[..., Diagnosed]


def entered(entry: str) -> Diagnose:
    """The function named ``module:function``.

    Raises:
        InputError: there is none.
    """
    module, _, name = entry.partition(":")
    try:
        return getattr(importlib.import_module(module), name)  # type: ignore[no-any-return]
    except (ImportError, AttributeError) as error:
        raise InputError(entry, f"no diagnosis is there ({error})", "name it as module:function") from error


def _read(folder: Path, nominal: Model) -> tuple[list[Record], list[Record]]:
    conditions = dict(nominal.nominal)
    return [replace(read_record(folder / "train"), nominal=conditions)], [
        replace(read_record(folder / "validation"), nominal=conditions)
    ]


def examine(folder: str, seal: str, entry: str = DIAGNOSE, at_most: float | None = None) -> float:
    """Diagnose the case in ``folder`` and write what was found; the time it took [s].

    A diagnosis that fails counts as one that said nothing: the failure is written down and scored.
    """
    at = Path(folder)
    nominal = read_model(at / "nominal.yaml")
    train, validation = _read(at, nominal)
    diagnose = entered(entry) if at_most is None else partial(entered(entry), at_most=at_most)
    began = time.perf_counter()
    failure = ""
    try:
        diagnosis = diagnose(train, validation, nominal)
        report = diagnosis.report()
        write_text(at / "report.json", json.dumps(report, indent=1, default=_plain))
        write_text(at / "prediction.csv", _prediction(diagnosis.prediction))
        grown = getattr(diagnosis, "model", None)
        if isinstance(grown, Model):
            write_model(grown, at / "model.yaml")
    except Exception as error:  # whatever goes wrong in it is a result of the examination, not its end
        failure = f"{type(error).__name__}: {error}"
    seconds = time.perf_counter() - began
    write_text(at / "done.json", json.dumps({"seal": seal, "seconds": seconds, "failure": failure, "at_most": at_most}))
    return seconds


def own_fit(folder: str, structure: str, entry: str = DIAGNOSE) -> float:
    """NOE on the validation [%] of the true structure (text of a model file) fitted by the diagnosis; NaN where that fails."""
    at = Path(folder)
    kept = at / "own_fit.json"
    if kept.exists():  # of a run that was stopped
        return float(json.loads(kept.read_text())["noe"])
    try:
        model = model_from_text(structure, "true structure")
        train, validation = _read(at, model)
        noe = _reference(entry, model, train, validation, json.loads((at / "report.json").read_text()))
    except Exception:  # no reference for this case; the score says for how many
        noe = float("nan")
    write_text(kept, json.dumps({"noe": noe}))
    return noe


def _reference(entry: str, model: Model, train: Sequence[Record], validation: Sequence[Record], report: Any) -> float:
    """By the diagnosis itself, at the bandwidth at which it judged the case; another entry is handed the true structure."""
    if entry == DIAGNOSE:
        refit_noe = entered(DIAGNOSE.replace(":diagnose", ":refit_noe"))
        return float(refit_noe(model, train, validation, report["observer_bandwidth"]))  # type: ignore[arg-type]
    return float(entered(entry)(train, validation, model).report()["validation"]["noe_refit"])


def _plain(value: object) -> object:
    """Numbers of numpy as numbers of JSON."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} has no place in a report")


def _prediction(records: Sequence[Any]) -> str:
    """The file of predictions; several recordings follow one another."""
    lines = [",".join(COLUMNS)]
    for record in records:
        columns: list[Array] = [
            np.asarray(record[name] if isinstance(record, Mapping) else getattr(record, name)) for name in COLUMNS
        ]
        lines += [",".join(f"{value:.8g}" for value in row) for row in zip(*columns, strict=True)]
    return "\n".join(lines) + "\n"
