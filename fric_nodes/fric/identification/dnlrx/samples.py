"""From recordings to what a DNLRX is fitted to: filtered displacement and force from t_sl on, and what the springs can be.

Both signals pass the same zero-phase low-pass (Amthor et al. 2008, section 3.2: 50 Hz). In each stretch the samples before t_sl
are left out, see :mod:`fric.friction.dnlrx_regression`; from t_sl on the deformations of all springs are known, provided
that no threshold exceeds half of the travel that ends there. A stretch that never travels far would limit all thresholds to
its own short travel, and is left out instead.

The thresholds are searched between the noise of the filtered displacement and half of that travel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import signal

from ...friction.dnlrx import DnlrxModel, DnlrxPredictor
from ...friction.dnlrx_regression import Sliding, sliding_start
from ...record import Array, Record
from ..equations import Equations, equations
from ..result import IdentificationError, Options
from ..stretch import Stretch

__all__ = ["CUTOFF", "FILTER_ORDER", "Prepared", "Samples", "fractional_noe", "prepare"]

CUTOFF = 50.0  # [Hz]
FILTER_ORDER = 4  # as for the position, in .equations
_SHORT = 0.2  # of the longest travel: a stretch that travels less is left out
_NOISE = 5.0  # standard deviations below which no threshold is looked for
_LEAST_ROWS = 200


@dataclass(frozen=True, eq=False)
class Samples:
    """One stretch from t_sl on; arrays of shape ``(n,)``.

    Attributes:
        stretch: where it comes from, at full length.
        first: index of t_sl in the stretch.
        position: filtered [x].
        force: filtered [F].
        start: how the springs stand at the first sample.
    """

    stretch: Stretch
    first: int
    position: Array
    force: Array
    start: Sliding

    def deformation(self, thresholds: Array) -> Array:
        """Of the springs at the first sample [x], shape ``(M,)``."""
        return self.start.direction * thresholds

    def predicted(self, model: DnlrxModel) -> Array:
        """Force of ``model`` along the displacement [F], from lambda on, shape ``(n - lambda,)``."""
        predictor = DnlrxPredictor(model, float(self.position[0]), self.deformation(model.thresholds))
        return predictor.run(self.position)[model.first_predicted :]


@dataclass(frozen=True, eq=False)
class Prepared:
    """All stretches of one or several recordings.

    Attributes:
        parts: the stretches that are used.
        sample_time: T [s].
        lowest: smallest threshold to look for [x].
        highest: largest threshold that every part determines [x].
        cutoff: of the low-pass [Hz].
        found: the equations of the recordings, at full length.
        notes: what was left out, and why.
    """

    parts: tuple[Samples, ...]
    sample_time: float
    lowest: float
    highest: float
    cutoff: float
    found: Equations
    notes: tuple[str, ...]

    @property
    def n_samples(self) -> int:
        """Of all parts."""
        return sum(part.position.shape[0] for part in self.parts)

    def noe(self, model: DnlrxModel) -> float:
        """Normalised output error of ``model`` over every sample from lambda on, Eq. 19 [%]."""
        measured = [part.force[model.first_predicted :] for part in self.parts]
        return fractional_noe(measured, [part.predicted(model) for part in self.parts])


def fractional_noe(measured: Sequence[Array], predicted: Sequence[Array]) -> float:
    """Eq. 19 [%] over several stretches, each ``(n,)``, with one mean for all."""
    force = np.concatenate(measured)
    error = force - np.concatenate(predicted)
    spread = force - np.mean(force)
    return 100.0 * float(error @ error) / float(spread @ spread)


def prepare(records: Sequence[Record], options: Options) -> Prepared:
    """Filter ``records`` and find where each begins to be of use.

    Raises:
        IdentificationError: different sample times, a force that doesn't change, or nothing that slides.
    """
    source = ", ".join(record.source for record in records)
    step = [record.sample_time for record in records]
    if max(step) > 1.001 * min(step):
        raise IdentificationError(
            source,
            f"sample times from {min(step):.4g} to {max(step):.4g} s, and a DNLRX has one",
            "fit recordings of one rate together",
        )
    rate = 1.0 / step[0]
    cutoff = min(CUTOFF, 0.1 * rate) if options.cutoff is None else options.cutoff
    found = equations(list(records), Options(cutoff=cutoff, decimation=1, rest_velocity=options.rest_velocity))
    sos = signal.butter(FILTER_ORDER, 2.0 * cutoff * step[0], output="sos")
    edge = int(np.ceil(1.0 / cutoff / step[0]))
    parts: list[Samples] = []
    for stretch in found.stretches:
        if float(np.ptp(stretch.position)) == 0.0:
            continue
        force = np.asarray(signal.sosfiltfilt(sos, stretch.force))
        # Filters know nothing of what was before a stretch.
        inside = stretch.position[edge:-edge]
        start = sliding_start(inside)
        first = edge + start.sample
        parts.append(Samples(stretch, first, stretch.position[first:-edge].copy(), force[first:-edge], start))
    if not parts:
        raise IdentificationError(source, "the joint doesn't move", "record strokes to and fro that go through to sliding")
    notes = list(found.notes)
    used = _far_enough(parts, notes, records[0].units.position)
    if float(np.ptp(np.concatenate([part.force for part in used]))) == 0.0:
        raise IdentificationError(source, "the force doesn't change", "record the force (effort) beside the position")
    n = sum(part.position.shape[0] for part in used)
    if n < _LEAST_ROWS:
        raise IdentificationError(
            source,
            f"only {n} samples are left after the longest stroke",
            "begin the recording with a stroke through to sliding, and let the smaller ones follow",
        )
    noise = max(_noise(part.stretch, cutoff) for part in used)
    highest = 0.5 * min(part.start.travel for part in used)
    lowest = max(_NOISE * noise, 1e-7 * highest)
    if lowest > 0.1 * highest:
        raise IdentificationError(
            source,
            f"position noise of {noise:.2g} {records[0].units.position} leaves none below a travel of {2.0 * highest:.2g}",
            "record longer strokes, or lower the cutoff",
        )
    return Prepared(tuple(used), step[0], lowest, highest, cutoff, found, tuple(notes))


def _far_enough(parts: list[Samples], notes: list[str], unit: str) -> list[Samples]:
    longest = max(part.start.travel for part in parts)
    used = [part for part in parts if part.start.travel >= _SHORT * longest]
    if len(used) < len(parts):
        shortest = min(part.start.travel for part in parts)
        notes.append(
            f"{len(parts) - len(used)} of {len(parts)} parts travel too little ({shortest:.2g} {unit}, the longest "
            f"{longest:.2g}) to determine the state of the springs, and are left out: begin every recording with a long stroke"
        )
    before = sum(part.first for part in used) * used[0].stretch.sample_time
    notes.append(
        f"{before:.2f} s before the longest strokes end (t_sl) aren't used: the state of the springs isn't known there"
    )
    return used


def _noise(stretch: Stretch, cutoff: float) -> float:
    """Standard deviation of the filtered position due to noise and steps of the sensor [x].

    What the filter took away is noise where nothing moves fast: the quieter windows show it. Of white noise the share
    2 cutoff T passes.
    """
    length = max(round(0.1 / stretch.sample_time), 4)
    away = stretch.raw_position - stretch.position
    windows = away[: away.shape[0] // length * length].reshape(-1, length)
    quiet = float(np.sqrt(np.quantile(np.mean(windows**2, axis=1), 0.25)))
    return quiet * float(np.sqrt(min(2.0 * cutoff * stretch.sample_time, 1.0)))
