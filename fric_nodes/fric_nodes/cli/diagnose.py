"""``fric diagnose``: find which physical effects a model leaves out of what recordings show."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from fric.errors import InputError

from .groups import grouped
from .options import Reading, ReadingGroup, progress, read_all
from .printed import console
from .results import Record as ResultRecord
from .results import Results, ResultsGroup

if TYPE_CHECKING:
    from fric.diagnosis import Diagnosis
    from fric.record import Record

__all__ = ["register", "write_diagnosis"]

_RECORD = ResultRecord("report.json", form="fric-report/1")
_FILES = ("report.html", "model.yaml", "prediction.csv")


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command(
        "diagnose",
        no_args_is_help=True,
        epilog="Example: fric diagnose bags/slide --validate bags/slide_2 --model nominal.yaml --out diagnosis",
    )(diagnose)


@grouped
def diagnose(
    train: Annotated[list[Path], typer.Argument(help="Recordings to fit models to: rosbag2 folders or files.")],
    model: Annotated[Path, typer.Option("--model", help="Model file to test: which physical effects does it leave out?")],
    validate: Annotated[
        list[Path] | None,
        typer.Option("--validate", help="Recording to test the result on; nothing is fitted to it. May be repeated."),
    ] = None,
    blocks: Annotated[
        int | None,
        typer.Option(
            "--blocks",
            help="Instead of --validate: cut each recording into this many blocks and keep every other one for the test.",
        ),
    ] = None,
    reading: ReadingGroup = Reading(),
    results: ResultsGroup = Results(Path("diagnosis")),
) -> None:
    """Find which physical effects a model leaves out, and write report.html, report.json, model.yaml and prediction.csv."""
    from fric.diagnosis import diagnose as find
    from fric.diagnosis.blocks import in_blocks
    from fric.identification.force_needed import require_force
    from fric.model_file import read_model

    given = validate or []
    same = {path.resolve() for path in train} & {path.resolve() for path in given}
    if same:
        raise InputError(same.pop(), "is both fitted and validated on", "give another recording to --validate")
    if bool(given) == (blocks is not None):
        raise InputError("--validate", "or --blocks is needed, not both", "keep a recording apart, or blocks: --blocks 6")
    nominal = read_model(model)
    results = results.claimed(_RECORD, _FILES)
    progress(f"reading {len(train) + len(given)} recording(s)")
    records = read_all(train, reading)
    require_force(records)
    records, kept_apart = (records, read_all(given, reading)) if blocks is None else in_blocks(records, blocks)
    found = find(records, kept_apart, nominal, progress)
    write_diagnosis(results, found, records, kept_apart)
    if results.as_json:
        typer.echo(json.dumps(found.report()))
    else:
        _print(found, results.out)


def write_diagnosis(results: Results, found: Diagnosis, train: list[Record], validation: list[Record]) -> None:
    """Every result, or none: all are made before the first is written."""
    from fric.model_file import model_to_text
    from fric.report.diagnosis import diagnosis_report

    texts = {
        "report.html": diagnosis_report(found, train, validation),
        "model.yaml": model_to_text(found.model),
        "prediction.csv": _csv(found),
        _RECORD.name: json.dumps(found.report(), indent=2) + "\n",
    }
    results.write(_RECORD, texts)


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
    shown = console()
    shown.print(found.sentence)
    if found.force_errors_in_words:
        shown.print(found.force_errors_in_words)
    for each in found.findings:
        shown.print(f"- {each.evidence}; {each.component}; {each.where.regime}")
    faults = [check for check in found.checks if check.verdict == "fault"]
    for check in faults:
        shown.print(f"- instrument: {check.detail}; {check.remedy}")
    for note in found.notes:
        shown.print(f"- {note}")
    shown.print(f"next: {found.next_experiment}")
    names = "report.html, report.json, model.yaml, prediction.csv"
    shown.print(f"written: {out}/{{{names}}}")
