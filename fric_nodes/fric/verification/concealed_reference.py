"""What the concealed cases share: an axis to record, and the evidence that a diagnosis gives.

A case knows a truth and a nominal model that lacks a part of it. The truth is integrated by the examiner's loop
(:mod:`fric.diagnosis.prove.truth`) or by the case itself, and where it is a plant of fric, in finer steps than a fit;
the recording gets an encoder's steps and a noisy force signal, and the nominal model values that are off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from ..diagnosis import diagnose
from ..diagnosis.motion import smooth
from ..diagnosis.prove.axis import Setting
from ..diagnosis.prove.experiment import Bench, draw_recording
from ..diagnosis.prove.physics import Physics
from ..diagnosis.result import Diagnosis, Finding, Prediction
from ..figure import Figure
from ..model import Model
from ..record import Array, Record
from ..report.figures import Curve, scatter_and_curves, shaded, stacked
from ..report.numbers import significant
from .verification import Evidence

__all__ = ["AXIS", "Case", "Limits", "axis_recordings", "evidence", "found_in"]

_SHOWN = 1.5  # [s] of the picture that shows the difference

AXIS = Setting(
    physics=Physics(mass=2.0, coulomb=4.0, viscous=12.0, bias=0.5),
    parts=("coulomb", "viscous", "bias"),
    travel=0.1,
    top_speed=0.16,
    acceleration=1.6,
    bandwidth=50.0,
    sample_time=2e-3,
    train_time=20.0,
    validation_time=14.0,
    resolution=2e-7,
)
"""A guideway of 100 mm with 4 N of friction, recorded at 500 Hz in a closed loop."""


@dataclass(frozen=True, eq=False)
class Case:
    """Recordings of a truth, and the model that lacks a part of it."""

    train: Sequence[Record]
    validation: Sequence[Record]
    nominal: Model


def axis_recordings(setting: Setting, physics: Physics, force_noise: float, seed: int) -> tuple[list[Record], list[Record]]:
    """A recording to learn from and one to hold back, of an axis with ``physics`` and ``force_noise`` [N]."""
    random = np.random.default_rng(seed)
    drawn = [
        draw_recording(setting, setting.physics, duration, frozenset(), False, random)
        for duration in (setting.train_time, setting.validation_time)
    ]
    bench = Bench(setting, (drawn[0],), drawn[1], setting.resolution, force_noise)
    records = []
    for name, each in zip(("training", "validation"), drawn, strict=True):
        run = bench.run(physics, each)
        records.append(
            Record(
                time=np.arange(run.command.shape[0], dtype=np.float64) * setting.sample_time,
                position=run.measured,
                effort=run.command + bench.noise(each),
                source=name,
                effort_hold="following",
            )
        )
    return records[:1], records[1:]


def found_in(case: Case) -> Diagnosis:
    """The diagnosis of ``case``."""
    return diagnose(case.train, case.validation, case.nominal)


@dataclass(frozen=True)
class Limits:
    """Goals of a case: confidence at least, NOE of the grown over that of the refitted model at most."""

    confidence: float = 0.5
    ratio: float = 0.5


def evidence(
    case: Case, found: Diagnosis, expected: Sequence[str], components: Sequence[str], goals: Limits, notes: Sequence[str]
) -> Evidence:
    """What ``found`` says, against the ``expected`` first finding, one of several names, in one of the ``components``."""
    first = found.findings[0] if found.findings else None
    v = found.validation
    name = " or ".join(expected)
    figures = [
        Figure(f"the first finding is {name}", float(first is not None and first.effect in expected), "1", "== 1"),
        Figure("it is located in the right component", float(first is not None and first.component in components), "1", "== 1"),
        Figure("confidence", 0.0 if first is None else first.confidence, "1", f">= {goals.confidence:g}"),
        Figure("unseen data: NOE of the nominal model as given", v.noe_nominal, "%"),
        Figure("unseen data: NOE refitted", v.noe_refit, "%"),
        Figure("unseen data: NOE with what was missing", v.noe_augmented, "%"),
        Figure("unseen data: NOE that the instruments leave", v.noise_floor, "%"),
        Figure("grown over refitted", v.noe_augmented / v.noe_refit, "1", f"<= {goals.ratio:g}"),
        Figure("share of the mismatch's energy that nothing found explains", found.unexplained.share, "1"),
    ]
    told = [found.sentence, *(_told(each, k) for k, each in enumerate(found.findings))]
    return Evidence(figures, _plots(case, found), [*notes, *told])


def _told(each: Finding, number: int) -> str:
    values = ", ".join(f"{key.split('.')[1]} {significant(value.value)} {value.unit}" for key, value in each.parameters.items())
    rival = f"; runner-up {each.runner_up.effect} ({100 * each.runner_up.confidence:.1f} %)" if each.runner_up else ""
    return (
        f"Finding {number + 1}: {each.effect}{'/' + each.law if each.law else ''}, {100 * each.confidence:.1f} % sure{rival};"
        f" {each.component}; {each.where.regime}" + (f"; {values}." if values else ".")
    )


def _plots(case: Case, found: Diagnosis) -> list[tuple[go.Figure, str]]:
    p = found.prediction[0]
    plots = [
        (_difference(found, p), "Where the refitted nominal model is off most, on the recording held back; shaded: located.")
    ]
    record = case.validation[0]
    rate = np.gradient(smooth(record.position, record.sample_time, 120.0), record.sample_time)
    velocity = np.interp(p.time, record.time, rate)
    before, after = p.force_measured - p.force_refit, p.force_measured - p.force_augmented
    curves = [
        Curve("mean, refitted nominal", *_means(velocity, before), "before", width=2.4),
        Curve("mean, grown model", *_means(velocity, after), "after", width=2.4),
    ]
    units = found.given.units
    over = scatter_and_curves(
        ("missing in the refitted nominal", velocity, before),
        curves,
        f"velocity [{units.position}/s]",
        f"missing force [{units.force}]",
        340,
    )
    plots.append((over, "The force that is missing over velocity, on the recording held back."))
    return plots


def _difference(found: Diagnosis, p: Prediction) -> go.Figure:
    step = float(np.median(np.diff(p.time)))
    width = min(max(round(_SHOWN / step), 50), p.time.shape[0])
    off = np.convolve((p.force_refit - p.force_measured) ** 2, np.ones(width), mode="valid")
    use = slice(int(np.argmax(off)), int(np.argmax(off)) + width)
    curves = [
        Curve("measured", p.time[use], p.force_measured[use], "measured", width=2.4),
        Curve("nominal, refitted", p.time[use], p.force_refit[use], "before"),
        Curve("with what was missing", p.time[use], p.force_augmented[use], "after"),
    ]
    plot = stacked([(f"force [{found.given.units.force}]", curves)], "time [s]", 320)
    spans = found.findings[0].where.time if found.findings else ()
    inside = [span for span in (spans[0] if spans else ()) if span[1] >= p.time[use][0] and span[0] <= p.time[use][-1]]
    return shaded(plot, inside)


def _means(x: Array, y: Array) -> tuple[Array, Array]:
    """Means of ``y`` over 40 equal parts of the range of ``x``."""
    edges = np.linspace(float(np.quantile(x, 0.005)), float(np.quantile(x, 0.995)), 41)
    part = np.digitize(x, edges)
    used = [k for k in range(1, 41) if np.sum(part == k) > 5]
    return np.array([np.mean(x[part == k]) for k in used]), np.array([np.mean(y[part == k]) for k in used])
