"""What an experiment leaves in its folder: a bag for each run, model.yaml, experiment.json and report.html."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from ..bagio.write import write_record
from ..files import write_text
from ..identification.result import Identification
from ..model import Model
from ..model_file import write_model
from ..report.experiment import experiment_report
from .conductor import Outcome
from .knowledge import Run
from .motion import ExperimentError

__all__ = ["run_folder", "summary", "write_results", "write_run"]


def run_folder(out: Path, number: int) -> Path:
    """Where the bag of a run is."""
    return out / f"run_{number:02d}"


def write_run(out: Path, run: Run) -> None:
    """The bag of one run, with what was asked for and what of it counts."""
    begin, end = run.span
    asked = {f"fric.experiment.{name}": str(value) for name, value in asdict(run.setting).items()}
    asked["fric.experiment.counts"] = f"{begin:.6f} to {end:.6f} s"
    write_record(run.record, run_folder(out, run.number), metadata=asked)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _parameters(found: Identification | None) -> dict[str, Any] | None:
    if found is None:
        return None
    errors = found.model.standard_errors
    return {
        "method": found.method,
        "parameters": {
            name: {"value": found.model.value(name), "std": errors.get(name), "unit": found.model.unit(name)}
            for name in found.fitted
        },
        "status": found.status,
        "warnings": list(found.warnings),
    }


def summary(outcome: Outcome) -> dict[str, Any]:
    """All figures, for machines."""
    known = outcome.knowledge
    return {
        "format": "fric-experiment/1",
        "end": outcome.end.reason,
        "reached": outcome.end.reached,
        "runs": [
            {
                "run": run.number,
                **asdict(run.setting),
                "acting_proportional": _finite(run.gains[0]),
                "acting_derivative": _finite(run.gains[1]),
                "frequency_found": _finite(run.frequency),
                "damping_ratio": _finite(run.damping),
                "problem": run.problem,
            }
            for run in known.runs
        ],
        "oscillation": _parameters(known.oscillation),
        "dynamics": _parameters(known.dynamics),
        "model": known.best.method if known.best is not None else None,
        "messages": list(outcome.messages),
    }


def _model(outcome: Outcome, best: Identification) -> Model:
    usable = ", ".join(run.record.source for run in outcome.knowledge.usable)
    return replace(best.model, provenance={"experiment": outcome.end.reason, "method": best.method, "runs": usable or "none"})


def write_results(out: Path, outcome: Outcome) -> None:
    """Everything but the bags, or nothing.

    Raises:
        ExperimentError: the folder can't be written.
    """
    page = experiment_report(outcome)
    best = outcome.knowledge.best
    try:
        write_text(out / "experiment.json", json.dumps(summary(outcome), indent=2) + "\n")
        if best is not None:
            write_model(_model(outcome, best), out / "model.yaml")
        write_text(out / "report.html", page)
    except OSError as error:
        raise ExperimentError(out, f"cannot be written ({error})", "choose a folder that you can write to") from error
