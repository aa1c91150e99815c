"""``fric diagnose``: find which physical effects a model leaves out of what recordings show."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from fric.errors import InputError

from .groups import grouped
from .options import Reading, ReadingGroup, progress, read_all
from .printed import console
from .results import Record as ResultRecord
from .results import Results, ResultsGroup

__all__ = ["register"]

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
    at_most: Annotated[
        float | None,
        typer.Option(
            "--at-most",
            help="After this time, in s, look for no further effects, and judge what was found. If not given: look until "
            "nothing more helps.",
        ),
    ] = None,
    reading: ReadingGroup = Reading(),
    results: ResultsGroup = Results(Path("diagnosis")),
) -> None:
    """Find which physical effects a model leaves out, and write report.html, report.json, model.yaml and prediction.csv."""
    import fric
    from fric.compiling import compiled_beside
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
    with compiled_beside():
        records, kept_apart = (read_all(paths, reading, as_recorded=True) for paths in (train, given))
        found = fric.diagnose(records, nominal, validate=kept_apart, blocks=blocks, progress=progress, at_most=at_most)
    results.write(_RECORD, found.files())
    if results.as_json:
        typer.echo(json.dumps(found.to_dict()))
        return
    shown = console()
    for line in found.summary().splitlines():
        shown.print(line)
    shown.print(f"written: {results.out}/{{{', '.join(found.files())}}}")
