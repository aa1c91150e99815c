"""``fric prove``: measure how often the diagnosis is right, on simulated axes or on recordings of one's own."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from fric.errors import InputError

from .groups import Group, grouped
from .options import JsonOption, OutOption, Reading, ReadingGroup, progress, read_all

if TYPE_CHECKING:
    from fric.diagnosis.prove.injection import Injected

__all__ = ["register"]


@dataclass(frozen=True)
class Injections:
    """What is concealed in recordings of one's own, and how it is diagnosed."""

    sizes: Annotated[
        str, typer.Option("--sizes", help="With --inject: sizes, as multiples of what stays unexplained where the effect acts.")
    ] = "3,6"
    limits: Annotated[
        bool,
        typer.Option(
            "--limits",
            help="With --inject: conceal each effect at one and a half of its detection limit and at half of it, instead of "
            "--sizes.",
        ),
    ] = False
    only: Annotated[str, typer.Option("--only", help="With --inject: effects, separated by commas. If not given: all.")] = ""
    blocks: Annotated[
        int, typer.Option("--blocks", help="With --inject: parts of each recording; every other one is kept for the test.")
    ] = 10


@dataclass(frozen=True)
class Effort:
    """Worker processes, one per core when None, and the time after which a diagnosis looks for nothing more [s], if any."""

    jobs: int | None
    at_most: float | None

    @property
    def words(self) -> str:
        """The option that changes what is found, with a blank before it."""
        return "" if self.at_most is None else f" --at-most {self.at_most:g}"


InjectionsGroup = Annotated[Injections, Group("Effects concealed in recordings")]
"""What is concealed, as a parameter of a command."""


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command("prove", no_args_is_help=True, epilog="Example: fric prove --cases 300 --seed 1 --out proof")(prove)


@grouped
def prove(
    out: OutOption,
    cases: Annotated[int, typer.Option("--cases", help="Number of simulated axes.")] = 300,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the random numbers; the same seed draws the same cases.")] = 1,
    variant: Annotated[
        str,
        typer.Option(
            "--variant",
            help="standard; form (other laws of the same effects); foreign (laws that fric does not have); half-rate; "
            "double-rate; mixed (effects beside unknown physics); compound (three to five effects at once); "
            "slow-log (only every n-th sample is logged); dirt (coloured noise, mains, interpolation error and jitter in the "
            "recordings); mujoco (axes simulated by MuJoCo, which needs the extra 'peers') and events (axes simulated from "
            "event to event), both with other controllers, ordinary motions and dirt.",
        ),
    ] = "standard",
    jobs: Annotated[int | None, typer.Option("--jobs", help="Number of processes. If not given: one per core.")] = None,
    at_most: Annotated[
        float | None,
        typer.Option(
            "--at-most",
            help="After this time, in s, each diagnosis looks for no further effects. If not given: until nothing more helps.",
        ),
    ] = None,
    inject: Annotated[
        list[Path] | None,
        typer.Option("--inject", help="Conceal effects in this recording instead of simulated axes. May be repeated."),
    ] = None,
    model: Annotated[
        Path | None, typer.Option("--model", help="With --inject: the model that the diagnosis starts from.")
    ] = None,
    injections: InjectionsGroup = Injections(),
    calibrate: Annotated[
        list[Path] | None,
        typer.Option(
            "--calibrate",
            help="Learn how sure effects are from this examination. May be repeated.",
        ),
    ] = None,
    reading: ReadingGroup = Reading(),
    as_json: JsonOption = False,
) -> None:
    """Measure how often the diagnosis is right; exit status 1 when a goal is missed. A stopped run continues in its folder."""
    if calibrate:
        _calibrate(calibrate, out)
        return
    if inject or model is not None:
        _inject(inject or [], model, injections, Effort(jobs, at_most), reading, out, as_json)
        return
    _examine(cases, seed, variant, Effort(jobs, at_most), out, as_json)


def _examine(cases: int, seed: int, variant: str, effort: Effort, out: Path, as_json: bool) -> None:
    """Simulated axes; the page and ``scores.json`` go into ``out``."""
    from fric.diagnosis.prove.examination import hold
    from fric.files import write_text
    from fric.report.prove import prove_page

    held = hold(cases, seed, out, variant=variant, jobs=effort.jobs, at_most=effort.at_most, progress=progress)
    name = "" if variant == "standard" else f" --variant {variant}"
    command = f"fric prove --cases {cases} --seed {seed}{name}{effort.words} --out {out.name}"
    write_text(out / "index.html", prove_page(held, command))
    result = {
        "cases": cases,
        "seed": seed,
        "variant": variant,
        "at_most": effort.at_most,
        "key_sha256": held.hash_of_key,
        "seconds": held.seconds,
        "figures": [
            {
                "name": each.name,
                "value": each.value if math.isfinite(each.value) else None,
                "unit": each.unit,
                "goal": each.goal,
                "reached": each.reached,
            }
            for each in held.score.figures
        ],
        "rates": {
            name: {"hits": rate.hits, "of": rate.of, "interval": list(rate.interval)} for name, rate in held.score.rates.items()
        },
        "confusion": [{"concealed": a, "said": b, "cases": n} for (a, b), n in sorted(held.score.confusion.items())],
        "misses": [
            {"case": each.number, "concealed": list(each.effects), "said": each.said}
            for each in held.outcomes
            if not each.right
        ],
    }
    write_text(out / "scores.json", json.dumps(result, indent=1))
    if as_json:
        typer.echo(json.dumps(result))
    else:
        for each in held.score.figures:
            mark = "" if each.reached is None else f"  ({each.goal}: {'reached' if each.reached else 'MISSED'})"
            typer.echo(f"{each.name}: {each.value:.4g}{'' if each.unit in ('1', '') else ' ' + each.unit}{mark}")
        typer.echo(f"written: {out / 'index.html'}")
    if held.score.missed:
        raise typer.Exit(1)


