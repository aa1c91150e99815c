"""``fric identify``: parameters of a model from recordings."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from .options import (
    EndOption,
    JointOption,
    JsonOption,
    OutOption,
    ReadOptions,
    RepairOption,
    StartOption,
    TimeOption,
    TopicOption,
    progress,
    read_all,
)

if TYPE_CHECKING:
    from ..identification.result import Identification, Options, Score
    from ..identification.uncertainty import Uncertainty
    from ..model import Model
    from ..record import Record

__all__ = ["register"]

_DEFAULT_TERMS = "coulomb,viscous,bias"


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command(
        "identify", no_args_is_help=True, epilog="Example: fric identify bags/slide --validate bags/slide_2 --out found"
    )(identify)


def identify(
    train: Annotated[list[Path], typer.Argument(help="Recordings to fit: rosbag2 folders or files.")],
    out: OutOption = Path("identified"),
    validate: Annotated[
        list[Path] | None, typer.Option("--validate", help="Recording kept apart from the fit; may be repeated.")
    ] = None,
    model: Annotated[
        Path | None, typer.Option("--model", help="Model file whose terms to fit and whose values to start from.")
    ] = None,
    terms: Annotated[
        str, typer.Option("--terms", help="Effects to fit when no model file is given, separated by commas.")
    ] = _DEFAULT_TERMS,
    method: Annotated[
        str,
        typer.Option("--method", help="How to fit; 'fric model methods' lists them all, with the experiment that each needs."),
    ] = "inverse-dynamics",
    joint: JointOption = None,
    cutoff: Annotated[
        float | None, typer.Option("--cutoff", help="Low-pass filter on the position [Hz]; a tenth of the rate, at most 100.")
    ] = None,
    decimation: Annotated[
        int | None, typer.Option("--decimation", help="Keep every n-th filtered equation; rate over cutoff.")
    ] = None,
    rest_velocity: Annotated[
        float | None, typer.Option("--rest-velocity", help="A joint that stays slower than this rests [m/s or rad/s].")
    ] = None,
    hold: Annotated[list[str] | None, typer.Option("--hold", help="Hold this parameter at its value; may be repeated.")] = None,
    free: Annotated[list[str] | None, typer.Option("--free", help="Fit this shape parameter too; may be repeated.")] = None,
    robust: Annotated[
        bool, typer.Option("--robust", help="Weigh down outliers (Huber) instead of plain least squares.")
    ] = False,
    horizon: Annotated[
        float | None, typer.Option("--horizon", help="Length of the free runs of output-error [s]; the whole recording.")
    ] = None,
    gain: Annotated[
        list[str] | None,
        typer.Option("--gain", help="P,D of the feedback of a recorded oscillation; once for each recording, in their order."),
    ] = None,
    uncertainty: Annotated[
        str,
        typer.Option(
            "--uncertainty", help="Intervals by sandwich (standard errors), bootstrap, or profile; empty: errors only."
        ),
    ] = "",
    repair: RepairOption = False,
    time: TimeOption = "stamp",
    start: StartOption = None,
    end: EndOption = None,
    topic: TopicOption = None,
    as_json: JsonOption = False,
) -> None:
    """Identify a model's parameters from recordings and write model.yaml, identification.json and report.html."""
    from ..identification.equations import nominal_conditions
    from ..identification.result import Options

    _check(cutoff, decimation, rest_velocity, horizon)
    options = Options(
        cutoff, decimation, rest_velocity, tuple(hold or ()), tuple(free or ()), robust, horizon, _gains(gain or [], len(train))
    )
    reading = ReadOptions(joint, repair, time, start, end, tuple(topic or ()))
    kept_apart = validate or []
    _refuse_overlap(train, kept_apart)
    progress(f"reading {len(train) + len(kept_apart)} recording(s)")
    records = read_all(train, reading)
    validation = read_all(kept_apart, reading)
    structure = _structure(model, terms, records[0])
    # What a load or a temperature is relative to belongs to the model: a recording under another load has another mean.
    structure = replace(structure, nominal=nominal_conditions(records) | dict(structure.nominal))
    records, validation = ([replace(each, nominal=structure.nominal) for each in held] for held in (records, validation))
    progress(f"fitting {', '.join(structure.names)} by {method}")
    result = _fit(method, structure, records, validation, options)
    summary = _summary(result)
    if uncertainty:
        from ..identification.uncertainty import assess

        progress(f"finding intervals by {uncertainty}")
        found = assess(result, records, options, uncertainty)
        summary["uncertainty"] = _uncertainty_json(found)
    _write(out, result, records, validation, options, summary)
    if as_json:
        typer.echo(json.dumps(summary))
    else:
        _print(result, out)
        if uncertainty:
            _print_intervals(found, structure)


