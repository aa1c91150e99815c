"""Pictures of recordings, models and results, as plotly figures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..identification.equations import equations
from ..identification.scoring import driving_force, force_along
from ..model import Model
from ..record import Record
from ..report.figures import Curve, scatter_and_curves, stacked
from ..report.identification import friction_curve
from .comparing import Compared
from .diagnosing import Diagnosed
from .identifying import Identified

if TYPE_CHECKING:
    import plotly.graph_objects as go

__all__ = ["plot"]

_COLOURS = ("measured", "after", "before", "second", "true")
_POINTS = 400  # of a friction curve


def plot(shown: Record | Sequence[Record] | Model | Identified | Diagnosed | Compared, *, fastest: float = 1.0) -> go.Figure:
    """A picture, zoomable: ``.show()`` opens it, ``.write_html(path)`` and ``.write_image(path)`` keep it.

    Args:
        shown: a record or several (signals over time); a model (friction over velocity); an identification (friction curve
            with the measured points, or the force over time where the model has none); a diagnosis (measured and predicted
            force of the recordings held back); a comparison (the signals of both).
        fastest: velocity up to which a model's friction is drawn [x/s].

    Raises:
        InputError: nothing that can be drawn.
    """
    if isinstance(shown, Record):
        return _records([shown])
    if isinstance(shown, Model):
        return _model(shown, fastest)
    if isinstance(shown, Identified):
        return _identified(shown)
    if isinstance(shown, Diagnosed):
        return _diagnosed(shown)
    if isinstance(shown, Compared):
        return _compared(shown)
    if isinstance(shown, (list, tuple)) and shown and all(isinstance(each, Record) for each in shown):
        return _records(shown)
    raise InputError("plot", f"a {type(shown).__name__} can't be drawn", "give a record, a model or a result")


def _records(records: Sequence[Record]) -> go.Figure:
    units = records[0].units
    named = (("position", units.position), ("velocity", f"{units.position}/s"), ("effort", units.force))
    rows = []
    for name, unit in named:
        curves = [
            Curve(record.source if len(records) > 1 else name, record.time, record.signals()[name], _COLOURS[k % len(_COLOURS)])
            for k, record in enumerate(records)
            if name in record.signals()
        ]
        if curves:
            rows.append((f"{name} [{unit}]", curves))
    return stacked(rows, "time [s]")


def _axis(model: Model) -> tuple[str, str]:
    return f"velocity [{model.units.position}/s]", f"friction force [{model.units.force}]"


def _both_ways(fastest: float) -> np.ndarray:
    side = np.geomspace(1e-4 * fastest, fastest, _POINTS // 2)
    return np.concatenate([-side[::-1], side])


def _model(model: Model, fastest: float) -> go.Figure:
    grid = _both_ways(fastest)
    nothing = ("", np.zeros(0), np.zeros(0))
    return scatter_and_curves(nothing, [Curve("model", grid, friction_curve(model, grid), "after", width=2.4)], *_axis(model))


def _identified(shown: Identified) -> go.Figure:
    model = shown.model
    found = equations(list(shown.fitted.train), shown.fitted.options)
    friction = driving_force(model, found) - found.rows(lambda stretch: force_along(model.with_terms(()), stretch))
    grid = _both_ways(float(np.max(np.abs(found.velocity))))
    curves = [Curve("model", grid, friction_curve(model, grid), "after", width=2.4)]
    use = found.sliding
    return scatter_and_curves(("measured force less inertia", found.velocity[use], friction[use]), curves, *_axis(model))


def _diagnosed(shown: Diagnosed) -> go.Figure:
    p = shown.result.prediction[0]
    curves = [
        Curve("measured", p.time, p.force_measured, "measured", width=2.2),
        Curve("nominal model, refitted", p.time, p.force_refit, "before"),
        Curve("with what was found", p.time, p.force_augmented, "after"),
    ]
    missing = [
        Curve("measured less refitted", p.time, p.force_measured - p.force_refit, "before"),
        Curve("measured less augmented", p.time, p.force_measured - p.force_augmented, "after"),
    ]
    unit = shown.model.units.force
    return stacked([(f"force [{unit}]", curves), (f"difference [{unit}]", missing)], "time [s]")


def _compared(shown: Compared) -> go.Figure:
    found = shown.result
    units = {each.signal: each.unit for each in found.agreements}
    rows = [
        (
            f"{name} [{units.get(name, '')}]",
            [Curve("real", found.time, real, "measured", width=2.2), Curve("simulated", found.time, simulated, "after")],
        )
        for name, (real, simulated) in found.signals.items()
    ]
    return stacked(rows, "time [s]")
