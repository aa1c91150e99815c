"""``fric identify``: estimate the parameters of a friction model from recordings."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from fric.errors import InputError
from fric.method_settings import Options

from .groups import Group, grouped
from .identify_design import Design, design_alone, designed, limits_of
from .identify_joints import ALL, identify_each
from .identify_pieces import identify_pieces, refuse_too_large
from .identify_shown import print_intervals, print_result
from .options import Reading, progress, read_all
from .results import Record as ResultRecord
from .results import Results, ResultsGroup

if TYPE_CHECKING:
    from fric.facade.identifying import Identified
    from fric.identification.result import Method

__all__ = ["register"]

_DEFAULT_TERMS = "coulomb,viscous,bias"
_RECORD = ResultRecord("identification.json", ("parameters", "method", "train"))
_FILES = ("model.yaml", "report.html")


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command(
        "identify", no_args_is_help=True, epilog="Example: fric identify bags/slide --validate bags/slide_2 --out found"
    )(identify)


@dataclass(frozen=True)
class _Reading(Reading):
    """As every verb reads recordings, or all their joints one after the other."""

    joint: Annotated[
        str | None,
        typer.Option("--joint", help="Name of the joint, if the recording holds several; 'all' identifies each of them."),
    ] = None
    pieces: Annotated[
        float | None,
        typer.Option(
            "--pieces",
            help="Read and identify the recording in pieces of so many s, and put their parameters together: for recordings "
            "that don't fit into memory, and for what changes over hours.",
        ),
    ] = None


@grouped
def identify(
    train: Annotated[
        list[Path] | None,
        typer.Argument(help="Recordings to fit: rosbag2 folders or files. None is needed with --design and --model."),
    ] = None,
    validate: Annotated[
        list[Path] | None,
        typer.Option("--validate", help="Recording that is not fitted, to test the model on; may be repeated."),
    ] = None,
    model: Annotated[
        Path | None, typer.Option("--model", help="Model file: its terms are fitted, its values are the start.")
    ] = None,
    terms: Annotated[
        str, typer.Option("--terms", help="Effects to fit if no --model is given, separated by commas ('fric model effects').")
    ] = _DEFAULT_TERMS,
    method: Annotated[
        str | None,
        typer.Option(
            "--method",
            help="How to fit ('fric model methods' lists all). The default is inverse-dynamics; for a model with pre-sliding "
            "it is prediction-error.",
        ),
    ] = None,
    own: Annotated[
        list[str] | None,
        typer.Option("--set", help="Setting that only this method has, NAME=VALUE ('fric model methods'); may be repeated."),
    ] = None,
    uncertainty: Annotated[
        str,
        typer.Option(
            "--uncertainty",
            help="Also compute 95 % intervals: sandwich (from the standard errors), bootstrap or profile (slower, more exact).",
        ),
    ] = "",
    options: Annotated[Options, Group("Settings of the fit")] = Options(),
    design: Annotated[Design, Group("Design of the next experiment")] = Design(),
    reading: Annotated[_Reading, Group("Reading the recordings")] = _Reading(),
    results: ResultsGroup = Results(Path("identified")),
) -> None:
    """Identify a model's parameters from recordings and write model.yaml, identification.json and report.html.

    Numbers that are not given are chosen from the recordings. A setting that the method does not use is refused.
    """
    asked = _Asked(
        tuple(train or ()), tuple(validate or ()), model, terms, method, tuple(own or ()), uncertainty, options, design,
        reading, results,
    )  # fmt: skip
    _identify(asked)


@dataclass(frozen=True)
class _Asked:
    """What the command was given."""

    train: tuple[Path, ...]
    validate: tuple[Path, ...]
    model: Path | None
    terms: str
    method: str | None
    own: tuple[str, ...]
    uncertainty: str
    options: Options
    design: Design
    reading: _Reading
    results: Results


def _identify(asked: _Asked) -> None:
    from fric.identification.choice import method_for

    limits, chosen = limits_of(asked.design), method_for(asked.method)
    if not asked.train:
        options = _options_for(chosen, asked)
        design_alone(asked.model, asked.design, limits, chosen, options, asked.results)
        return
    gains = len(asked.options.gains)
    if gains and gains != len(asked.train):
        raise InputError("--gain", f"is given {gains} times for {len(asked.train)} recordings", "give it once for each")
    _refuse_overlap(asked.train, asked.validate)
    if asked.reading.pieces is not None:
        _in_pieces(asked, asked.reading.pieces)
        return
    if asked.reading.joint == ALL:
        identify_each(
            [*asked.train, *asked.validate],
            asked.reading,
            asked.results,
            lambda joint, results: _identify(replace(asked, reading=replace(asked.reading, joint=joint), results=results)),
        )
        return
    asked = replace(asked, results=asked.results.claimed(_RECORD, _FILES))
    found, chosen = _found(asked)
    fitted, as_json = found.fitted, asked.results.as_json
    summary = found.to_dict()
    _write(asked.results, found, summary)
    if not as_json:
        print_result(found.result, asked.results.out)
        if found.intervals is not None:
            print_intervals(found.intervals, found.model)
    if limits is not None:
        summary["design"] = designed(
            found.model, found.result, list(fitted.train), asked.design, limits, chosen, fitted.options, asked.results
        )
    if as_json:
        typer.echo(json.dumps(summary))


def _found(asked: _Asked) -> tuple[Identified, Method]:
    """The identification, and the method by which it was made."""
    from fric.facade.identifying import Identified
    from fric.facade.structure import to_fit
    from fric.identification.choice import method_for
    from fric.identification.uncertainty import assess
    from fric.identification.workflow import identified

    refuse_too_large([*asked.train, *asked.validate], asked.reading)
    progress(f"reading {len(asked.train) + len(asked.validate)} recording(s)")
    records, validation = (read_all(list(each), asked.reading, as_recorded=True) for each in (asked.train, asked.validate))
    structure = to_fit(asked.terms if asked.model is None else asked.model, records[0].joint, records[0].units)
    chosen = method_for(asked.method, structure)
    options = _options_for(chosen, asked)
    experiments = not asked.design.wanted
    fitted = identified(structure, records, validation, chosen.id, options, progress, experiments=experiments)
    if not asked.uncertainty:
        return Identified(fitted), chosen
    progress(f"computing intervals by {asked.uncertainty}")
    return Identified(fitted, assess(fitted.result, list(fitted.train), options, asked.uncertainty)), chosen


def _in_pieces(asked: _Asked, seconds: float) -> None:
    """The identification of one recording piece by piece.

    Raises:
        InputError: something else is asked for that needs the whole recording.
    """
    from fric.facade.structure import to_fit
    from fric.identification.choice import method_for

    others = {
        "--validate": asked.validate,
        "--design": asked.design.wanted,
        "--uncertainty": asked.uncertainty,
        "--joint all": asked.reading.joint == ALL,
        "a second recording": asked.train[1:],
    }
    given = [name for name, value in others.items() if value]
    if given:
        raise InputError("--pieces", f"goes with one recording and one joint, not with {', '.join(given)}", "leave it out")
    if not (math.isfinite(seconds) and seconds > 0.0):
        raise InputError("--pieces", f"is {seconds}", "give a positive number of seconds")
    identify_pieces(
        asked.train[0],
        seconds,
        asked.reading,
        asked.results,
        lambda record: to_fit(asked.terms if asked.model is None else asked.model, record.joint, record.units),
        lambda structure: method_for(asked.method, structure),
        lambda method: _options_for(method, asked),
    )


def _options_for(method: Method, asked: _Asked) -> Options:
    """The settings of the fit, all of which ``method`` uses."""
    from fric.identification.choice import refuse_unused

    own = {}
    for text in asked.own:
        name, found, value = text.partition("=")
        if not found:
            raise InputError("--set", f"is '{text}'", "give NAME=VALUE")
        own[name] = value
    options = method.options(asked.options, own)
    refuse_unused(method, options)
    return options


def _refuse_overlap(train: tuple[Path, ...], validation: tuple[Path, ...]) -> None:
    same = {path.resolve() for path in train} & {path.resolve() for path in validation}
    if same:
        raise InputError(same.pop(), "is both fitted and validated on", "keep a recording apart for --validate")


def _write(results: Results, found: Identified, summary: dict[str, Any]) -> None:
    """Every result, or none: all are made before the first is written."""
    from fric.model_file import model_to_text

    texts = {
        "model.yaml": model_to_text(found.model),
        **found.result.attachments,
        "report.html": found.report(),
        _RECORD.name: json.dumps(summary, indent=2) + "\n",
    }
    results.write(_RECORD, texts)
