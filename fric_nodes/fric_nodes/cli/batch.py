"""``fric batch``: identify, diagnose or check many recordings at once, and look at all axes over time."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from fric.errors import InputError

from .groups import Group, grouped
from .options import Reading, progress
from .results import Record as ResultRecord
from .results import Results, ResultsGroup

if TYPE_CHECKING:
    from fric.batch.job import Job
    from fric.batch.run import Batch

__all__ = ["Progress", "register"]

_RECORD = ResultRecord("batch.json", form="fric-batch/1")
_FILES = ("results.parquet", "fleet.html")
_LINES = 10.0  # [s] between two lines of progress where there is no terminal (layout)

Patterns = Annotated[
    list[str],
    typer.Argument(help="Recordings, folders of them, patterns in quotes such as 'logs/**/*.mcap', or URLs (s3://...)."),
]
_MODEL = "Model file: its terms are fitted to each recording, its values are the start."


@dataclass(frozen=True)
class _Recordings(Reading):
    """As every verb reads recordings, with files of other programs, and the names of axes."""

    joint: Annotated[
        str | None, typer.Option("--joint", help="Name of the joint. If not given: every joint of each recording.")
    ] = None
    mapping: Annotated[
        Path | None, typer.Option("--map", help="Mapping for files of other programs (.csv, .mat, ...), as for 'fric import'.")
    ] = None
    axis: Annotated[
        str,
        typer.Option(
            "--axis",
            help="Regular expression on the path whose group names the machine, such as 'logs/(machine_[0-9]+)/'; a group "
            "(?P<time>...) holds a date. If not given: the recording's folder. The joint's name is added.",
        ),
    ] = ""


@dataclass(frozen=True)
class _Workers:
    """Who does the work, and how much is told of it."""

    workers: Annotated[
        int | None, typer.Option("--workers", help="Processes to start; 0: this process alone. If not given: one per core.")
    ] = None
    memory: Annotated[str, typer.Option("--memory", help="Memory of each; a recording that needs more is reported.")] = "2GB"
    reports: Annotated[
        int, typer.Option("--reports", help="Full reports to write of recordings that come first; takes the time of as many.")
    ] = 3
    scheduler: Annotated[str, typer.Option("--scheduler", help="Address of a Dask scheduler, in place of --workers.")] = ""


RecordingsGroup = Annotated[_Recordings, Group("Recordings")]
WorkersGroup = Annotated[_Workers, Group("Workers and reports")]
_STATUS = "Exit status 1 when some recordings were refused."


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    verbs = typer.Typer(no_args_is_help=True, help="Identify, diagnose or check many recordings at once.")
    example = "Example: fric batch {} 'logs/**/*.mcap' --model axis.yaml --out fleet"
    for verb in (identify, diagnose, doctor):
        verbs.command(verb.__name__, no_args_is_help=True, epilog=example.format(verb.__name__))(verb)
    app.add_typer(verbs, name="batch")


@grouped
def identify(
    patterns: Patterns,
    model: Annotated[Path | None, typer.Option("--model", help=_MODEL)] = None,
    terms: Annotated[
        str, typer.Option("--terms", help="Effects to fit if no --model is given, separated by commas.")
    ] = "coulomb,viscous,bias",
    method: Annotated[str | None, typer.Option("--method", help="How to fit ('fric model methods' lists all).")] = None,
    recordings: RecordingsGroup = _Recordings(),
    workers: WorkersGroup = _Workers(),
    results: ResultsGroup = Results(Path("fleet")),
) -> None:
    """Identify each recording; write results.parquet and fleet.html. What is finished is not computed again.

    Exit status 1 when some recordings were refused.
    """
    settings = {} if method is None else {"method": method}
    _batch("identify", patterns, _model_text(model, terms), settings, recordings, workers, results)


@grouped
def diagnose(
    patterns: Patterns,
    model: Annotated[Path, typer.Option("--model", help="Model file to test: which physical effects does it leave out?")],
    blocks: Annotated[
        int, typer.Option("--blocks", help="Blocks that each recording is cut into; every other one is kept for the test.")
    ] = 6,
    at_most: Annotated[
        float | None,
        typer.Option(
            "--at-most",
            help="Per recording: after this time, in s, look for no further effects, and judge what was found. If not given: "
            "look until nothing more helps.",
        ),
    ] = None,
    recordings: RecordingsGroup = _Recordings(),
    workers: WorkersGroup = _Workers(),
    results: ResultsGroup = Results(Path("fleet")),
) -> None:
    """Diagnose each recording; write results.parquet and fleet.html. What is finished is not computed again.

    Exit status 1 when some recordings were refused.
    """
    from fric.diagnosis.deadline import refuse_no_time

    refuse_no_time(at_most)
    # Another bound is another job: a search that was ended early is no result of one that was not.
    settings = {"blocks": blocks} if at_most is None else {"blocks": blocks, "at_most": at_most}
    _batch("diagnose", patterns, _model_text(model, ""), settings, recordings, workers, results)


@grouped
def doctor(
    patterns: Patterns,
    model: Annotated[
        Path | None, typer.Option("--model", help="Model file with known mass and friction, to check the units against.")
    ] = None,
    gear_ratio: Annotated[float | None, typer.Option("--gear-ratio", help="Gear ratio of the joint.")] = None,
    recordings: RecordingsGroup = _Recordings(),
    workers: WorkersGroup = _Workers(),
    results: ResultsGroup = Results(Path("fleet")),
) -> None:
    """Check the instruments of each recording; write results.parquet and fleet.html. What is finished is not done again.

    Exit status 1 when some recordings were refused.
    """
    settings = {} if gear_ratio is None else {"gear_ratio": gear_ratio}
    _batch("doctor", patterns, "" if model is None else _model_text(model, ""), settings, recordings, workers, results)


def _model_text(model: Path | None, terms: str) -> str:
    """The model as text, which does not depend on how its file is laid out."""
    from fric.facade.structure import model_from
    from fric.model_file import model_to_text

    return model_to_text(model_from(model if model is not None else terms))


def _batch(
    verb: str,
    patterns: list[str],
    model: str,
    settings: Mapping[str, Any],
    recordings: _Recordings,
    workers: _Workers,
    results: Results,
) -> None:
    from fric.batch.job import Job
    from fric.batch.pool import Workers
    from fric.batch.recordings import find
    from fric.batch.run import run_batch
    from fric.batch.table import Naming

    if recordings.time not in {"stamp", "log"}:
        raise InputError("--time", f"'{recordings.time}' is not known", "use stamp or log")
    number = workers.workers if workers.workers is not None else os.cpu_count() or 1
    if number < 0:
        raise InputError("--workers", f"is {number}", "give 0 or more")
    job = Job(
        verb, model, dict(settings), _mapping_text(recordings.mapping), recordings.joint, recordings.roles(),
        recordings.time, recordings.repair, recordings.start, recordings.end,
    )  # fmt: skip
    found = find(patterns, bool(job.mapping))
    naming = Naming(found.recordings, recordings.axis)
    # A run that was killed has left its journal, and perhaps some of its results: the folder is this command's.
    results = replace(results, force=True) if (results.out / "journal").is_dir() else results.claimed(_RECORD, _FILES)
    if found.left_out:
        progress(f"{len(found.left_out)} files of other kinds are left out, such as {found.left_out[0]}")
    shown = Progress()
    begun = time.monotonic()
    batch = run_batch(
        found, job, results.out, naming=naming, workers=Workers(number, workers.memory, workers.scheduler), progress=shown
    )
    shown.end()
    _finish(verb, job, batch, results, time.monotonic() - begun, workers.reports)


def _mapping_text(path: Path | None) -> str:
    if path is None:
        return ""
    from fric.bagio.mapping import load_mapping

    load_mapping(path)  # refuses one that cannot be used, with its line
    return path.read_text(encoding="utf-8")


def _finish(verb: str, job: Job, batch: Batch, results: Results, spent: float, reports: int) -> None:
    """Write the page and the record, print what came of it, and end with the status."""
    from fric.batch.fleet.look import fleet_of
    from fric.batch.fleet.page import fleet_page
    from fric.batch.notable import reports_of
    from fric.files import write_text

    model = job.parsed_model
    units = {} if model is None else {p.name: p.declaration.unit(model.units) for p in model.parameters()}
    fleet = fleet_of(batch.table, batch.parameters, units)
    pages, names, failed = reports_of(fleet, job, reports)
    for line in failed:
        progress(line)
    for old in (results.out / "reports").glob("[0-9][0-9]_*.html"):
        old.unlink()  # of an earlier run, whose axes may come first no longer
    for name, page in pages.items():
        write_text(results.out / "reports" / name, page)
    links = {axis: f"reports/{name}" for axis, name in names.items()}
    summary = {
        "format": _RECORD.form,
        "verb": verb,
        "rows": batch.table.num_rows,
        "refused": batch.refused,
        "axes": len(fleet.axes),
        "axis_days": fleet.axis_days,
        "first": [vars(item) for item in fleet.items[:20]],
    }
    write_text(results.out / "fleet.html", fleet_page(fleet, batch.table, verb, links))
    write_text(results.out / _RECORD.name, json.dumps(summary, indent=2) + "\n")
    if results.as_json:
        typer.echo(json.dumps(summary))
    else:
        rate = f", {batch.worked} worked on now in {spent:.0f} s" if batch.worked else ", none to work on"
        typer.echo(f"{batch.table.num_rows} results of {len(fleet.axes)} axes{rate}; {batch.refused} refused")
        for item in fleet.items[:5]:
            typer.echo(f"- {item.axis}: {item.about} {item.what}{f' since {item.since}' if item.since else ''}")
        typer.echo(f"written: {results.out}/{{{', '.join((*_FILES, _RECORD.name))}}}")
    if batch.refused:
        raise typer.Exit(1)


class Progress:
    """How far it is, on standard error: one line that changes on a terminal, else a line every ten seconds."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._begun = clock()
        self._before = -1
        self._told = clock()
        self._terminal = sys.stderr.isatty()

    def __call__(self, done: int, total: int, refused: int) -> None:
        """Say it, when it is time to."""
        now = self._clock()
        self._before = done if self._before < 0 else self._before
        worked = done - self._before
        rate = worked / max(now - self._begun, 1e-9)
        left = f", {rate:.2g} per s, about {_in_words((total - done) / rate)} left" if worked and done < total else ""
        line = f"{done} of {total} recordings, {refused} refused{left}"
        if self._terminal:
            sys.stderr.write(f"\r\x1b[K{line}")
            sys.stderr.flush()
        elif worked == 0 or done == total or now - self._told >= _LINES:
            self._told = now
            progress(line)

    def end(self) -> None:
        """Go to the next line."""
        if self._terminal:
            sys.stderr.write("\n")


def _in_words(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
