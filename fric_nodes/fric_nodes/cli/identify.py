"""``fric identify``: parameters of a model from recordings."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from fric.errors import InputError

from .identify_joints import ALL, identify_each
from .identify_method import method_of
from .identify_shown import print_design, print_intervals, print_result, summary_of, uncertainty_json
from .options import (
    EndOption,
    JointsOption,
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
    from fric.identification.design import Limits, Rig
    from fric.identification.foreseen import Foreseen
    from fric.identification.result import Identification, Method, Options
    from fric.instrument import Finding
    from fric.model import Model
    from fric.record import Record

__all__ = ["register"]

_DEFAULT_TERMS = "coulomb,viscous,bias"
_DURATION = 20.0
_PERIOD = 0.002


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command(
        "identify", no_args_is_help=True, epilog="Example: fric identify bags/slide --validate bags/slide_2 --out found"
    )(identify)


def identify(
    train: Annotated[
        list[Path] | None, typer.Argument(help="Recordings to fit: rosbag2 folders or files. None with --design and --model.")
    ] = None,
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
        str | None,
        typer.Option(
            "--method", help="How to fit ('fric model methods'): inverse-dynamics, with pre-sliding prediction-error."
        ),
    ] = None,
    joint: JointsOption = None,
    cutoff: Annotated[
        float | None, typer.Option("--cutoff", help="Low-pass filter on the position [Hz]; from its noise, at most 100.")
    ] = None,
    decimation: Annotated[
        int | None, typer.Option("--decimation", help="Keep every n-th filtered equation; from the noise of the position.")
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
    bound: Annotated[
        list[str] | None, typer.Option("--bound", help="Keep a parameter between limits, NAME=LO,HI; may be repeated.")
    ] = None,
    starts: Annotated[int, typer.Option("--starts", help="Starts of the search of output-error; the best end is taken.")] = 1,
    design: Annotated[
        bool, typer.Option("--design", help="Propose the next excitation: the one that most reduces the worst uncertainty.")
    ] = False,
    limit: Annotated[
        list[str] | None,
        typer.Option("--limit", help="Limit of the next excitation: position=LO,HI, speed=V and force=LO,HI; all three."),
    ] = None,
    duration: Annotated[
        float | None, typer.Option("--duration", help=f"Longest next recording with --design [s]; {_DURATION:g}.")
    ] = None,
    rig: Annotated[
        list[str] | None,
        typer.Option(
            "--rig",
            help="Without recordings, how the next one is made: period=S, resolution=X, position_noise=X, force_noise=F.",
        ),
    ] = None,
    tries: Annotated[
        int, typer.Option("--tries", help="Settings of each excitation that --design looks at first; more take longer.")
    ] = 6,
    repair: RepairOption = False,
    time: TimeOption = "stamp",
    start: StartOption = None,
    end: EndOption = None,
    topic: TopicOption = None,
    as_json: JsonOption = False,
) -> None:
    """Identify a model's parameters from recordings and write model.yaml, identification.json and report.html."""
    asked = dict(locals())
    from fric.identification.equations import nominal_conditions
    from fric.identification.force_needed import require_force
    from fric.identification.result import Options

    _check(cutoff, decimation, rest_velocity, horizon, starts, tries)
    given = train or []
    gains, bounds = _gains(gain or [], len(given)), _bounds(bound or [])
    options = Options(
        cutoff, decimation, rest_velocity, tuple(hold or ()), tuple(free or ()), robust, horizon, gains, bounds, starts
    )
    limits, chosen = _limits(design, limit or [], duration), method_of(method)
    if not given:
        _design_alone(model, limits, _rig(rig or []), chosen, options, out, as_json, tries)
        return
    reading = ReadOptions(joint, repair, time, start, end, tuple(topic or ()))
    kept_apart = validate or []
    _refuse_overlap(given, kept_apart)
    if joint == ALL:
        identify_each([*given, *kept_apart], reading, identify, asked)
        return
    progress(f"reading {len(given) + len(kept_apart)} recording(s)")
    records = read_all(given, reading)
    validation = read_all(kept_apart, reading)
    structure = _structure(model, terms, records[0])
    chosen = method_of(method, structure)
    # What a load or a temperature is relative to belongs to the model: a recording under another load has another mean.
    structure = replace(structure, nominal=nominal_conditions(records) | dict(structure.nominal))
    records, validation = ([replace(each, nominal=structure.nominal) for each in held] for held in (records, validation))
    if chosen.needs_force:
        require_force(records, structure, options.held)
    checks = _inspect(records)
    result = replace(_fit(chosen, structure, records, validation, options, experiments=not design), checks=checks)
    summary = summary_of(result)
    if uncertainty:
        from fric.identification.uncertainty import assess

        progress(f"finding intervals by {uncertainty}")
        found = assess(result, records, options, uncertainty)
        summary["uncertainty"] = uncertainty_json(found)
    _write(out, result, records, validation, options, summary)
    if not as_json:
        print_result(result, out)
        if uncertainty:
            print_intervals(found, structure)
    if limits is not None:
        summary["design"] = _design(result.model, result, records, limits, None, chosen, options, out, as_json, tries)
    if as_json:
        typer.echo(json.dumps(summary))


def _check(
    cutoff: float | None, decimation: int | None, rest_velocity: float | None, horizon: float | None, starts: int, tries: int
) -> None:
    for name, number in (("--starts", starts), ("--tries", tries)):
        if number < 1:
            raise InputError(name, f"is {number}", "give 1 or more")
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


