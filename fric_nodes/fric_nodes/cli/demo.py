"""``fric demo``: excite, identify and compensate a simulated axis over ROS 2, and write a report page."""

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
    clock: Annotated[
        str, typer.Option("--clock", help="lock-step (as fast as the machine computes, repeatable) or wall (real time).")
    ] = "lock-step",
    rate: Annotated[float, typer.Option("--rate", help="Samples per second.", min=10.0, max=5000.0)] = 500.0,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the random motion and noise.", min=0)] = 1,
    as_json: JsonOption = False,
) -> None:
    """Excite, record, identify and compensate an axis whose friction is unknown to the identification, over ROS 2."""
    from fric_nodes.demo.run import DemoSettings, run_demo

    start = clock_of_wall.monotonic()

    def tell(text: str) -> None:
        progress(f"[{clock_of_wall.monotonic() - start:5.1f} s] {text}")

    outcome = run_demo(DemoSettings(out, clock, rate, seed), tell)
    before, after = outcome.before, outcome.after
    ratio = before.rms / after.rms
    tell(f"tracking error {1e6 * before.rms:.3g} µm RMS before, {1e6 * after.rms:.3g} µm after: {ratio:.1f} times less")
    if clock == "wall":
        counts = [f"{run.missed} of {run.record.n_samples}" for run in (before, after)]
        tell(f"missed deadlines: {counts[0]} before, {counts[1]} after")
    if as_json:
        summary = {
            "tracking_rms_before": before.rms,
            "tracking_rms_after": after.rms,
            "improvement": ratio,
            "clock": clock,
            "samples": after.record.n_samples,
            "missed_deadlines": {"before": before.missed, "after": after.missed},
            "samples_per_second": outcome.rate,
            "bag": str(outcome.excitation.bag),
            "model": str(out / "model.yaml"),
            "report": str(out / "report.html"),
        }
        typer.echo(json.dumps(summary))
    else:
        typer.echo(f"bag:  {outcome.excitation.bag}\npage: {out / 'report.html'}")
