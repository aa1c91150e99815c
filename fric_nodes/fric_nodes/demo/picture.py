"""A still picture of the demonstration, for documents that can't hold a page."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from fric.report.figures import COLOURS
from fric.report.identification import friction_curve

from .report import DemoOutcome

__all__ = ["write_picture"]


def write_picture(outcome: DemoOutcome, path: Path) -> None:
    """Tracking error before and after, and the friction curve found beside the true one, as PNG."""
    # A canvas of its own: no display, and no state shared with a user's plots.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    drawing = Figure(figsize=(10.5, 3.6), layout="constrained")
    canvas = FigureCanvasAgg(drawing)
    left, right = drawing.subplots(1, 2, width_ratios=(2.2, 1.0))
    for name, run, colour in (
        ("PID alone", outcome.before, "before"),
        ("with identified friction model", outcome.after, "after"),
    ):
        left.plot(
            run.record.time, 1e6 * run.error, color=COLOURS[colour], linewidth=0.9, label=f"{name}: {1e6 * run.rms:.3g} µm RMS"
        )
    left.set_xlabel("time [s]")
    left.set_ylabel("tracking error [µm]")
    left.legend(loc="upper right", frameon=False)
    side = np.geomspace(1e-5, 0.1, 300)
    speed = np.concatenate([-side[::-1], side])
    right.plot(
        1e3 * speed, friction_curve(outcome.result.model, speed), color=COLOURS["after"], linewidth=2.4, label="identified"
    )
    right.plot(
        1e3 * speed, friction_curve(outcome.truth, speed), color=COLOURS["true"], linestyle="--", linewidth=1.2, label="true"
    )
    right.set_xlabel("velocity [mm/s]")
    right.set_ylabel("friction and bias [N]")
    right.legend(loc="upper left", frameon=False)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(color="#e8edf2")
    with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".tmp", delete=False) as file:
        drawn: Any = canvas  # its methods are typed in some versions and not in others
        drawn.print_png(file)
    written = Path(file.name)
    written.chmod(0o644)
    written.replace(path)