def _bounds(given: list[str]) -> tuple[tuple[str, float, float], ...]:
    """Name and limits of each parameter, from texts such as ``stribeck.velocity=0.001,0.05``."""
    found = []
    for text in given:
        name, _, numbers = text.partition("=")
        try:
            low, high = (float(part) for part in numbers.split(","))
        except ValueError:
            low = high = math.nan
        if not low < high:
            raise InputError("--bound", f"is '{text}'", "give NAME=LO,HI, such as stribeck.velocity=0.001,0.05")
        found.append((name, low, high))
    return tuple(found)


def _limits(design: bool, given: list[str], duration: float | None) -> Limits | None:
    """The limits of the next recording, or None when none is asked for."""
    from fric.identification.design import Limits

    if not design:
        if given or duration is not None:
            raise InputError("--limit/--duration", "belong to --design", "add --design")
        return None
    return Limits.parsed(given, _DURATION if duration is None else duration)


def _rig(given: list[str]) -> Rig:
    """How the next recording is made, from texts such as ``resolution=1e-6``."""
    from fric.identification.design import Rig

    found = {"period": _PERIOD}
    for text in given:
        name, _, number = text.partition("=")
        try:
            found[name] = float(number)
        except ValueError:
            found[name] = math.nan
        known = name in Rig.__dataclass_fields__
        if not known or not math.isfinite(found[name]) or found[name] < 0.0 or found["period"] == 0.0:
            raise InputError("--rig", f"is '{text}'", f"give NAME=NUMBER with {', '.join(Rig.__dataclass_fields__)}")
    return Rig(**found)


def _refuse_overlap(train: list[Path], validation: list[Path]) -> None:
    same = {path.resolve() for path in train} & {path.resolve() for path in validation}
    if same:
        raise InputError(same.pop(), "is both fitted and validated on", "keep a recording apart for --validate")


def _structure(model: Path | None, terms: str, record: Record) -> Model:
    """The model to fit: from a file, or from a list of effects with start values of one."""
    from fric.identification.start import start_model
    from fric.model_file import read_model

    if model is not None:
        return replace(read_model(model), joint=record.joint, standard_errors={}, provenance={})
    names = [name.strip() for name in terms.split(",") if name.strip()]
    return start_model(names, record.joint, record.units)


def _inspect(records: list[Record]) -> tuple[Finding, ...]:
    """What is wrong with the recordings themselves, said before anything is fitted."""
    from fric.instrument import inspect

    progress("looking for faults of the recordings")
    findings = inspect(records)
    for finding in findings:
        if finding.verdict in ("warning", "fault"):
            progress(f"{finding.verdict}: {finding.detail}{'; ' + finding.remedy if finding.remedy else ''}")
    return findings


def _foresee(structure: Model, records: list[Record], options: Options, method: Method, experiments: bool) -> Foreseen | None:
    """What the recordings can tell, said before the fit; None where the method sees something else, or nothing can be said."""
    from fric.identification.identifiability import foresee

    if not method.predicts:
        return None
    progress("asking what the recordings can tell")
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


def _write(
    out: Path,
    result: Identification,
    records: list[Record],
    validation: list[Record],
    options: Options,
    summary: dict[str, Any],
) -> None:
    """Every result, or none: all are made before the first is written."""
    from fric.files import write_text
    from fric.model_file import write_model
    from fric.report.kind import page_of

    attachments = result.attachments
    page = page_of(result, records, validation, options)
    write_text(out / "identification.json", json.dumps(summary, indent=2) + "\n")
    write_model(result.model, out / "model.yaml")
    for name, text in attachments.items():
        write_text(out / name, text)
    write_text(out / "report.html", page)


def _design_alone(
    path: Path | None, limits: Limits | None, rig: Rig, method: Method, options: Options, out: Path, as_json: bool, tries: int
) -> None:
    """A design without recordings, from the values of a model file."""
    from fric.model_file import read_model

    if limits is None:
        raise InputError("fric identify", "no recording is given", "name one, or design the first with --design and --model")
    if path is None:
        raise InputError("--design", "neither recordings nor a model are given", "give --model with values near the machine's")
    summary = _design(read_model(path), None, [], limits, rig, method, options, out, as_json, tries)
    if as_json:
        typer.echo(json.dumps({"design": summary}))


def _design(
    model: Model,
    first: Identification | None,
    records: list[Record],
    limits: Limits,
    rig: Rig | None,
    method: Method,
    options: Options,
    out: Path,
    as_json: bool,
    tries: int,
) -> dict[str, Any]:
    """Propose the next excitation, and write design.json, excitation.yaml and design.html."""
    from fric.files import write_text
    from fric.identification.design import problem_for, propose, rig_of
    from fric.report.design import design_report

    if not method.predicts:
        raise InputError("--design", f"not to be had for the method '{method.id}'", "use inverse-dynamics or prediction-error")
    made = rig_of(records) if rig is None else rig
    problem, notes = problem_for(model, first, records, options, limits, made, method.predicts)
    found = propose(problem, n_each=tries, n_refining=12 * tries, notes=notes, progress=progress)
    summary = found.summary()
    texts = {
        "design.json": json.dumps(summary, indent=2) + "\n",
        "excitation.yaml": found.parameters_file(model.joint),
        "design.html": design_report(found),
    }
    for name, text in texts.items():
        write_text(out / name, text)
    if not as_json:
        print_design(found, out, list(texts))
    return summary