def _check(cutoff: float | None, decimation: int | None, rest_velocity: float | None, horizon: float | None) -> None:
    given = {"--cutoff": cutoff, "--decimation": decimation, "--rest-velocity": rest_velocity, "--horizon": horizon}
    for name, value in given.items():
        lowest = 0.0 if name == "--rest-velocity" else 1e-12
        if value is not None and not (math.isfinite(value) and value >= lowest):
            raise InputError(name, f"is {value}", "give a positive number")


def _gains(given: list[str], n_recordings: int) -> tuple[tuple[float, float], ...]:
    """P and D of each recording, from texts such as ``0.6,0.01``."""
    found = []
    for text in given:
        try:
            p, d = (float(part) for part in text.split(","))
        except ValueError:
            raise InputError("--gain", f"is '{text}'", "give two numbers, such as 0.6,0.01") from None
        if not (math.isfinite(p) and math.isfinite(d)):
            raise InputError("--gain", f"is '{text}'", "give two finite numbers, such as 0.6,0.01")
        found.append((p, d))
    if found and len(found) != n_recordings:
        raise InputError("--gain", f"is given {len(found)} times for {n_recordings} recordings", "give it once for each")
    return tuple(found)


def _refuse_overlap(train: list[Path], validation: list[Path]) -> None:
    same = {path.resolve() for path in train} & {path.resolve() for path in validation}
    if same:
        raise InputError(same.pop(), "is both fitted and validated on", "keep a recording apart for --validate")


def _structure(model: Path | None, terms: str, record: Record) -> Model:
    """The model to fit: from a file, or from a list of effects with start values of one."""
    from ..identification.start import start_model
    from ..model_file import read_model

    if model is not None:
        return replace(read_model(model), joint=record.joint, standard_errors={}, provenance={})
    names = [name.strip() for name in terms.split(",") if name.strip()]
    return start_model(names, record.joint, record.units)


def _fit(method: str, structure: Model, records: list[Record], validation: list[Record], options: Options) -> Identification:
    from ..identification import METHODS
    from ..identification.scoring import score

    if method not in METHODS:
        raise InputError("--method", f"'{method}' is not known", f"use one of {', '.join(METHODS)}")
    result = METHODS[method].fit(structure, records, options)
    provenance = {
        "recordings": ", ".join(record.source for record in records),
        "method": method,
        "equations": str(result.train.n_samples),
    }
    result = replace(result, model=replace(result.model, provenance=provenance))
    if validation:
        notes = tuple(f"validation, {record.source}: {note}" for record in validation for note in record.notes)
        notes += result.remarks_on(validation)
        result = replace(result, validation=score(result.model, validation, options), notes=(*result.notes, *notes))
    return result


def _score_json(score: Score | None) -> dict[str, float | None] | None:
    """A score; what a method has no figure for is null."""
    return None if score is None else {name: value if math.isfinite(value) else None for name, value in asdict(score).items()}


def _summary(result: Identification) -> dict[str, Any]:
    """The JSON object of the contract."""
    return {
        "parameters": {
            p.name: {
                "value": p.value,
                "std": result.model.standard_errors.get(p.name) if p.name in result.fitted else None,
                "unit": p.declaration.unit(result.model.units),
                "fitted": p.name in result.fitted,
            }
            for p in result.model.parameters()
        },
        "method": result.method,
        "train": _score_json(result.train),
        "validation": _score_json(result.validation),
        "correlation": {
            "parameters": list(result.fitted),
            "matrix": [[None if math.isnan(value) else value for value in row] for row in result.correlation.tolist()],
        },
        "status": result.status,
        "warnings": list(result.warnings),
        "notes": list(result.notes),
    }