def _calibrate(examinations: list[Path], out: Path) -> None:
    """The map from evidence to probability; ``calibration.json`` goes into ``out``."""
    from fric.diagnosis.prove.calibrating import learnt, off_in_use
    from fric.files import write_text

    content = learnt(examinations)
    out.mkdir(parents=True, exist_ok=True)
    write_text(out / "calibration.json", json.dumps(content, indent=1) + "\n")
    typer.echo(f"{content['findings']} findings, {content['right']} of them right")
    typer.echo(f"calibration error on cases that the map was not learnt from: {content['off on other cases']}")
    error, chance = off_in_use(examinations)
    typer.echo(
        f"of the map in use, if it was learnt from none of these: {error:.3f}; by chance alone, were it exact: {chance:.3f}"
    )
    typer.echo(f"written: {out / 'calibration.json'}")


def _inject(
    recordings: list[Path],
    model: Path | None,
    asked: Injections,
    effort: Effort,
    reading: Reading,
    out: Path,
    as_json: bool,
) -> None:
    """Effects concealed in recordings; the page and ``injection.json`` go into ``out``."""
    from fric.diagnosis.prove.injection_exam import examined
    from fric.files import write_text
    from fric.model_file import read_model
    from fric.report.injection import found_in_words, injection_page

    if model is None or not recordings:
        raise InputError(
            "--inject" if model is None else "--model", "needs the other of the two", "give --inject BAG --model M"
        )
    if asked.limits and asked.only:
        raise InputError("--only", "doesn't go with --limits, which conceals every effect with a limit", "leave one out")
    wanted = None if asked.limits else _wanted(asked.sizes, asked.only)
    records = read_all(recordings, reading)
    bare, outcomes = examined(records, read_model(model), wanted, asked.blocks, out, progress, effort.jobs, effort.at_most)
    command = _command(recordings, model, asked, effort, reading, out)
    write_text(out / "injection.html", injection_page(bare, outcomes, command))
    result = {
        "found": sum(each.found for each in outcomes),
        "of": sum(each.asked for each in outcomes),
        "with_wrong_names": sum(bool(each.wrong) for each in outcomes),
        "outcomes": [
            {
                "effect": each.what.effect,
                "times": each.what.times,
                "rms": each.rms,
                "rest": each.rest,
                "limit": each.limit,
                "presence": each.presence,
                "wrong": list(each.wrong),
                "failure": each.failure,
            }
            for each in outcomes
        ],
    }
    write_text(out / "injection.json", json.dumps(result, indent=1))
    if as_json:
        typer.echo(json.dumps(result))
        return
    typer.echo(f"{found_in_words(outcomes)}; in {result['with_wrong_names']} another was named")
    typer.echo(f"written: {out / 'injection.html'}")


def _wanted(sizes: str, only: str) -> list[Injected]:
    """The injections that are asked for.

    Raises:
        InputError: no numbers, or no effects that can be injected.
    """
    from fric.diagnosis.prove.injection import injections

    try:
        found = [float(each) for each in sizes.split(",")]
    except ValueError:
        found = []
    if not found or not all(math.isfinite(each) and each > 0.0 for each in found):
        raise InputError("--sizes", f"'{sizes}' isn't a list of numbers above 0", "give for example --sizes 3,6")
    names = {each for each in only.split(",") if each}
    every = injections(found)
    known = {each.effect for each in every}
    if names - known:
        raise InputError(
            "--only", f"'{', '.join(sorted(names - known))}' can't be injected", f"one of {', '.join(sorted(known))}"
        )
    return [each for each in every if not names or each.effect in names]


def _command(recordings: list[Path], model: Path, asked: Injections, effort: Effort, reading: Reading, out: Path) -> str:
    """What makes the page again, with the names of files alone."""
    words = ["fric prove", *(f"--inject {each.name}" for each in recordings), f"--model {model.name}"]
    words += ["--limits" if asked.limits else f"--sizes {asked.sizes}", f"--blocks {asked.blocks}"]
    words += [f"--only {asked.only}"] if asked.only else []
    words += [effort.words.strip()] if effort.words else []
    words += ["--repair"] if reading.repair else []
    words += [f"--time {reading.time}"] if reading.time != "stamp" else []
    given = {"--joint": reading.joint, "--start": reading.start, "--end": reading.end}
    words += [f"{name} {value}" for name, value in given.items() if value is not None]
    words += [f"--topic {each}" for each in reading.topic]
    return " ".join((*words, f"--out {out.name}"))
