"""``fric prove``: measure how often the diagnosis is right, on simulated axes whose true physics is kept from it."""

from __future__ import annotations

import json
import math
from typing import Annotated

import typer

from .options import JsonOption, OutOption, progress

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command("prove", no_args_is_help=True, epilog="Example: fric prove --cases 300 --seed 1 --out proof")(prove)


def prove(
    out: OutOption,
    cases: Annotated[int, typer.Option("--cases", help="Number of simulated axes.")] = 300,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the random numbers; the same seed draws the same cases.")] = 1,
    variant: Annotated[
        str,
        typer.Option(
            "--variant",
            help="standard; form (other laws of the same effects); foreign (laws that fric does not have); half-rate; "
            "double-rate; mixed (effects beside unknown physics); slow-log (only every n-th sample is logged).",
        ),
    ] = "standard",
    jobs: Annotated[int | None, typer.Option("--jobs", help="Number of processes. If not given: one per core.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Measure how often the diagnosis is right; exit status 1 when a goal is missed. A stopped run continues in its folder."""
    from fric.diagnosis.prove.examination import hold
    from fric.files import write_text
    from fric.report.prove import prove_page

    held = hold(cases, seed, out, variant=variant, jobs=jobs, progress=progress)
    name = "" if variant == "standard" else f" --variant {variant}"
    command = f"fric prove --cases {cases} --seed {seed}{name} --out {out.name}"
    write_text(out / "index.html", prove_page(held, command))
    result = {
        "cases": cases,
        "seed": seed,
        "variant": variant,
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