def _write(
    out: Path,
    result: Identification,
    records: list[Record],
    validation: list[Record],
    options: Options,
    summary: dict[str, Any],
) -> None:
    """Every result, or none: all are made before the first is written."""
    from ..files import write_text
    from ..identification.static_maps.result import StaticMap
    from ..model_file import write_model
    from ..report.identification import identification_report
    from ..report.static_map import static_map_report

    attachments = result.attachments
    if isinstance(result, StaticMap):
        page = static_map_report(result)
    else:
        page = identification_report(result, records, validation, options)
    write_text(out / "identification.json", json.dumps(summary, indent=2) + "\n")
    write_model(result.model, out / "model.yaml")
    for name, text in attachments.items():
        write_text(out / name, text)
    write_text(out / "report.html", page)


def _uncertainty_json(found: Uncertainty) -> dict[str, Any]:
    """Intervals by parameter; null where there is no limit, or no second recording."""

    def number(value: float) -> float | None:
        return value if math.isfinite(value) else None

    return {
        "kind": found.kind,
        "probability": found.probability,
        "parameters": {
            name: {
                "std": number(float(found.standard_errors[k])),
                "lower": number(float(found.lower[k])),
                "upper": number(float(found.upper[k])),
                "std_over_restarts": number(float(found.restarts[k])),
                "std_over_recordings": number(float(found.recordings[k])),
            }
            for k, name in enumerate(found.names)
        },
        "notes": list(found.notes),
    }


def _print_intervals(found: Uncertainty, model: Model) -> None:
    from rich.console import Console
    from rich.table import Table

    shown = Table(
        box=None, pad_edge=False, title=f"{found.kind}: {100 * found.probability:g} % intervals", title_justify="left"
    )
    shown.add_column("parameter")
    for column in ("from", "to", "std over restarts", "over recordings"):
        shown.add_column(column, justify="right")
    shown.add_column("unit")
    for k, name in enumerate(found.names):
        numbers = (found.lower[k], found.upper[k], found.restarts[k], found.recordings[k])
        texts = [f"{value:.5g}" if math.isfinite(value) else "-" for value in numbers]
        shown.add_row(name, *texts, model.unit(name))
    console = Console()
    console.print(shown)
    for line in found.notes:
        console.print(f"- {line}", highlight=False, markup=False)


def _print(result: Identification, out: Path) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console()
    shown = Table(box=None, pad_edge=False)
    shown.add_column("parameter")
    for column in ("value", "standard error"):
        shown.add_column(column, justify="right")
    shown.add_column("unit")
    for parameter in result.model.parameters():
        error = result.model.standard_errors.get(parameter.name)
        text = "held" if parameter.name not in result.fitted else "not known" if error is None else f"{error:.2g}"
        shown.add_row(parameter.name, f"{parameter.value:.6g}", text, parameter.declaration.unit(result.model.units))
    console.print(shown)
    units = result.model.units
    for name, score in (("train", result.train), ("validation", result.validation)):
        if score is not None:
            run = (
                f", free-run position RMSE {score.position_rmse:.3g} {units.position}"
                if math.isfinite(score.position_rmse)
                else ""
            )
            force = f"relative force error {score.relative_force_error_percent:.2f} %, NOE {score.noe:.4f} %"
            console.print(f"{name}: {force}{run}", highlight=False)
    for line in (*result.notes, *result.warnings):
        console.print(f"- {line}", highlight=False, markup=False)
    console.print(f"status: {result.status}", highlight=False, markup=False)
    written = ", ".join([str(out / "model.yaml"), *result.attachments, "identification.json", "report.html"])
    console.print(f"written: {written}", highlight=False, markup=False)
