"""``fric demo``: the whole loop on a simulated axis, with a page of what came of it."""

from __future__ import annotations

import json
import time as clock_of_wall
from pathlib import Path
from typing import Annotated

import typer

from .options import JsonOption, OutOption, progress

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command("demo", epilog="Example: fric demo --out demo; fric demo --clock wall --out demo_wall")(demo)


def demo(
    out: OutOption = Path("fric_demo"),
    clock: Annotated[str, typer.Option("--clock", help="lock-step, or wall for real time.")] = "lock-step",
    rate: Annotated[float, typer.Option("--rate", help="Samples per second.", min=10.0, max=5000.0)] = 500.0,
    seed: Annotated[int, typer.Option("--seed", help="Of motion and noise.", min=0)] = 1,
    as_json: JsonOption = False,
) -> None:
    """Excite, record, identify and compensate an axis whose friction the identifier doesn't know; all over real ROS 2 topics."""
    from ..demo.run import DemoSettings, run_demo

    start = clock_of_wall.monotonic()

    def tell(text: str) -> None:
        progress(f"[{clock_of_wall.monotonic() - start:5.1f} s] {text}")

    outcome = run_demo(DemoSettings(out, clock, rate, seed), tell)
    ratio = outcome.before.rms / outcome.after.rms
    unseen = outcome.unseen_before.rms / outcome.unseen_after.rms
    tell(f"tracking error {1e6 * outcome.before.rms:.3g} µm before, {1e6 * outcome.after.rms:.3g} µm after: {ratio:.1f} times less")
    tell(f"on a motion not seen before: {unseen:.1f} times less")
    if as_json:
        summary = {
            "tracking_rms_before": outcome.before.rms,
            "tracking_rms_after": outcome.after.rms,
            "improvement": ratio,
            "improvement_unseen": unseen,
            "clock": clock,
            "missed_deadlines": {
                name: run.missed for name, run in (("before", outcome.before), ("after", outcome.after))
            },
            "samples_per_second": outcome.rate,
            "bag": str(outcome.before.bag),
            "model": str(out / "model.yaml"),
            "report": str(out / "report.html"),
        }
        typer.echo(json.dumps(summary))
    else:
        typer.echo(f"bag:  {outcome.before.bag}\npage: {out / 'report.html'}")
