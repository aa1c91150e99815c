"""Design of the next experiment (``fric identify --design``): the excitation that tells most, within given limits."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from fric.errors import InputError

from .identify_shown import print_design
from .options import progress
from .results import Record as ResultRecord
from .results import Results

if TYPE_CHECKING:
    from fric.identification.design import Limits, Rig
    from fric.identification.result import Identification, Method, Options
    from fric.model import Model
    from fric.record import Record

__all__ = ["Design", "design_alone", "designed", "limits_of"]

_DURATION = 20.0  # [s]: a physical scale, of an experiment that nobody minds to wait for
_PERIOD = 0.002  # [s]: a physical scale, the usual one of a controller
_RECORD = ResultRecord("design.json", ("worst_relative_error", "excitation"))
_FILES = ("excitation.yaml", "design.html")


@dataclass(frozen=True)
class Design:
    """What the next experiment may be."""

    wanted: Annotated[
        bool, typer.Option("--design", help="Propose the next excitation: the one that most reduces the largest uncertainty.")
    ] = False
    limit: Annotated[
        tuple[str, ...],
        typer.Option(
            "--limit", help="Limit of the next excitation: position=LO,HI, speed=V and force=LO,HI; all three are needed."
        ),
    ] = ()
    duration: Annotated[
        float | None,
        typer.Option("--duration", help=f"Longest duration of the next recording, in s. If not given: {_DURATION:g}."),
    ] = None
    rig: Annotated[
        tuple[str, ...],
        typer.Option(
            "--rig",
            help="Without recordings, how the next one is measured: period=S, resolution=X, position_noise=X, force_noise=F.",
        ),
    ] = ()
    tries: Annotated[
        int, typer.Option("--tries", help="How many settings of each excitation the first search tries; more take longer.")
    ] = 6


def limits_of(design: Design) -> Limits | None:
    """The limits of the next recording, or None when none is asked for.

    Raises:
        InputError: they are missing, or can't be read; or they are given without a design.
    """
    from fric.identification.design import Limits

    if design.tries < 1:
        raise InputError("--tries", f"is {design.tries}", "give 1 or more")
    if not design.wanted:
        if design.limit or design.duration is not None:
            raise InputError("--limit/--duration", "belong to --design", "add --design")
        return None
    return Limits.parsed(list(design.limit), _DURATION if design.duration is None else design.duration)


def _rig(given: tuple[str, ...]) -> Rig:
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


def design_alone(
    path: Path | None, design: Design, limits: Limits | None, method: Method, options: Options, results: Results
) -> None:
    """A design without recordings, from the values of a model file.

    Raises:
        InputError: no design is asked for, or no model is given.
    """
    from fric.model_file import read_model

    rig = _rig(design.rig)
    if limits is None:
        raise InputError("fric identify", "no recording is given", "name one, or design the first with --design and --model")
    if path is None:
        raise InputError("--design", "neither recordings nor a model are given", "give --model with values near the machine's")
    summary = designed(read_model(path), None, [], design, limits, method, options, results, rig)
    if results.as_json:
        typer.echo(json.dumps({"design": summary}))


def designed(
    model: Model,
    first: Identification | None,
    records: list[Record],
    design: Design,
    limits: Limits,
    method: Method,
    options: Options,
    results: Results,
    rig: Rig | None = None,
) -> dict[str, Any]:
    """Propose the next excitation, and write design.json, excitation.yaml and design.html.

    Raises:
        InputError: the method predicts no samples, so that nothing is foreseen for it.
    """
    from fric.identification.design import problem_for, propose, rig_of
    from fric.report.design import design_report

    if not method.predicts:
        raise InputError("--design", f"is not available for the method {method.id}", "use inverse-dynamics or prediction-error")
    results = results.claimed(_RECORD, _FILES)
    made = rig_of(records) if rig is None else rig
    problem, notes = problem_for(model, first, records, options, limits, made, method.predicts)
    found = propose(problem, n_each=design.tries, n_refining=12 * design.tries, notes=notes, progress=progress)
    summary = found.summary()
    texts = {
        "excitation.yaml": found.parameters_file(model.joint),
        "design.html": design_report(found),
        _RECORD.name: json.dumps(summary, indent=2) + "\n",
    }
    results.write(_RECORD, texts)
    if not results.as_json:
        print_design(found, results.out, list(texts))
    return summary
