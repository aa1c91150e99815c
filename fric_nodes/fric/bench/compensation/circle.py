"""Circle test: two axes of one kind go round, and the radius shows at each quadrant what friction does at a reversal.

The first axis has the seed asked for, the second the next one; each is recorded, identified and tuned by itself. What is
measured is the true radius less the one wanted, over the last turn.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
import plotly.graph_objects as go

from ...control.trial import Reference, planned
from ...excitation import EXCITATIONS
from ...record import Array
from ...report.figures import COLOURS
from .catalogue import AXES
from .methods import METHODS, Bench, Setup

__all__ = ["CIRCLE_METHODS", "bench_of", "circle_plot", "peak", "rounds"]

RADIUS = 0.025  # [m], physical: of a usual circle test
CIRCLE_METHODS = ("pid + velocity", "pid + table", "pid + pulse", "pid + rigid model, eased", "pid + pre-sliding model")
_HUES = ("before", "measured", "second", "true", "after")
_TURNS = 2
_RAMP = 0.1  # physical: share of a turn in which the feed is reached


@lru_cache(maxsize=8)
def bench_of(axis: str, seed: int) -> Bench:
    """One axis of one seed, recorded and identified.

    Raises:
        IdentificationError: its recording doesn't tell its model.
    """
    held = AXES[axis]
    truth = held.drawn(seed)
    return Bench(held, truth, seed, held.identified(*held.recorded(truth, seed)))


@lru_cache(maxsize=64)
def _setup(axis: str, seed: int, method: str) -> Setup:
    return METHODS[method](bench_of(axis, seed))


def _reference(period: float, acceleration: float, number: int) -> Reference:
    feed = math.sqrt(acceleration * RADIUS)
    turn = 2.0 * math.pi * RADIUS / feed
    given = {"radius": RADIUS, "feed": feed, "turns": float(_TURNS), "axis": float(number), "ramp_time": _RAMP * turn}
    motion = EXCITATIONS["circle"].part(given, {}, np.random.default_rng(0))
    assert not hasattr(motion, "force")
    return planned(motion, period)


def rounds(
    seed: int, acceleration: float, methods: Sequence[str] = CIRCLE_METHODS, axis: str = "slide"
) -> dict[str, tuple[Array, Array]]:
    """Angle [rad] and radial error [x] of the last turn by method; each of shape ``(n,)``.

    Args:
        seed: of the first axis.
        acceleration: at the reversals, feed squared over radius [x/s^2].
        methods: names.
        axis: kind of both axes.
    """
    found = {}
    for method in methods:
        courses = []
        for number in (1, 2):
            bench = bench_of(axis, seed + number - 1)
            setup = _setup(axis, seed + number - 1, method)
            force = (setup.elsewhere or setup.force)()
            courses.append(bench.run(setup.law(), force, _reference(bench.axis.timing.period, acceleration, number)))
        x, y = courses
        n = x.position.shape[0]
        last = slice(round(n * (1.0 - 0.5 * (1.0 - _RAMP))), round(n * (1.0 - _RAMP / _TURNS)))
        wanted = np.arctan2(y.reference.position[last], x.reference.position[last] + RADIUS)
        error = np.hypot(x.position[last] + RADIUS, y.position[last]) - RADIUS
        found[method] = np.asarray(wanted), np.asarray(error)
    return found


def peak(error: Array) -> float:
    """Largest deviation from the mean radius [x]."""
    return float(np.max(np.abs(error - np.mean(error))))


def circle_plot(held: Mapping[str, tuple[Array, Array]]) -> tuple[go.Figure, str]:
    """The circles as a circle test draws them, errors magnified so that the largest is a fifth of the radius; and a caption."""
    largest = max(peak(error) for _, error in held.values())
    factor = 10.0 ** math.floor(math.log10(0.2 * RADIUS / max(largest, 1e-300)))
    plot = go.Figure()
    for (method, (angle, error)), hue in zip(held.items(), _HUES, strict=False):
        order = np.argsort(angle)
        around = np.append(order, order[0])
        plot.add_trace(
            go.Scatterpolar(
                r=1e3 * (RADIUS + factor * (error[around] - np.mean(error))),
                theta=np.degrees(angle[around]),
                mode="lines",
                name=f"{method}: {1e6 * peak(error):.2g} um",
                line={"color": COLOURS[hue], "width": 1.4},
            )
        )
    plot.update_layout(
        template="plotly_white",
        height=560,
        polar={"radialaxis": {"range": [0.0, 1.3e3 * RADIUS], "title": "mm"}},
        font={"family": "system-ui, DejaVu Sans, sans-serif", "size": 13, "color": COLOURS["true"]},
    )
    caption = f"Two slides on a circle of {1e3 * RADIUS:g} mm, deviation of the true radius magnified {factor:g} times."
    return plot, caption
