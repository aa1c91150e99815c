"""``fric diagnose``: what physics a nominal model leaves out of what recordings show."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from fric.errors import InputError

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
    from fric.diagnosis import Diagnosis
    from fric.record import Record

__all__ = ["register", "write_diagnosis"]


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command(
        "diagnose",
        no_args_is_help=True,
        epilog="Example: fric diagnose bags/slide --validate bags/slide_2 --model nominal.yaml --out diagnosis",
    )(diagnose)


def diagnose(
    train: Annotated[list[Path], typer.Argument(help="Recordings to learn from: rosbag2 folders or files.")],
    model: Annotated[Path, typer.Option("--model", help="Model file whose physics is in question.")],
    validate: Annotated[
        list[Path] | None, typer.Option("--validate", help="Recording that nothing is learnt from; may be repeated.")
    ] = None,
    blocks: Annotated[
        int | None,
        typer.Option("--blocks", help="In place of --validate: cut each recording into so many blocks, hold every other back."),
    ] = None,
    out: OutOption = Path("diagnosis"),
    joint: JointOption = None,
    repair: RepairOption = False,
    time: TimeOption = "stamp",
    start: StartOption = None,
    end: EndOption = None,
    topic: TopicOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find what physics a model leaves out, and write report.html, report.json, model.yaml and prediction.csv."""
    from fric.diagnosis import diagnose as find
    from fric.diagnosis.blocks import in_blocks
    from fric.identification.force_needed import require_force
    from fric.model_file import read_model

    given = validate or []
    same = {path.resolve() for path in train} & {path.resolve() for path in given}
    if same:
        raise InputError(same.pop(), "is both learnt from and validated on", "hold another recording back for --validate")
    if bool(given) == (blocks is not None):
        raise InputError("--validate", "is needed, or --blocks, and not both", "hold a recording back, or blocks: --blocks 6")
    nominal = read_model(model)
    reading = ReadOptions(joint, repair, time, start, end, tuple(topic or ()))
    progress(f"reading {len(train) + len(given)} recording(s)")
    records = read_all(train, reading)
    require_force(records)
    records, kept_apart = (records, read_all(given, reading)) if blocks is None else in_blocks(records, blocks)
    found = find(records, kept_apart, nominal, progress)
    write_diagnosis(out, found, records, kept_apart)
    if as_json:
        typer.echo(json.dumps(found.report()))
    else:
        _print(found, out)


def write_diagnosis(out: Path, found: Diagnosis, train: list[Record], validation: list[Record]) -> None:
    """Every result, or none: all are made before the first is written."""
    from fric.files import write_text
    from fric.model_file import write_model
    from fric.report.diagnosis import diagnosis_report

    page = diagnosis_report(found, train, validation)
    table = _csv(found)
    write_text(out / "report.json", json.dumps(found.report(), indent=2) + "\n")
    write_text(out / "prediction.csv", table)
    write_model(found.model, out / "model.yaml")
    write_text(out / "report.html", page)


def _csv(found: Diagnosis) -> str:
    """The forces of the validation recordings, one below the other, with a column for the recording where there are several."""
    import pandas as pd

    parts = []
    for p in found.prediction:
        columns = {
            "time": p.time,
            "force_measured": p.force_measured,
            "force_nominal": p.force_nominal,
            "force_refit": p.force_refit,
            "force_augmented": p.force_augmented,
        }
        part = pd.DataFrame(columns)
        if len(found.prediction) > 1:
            part["recording"] = p.source
        parts.append(part)
    text: str = pd.concat(parts).to_csv(index=False, float_format="%.9g")
    return text


def _print(found: Diagnosis, out: Path) -> None:
    from rich.console import Console

    console = Console()
    console.print(found.sentence, highlight=False, markup=False)
    if found.force_errors_in_words:
        console.print(found.force_errors_in_words, highlight=False, markup=False)
    for each in found.findings:
        console.print(f"- {each.evidence}; {each.component}; {each.where.regime}", highlight=False, markup=False)
    faults = [check for check in found.checks if check.verdict == "fault"]
    for check in faults:
        console.print(f"- instrument: {check.detail}; {check.remedy}", highlight=False, markup=False)
    for note in found.notes:
        console.print(f"- {note}", highlight=False, markup=False)
    console.print(f"next: {found.next_experiment}", highlight=False, markup=False)
    names = "report.html, report.json, model.yaml, prediction.csv"
    console.print(f"written: {out}/{{{names}}}", highlight=False, markup=False)
