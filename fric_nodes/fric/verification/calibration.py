"""Intervals of the identification methods against known axes: a short form of ``fric bench calibration``.

A 90 % interval holds the truth in a share of recordings that has the standard deviation sqrt(0.09/n) over n independent trials.
With a few recordings only a gross fault shows: the share over all parameters of a method together has to stay above 0.75,
and a mean error over its standard error within three times its own standard deviation of 1/sqrt(n).
"""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from ..figure import Figure
from ..identification.calibration import AXES, Calibration, calibrate
from ..identification.result import Options
from ..report.figures import COLOURS
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

# Other recordings than those of the full count.
_CASES = {
    "output error": ("rigid", "output-error", range(1000, 1016)),
    "prediction error": ("rigid", "prediction-error", range(1000, 1016)),
    "prediction error, bristles": ("bristled", "prediction-error", range(1000, 1005)),
}


def _plot(found: dict[str, Calibration]) -> go.Figure:
    figure = go.Figure()
    for (name, case), colour in zip(found.items(), (COLOURS["after"], COLOURS["second"], COLOURS["before"]), strict=True):
        score = (case.estimates - case.truth) / case.errors
        figure.add_trace(
            go.Box(
                x=np.repeat(np.array(case.names), score.shape[0]).tolist(),
                y=score.T.ravel(),
                name=name,
                boxpoints="all",
                marker={"color": colour, "size": 4},
            )
        )
    figure.update_layout(boxmode="group", template="plotly_white", height=420, legend={"orientation": "h", "y": 1.12})
    for limit in (-1.645, 1.645):
        figure.add_hline(limit, line={"dash": "dash", "color": "#888888"})
    figure.update_yaxes(title="error over standard error")
    return figure


def _run() -> Evidence:
    found = {name: calibrate(AXES[axis], method, seeds, Options()) for name, (axis, method, seeds) in _CASES.items()}
    figures = []
    for name, case in found.items():
        limit = f"<= {3.0 / np.sqrt(case.estimates.shape[0]):.2f}"
        figures += [
            Figure(
                f"{name}: 90 % intervals that hold the truth, all parameters",
                float(np.mean(case.coverage(0.9))),
                "1",
                ">= 0.75",
            ),
            Figure(f"{name}: largest mean error over standard error", float(np.max(np.abs(case.bias))), "1", limit),
        ]
    caption = (
        "Errors of the estimates over their standard errors, one point per recording; nine of ten belong between the lines."
    )
    notes = ["The full count over 200 recordings per method, with inverse dynamics: fric bench calibration."]
    return Evidence(figures, [(_plot(found), caption)], notes)


VERIFICATION = Verification(
    id="calibration",
    title="Intervals of the identification",
    source="simulated axes with known values, integrated with finer steps than those of the fits",
    run=_run,
)
