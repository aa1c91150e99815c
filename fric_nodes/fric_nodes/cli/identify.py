"""``fric identify``: estimate the parameters of a friction model from recordings."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from fric.errors import InputError
from fric.method_settings import Options

from .groups import Group, grouped
from .identify_design import Design, design_alone, designed, limits_of
from .identify_joints import ALL, identify_each
from .identify_method import method_of
from .identify_shown import print_intervals, print_result, summary_of, uncertainty_json
from .options import Reading, progress, read_all
from .results import Record as ResultRecord
from .results import Results, ResultsGroup

if TYPE_CHECKING:
    from fric.identification.foreseen import Foreseen
    from fric.identification.result import Identification, Method
    from fric.instrument import Finding
    from fric.model import Model
    from fric.record import Record

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
    reading: Reading
    results: Results


def _identify(asked: _Asked) -> None:
    limits, chosen = limits_of(asked.design), method_of(asked.method)
    if not asked.train:
        options = _options_for(chosen, asked)
        design_alone(asked.model, asked.design, limits, chosen, options, asked.results)
        return
    gains = len(asked.options.gains)
    if gains and gains != len(asked.train):
        raise InputError("--gain", f"is given {gains} times for {len(asked.train)} recordings", "give it once for each")
    _refuse_overlap(asked.train, asked.validate)
    if asked.reading.joint == ALL:
        identify_each(
            [*asked.train, *asked.validate],
            asked.reading,
            asked.results,
            lambda joint, results: _identify(replace(asked, reading=replace(asked.reading, joint=joint), results=results)),
        )
        return
    asked = replace(asked, results=asked.results.claimed(_RECORD, _FILES))
    progress(f"reading {len(asked.train) + len(asked.validate)} recording(s)")
    records, validation = read_all(list(asked.train), asked.reading), read_all(list(asked.validate), asked.reading)
    structure, records, validation = _structure(asked, records, validation)
    chosen = method_of(asked.method, structure)
    options = _options_for(chosen, asked)
    if chosen.needs_force:
        from fric.identification.force_needed import require_force

        require_force(records, structure, options.held)
    checks = _inspect(records)
    fitted = _fit(chosen, structure, records, validation, options, experiments=not asked.design.wanted)
    result = replace(fitted, checks=checks)
    summary = summary_of(result, options)
    intervals = _intervals(asked, result, records, options, summary)
    _write(asked.results, result, records, validation, options, summary)
    as_json = asked.results.as_json
    if not as_json:
        print_result(result, asked.results.out)
        if intervals is not None:
            print_intervals(intervals, structure)
    if limits is not None:
        summary["design"] = designed(result.model, result, records, asked.design, limits, chosen, options, asked.results)
    if as_json:
        typer.echo(json.dumps(summary))


def _options_for(method: Method, asked: _Asked) -> Options:
    """The settings of the fit, all of which ``method`` uses."""
    from fric.identification import refuse_unused

    refuse_unused(method, asked.options)
    own = {}
    for text in asked.own:
        name, found, value = text.partition("=")
        if not found:
            raise InputError("--set", f"is '{text}'", "give NAME=VALUE")
        own[name] = value
    return method.options(asked.options, own)


def _refuse_overlap(train: tuple[Path, ...], validation: tuple[Path, ...]) -> None:
    same = {path.resolve() for path in train} & {path.resolve() for path in validation}
    if same:
        raise InputError(same.pop(), "is both fitted and validated on", "keep a recording apart for --validate")


def _structure(asked: _Asked, records: list[Record], validation: list[Record]) -> tuple[Model, list[Record], list[Record]]:
    """The model to fit, from a file or from a list of effects; and the recordings with the conditions at which it holds."""
    from fric.identification.equations import nominal_conditions
    from fric.identification.start import start_model
    from fric.model_file import read_model

    record = records[0]
    if asked.model is not None:
        structure = replace(read_model(asked.model), joint=record.joint, standard_errors={}, provenance={})
    else:
        names = [name.strip() for name in asked.terms.split(",") if name.strip()]
        structure = start_model(names, record.joint, record.units)
    # What a load or a temperature is relative to belongs to the model: a recording under another load has another mean.
    structure = replace(structure, nominal=nominal_conditions(records) | dict(structure.nominal))
    records, validation = ([replace(each, nominal=structure.nominal) for each in held] for held in (records, validation))
    return structure, records, validation


def _inspect(records: list[Record]) -> tuple[Finding, ...]:
    """What is wrong with the recordings themselves, said before anything is fitted."""
    from fric.instrument import inspect

    progress("checking the recordings for faults of their instruments")
    findings = inspect(records)
    for finding in findings:
        if finding.verdict in ("warning", "fault"):
            progress(f"{finding.verdict}: {finding.detail}{'; ' + finding.remedy if finding.remedy else ''}")
    return findings


def _foresee(structure: Model, records: list[Record], options: Options, method: Method, experiments: bool) -> Foreseen | None:
    """Which parameters the recordings determine, said before the fit; None where the method predicts no samples."""
    from fric.identification.identifiability import foresee

    if not method.predicts:
        return None
    progress("checking which parameters the recordings determine")
    try:
        found = foresee(structure, records, options, method.predicts, experiments)
    except InputError:
        return None  # the fit will say it
    for line in found.warnings:
        progress(f"before the fit: {line}")
    return found


def _fit(
    method: Method,
    structure: Model,
    records: list[Record],
    validation: list[Record],
    options: Options,
    experiments: bool,
) -> Identification:
    from fric.identification.misfit import validated

    foreseen = _foresee(structure, records, options, method, experiments)
    progress(f"fitting {', '.join(structure.names)} by {method.id}")
    result = replace(method.fit(structure, records, options), foreseen=foreseen)
    provenance = {
        "recordings": ", ".join(record.source for record in records),
        "method": method.id,
        "equations": str(result.train.n_samples),
    }
    result = replace(result, model=replace(result.model, provenance=provenance))
    return validated(result, method, records, validation, options) if validation else result


def _intervals(asked: _Asked, result: Identification, records: list[Record], options: Options, summary: dict[str, Any]) -> Any:
    """Intervals of the parameters, which ``summary`` gets too; None when none are asked for."""
    if not asked.uncertainty:
        return None
    from fric.identification.uncertainty import assess

    progress(f"computing intervals by {asked.uncertainty}")
    found = assess(result, records, options, asked.uncertainty)
    summary["uncertainty"] = uncertainty_json(found)
    return found


def _write(
    results: Results,
    result: Identification,
    records: list[Record],
    validation: list[Record],
    options: Options,
    summary: dict[str, Any],
) -> None:
    """Every result, or none: all are made before the first is written."""
    from fric.model_file import model_to_text
    from fric.report.kind import page_of

    texts = {
        "model.yaml": model_to_text(result.model),
        **result.attachments,
        "report.html": page_of(result, records, validation, options),
        _RECORD.name: json.dumps(summary, indent=2) + "\n",
    }
    results.write(_RECORD, texts)
