"""What models leave on the recordings held back: residuals, noise floor, energy over time, predictions, what is withdrawn."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..identification.statistics import sandwich_covariance
from ..model import Model
from ..record import Array, Record
from .candidates import scales_of
from .confidence import LITTLE_LEFT, MANY, UNEXPLAINED
from .fitting import bounds_of
from .growth import Growth
from .least_squares import FROM_NEAR, Fit
from .locate import moved_back, steady
from .result import (
    Grown,
    NominalPart,
    Prediction,
)
from .start import (
    BANDWIDTHS,
    FAST,
    DiagnosisError,
)
from .track import Track
from .twin import twins

__all__ = [
    "FLOOR_UNSURE",
    "HARDLY",
    "as_fast",
    "difference_of",
    "energy_left",
    "floor_of",
    "growth_told",
    "interval_of",
    "locating",
    "mean_square",
    "most_left",
    "nominal_part",
    "paired",
    "predictions_of",
    "shown",
    "unless_worse",
    "with_errors",
    "withdrawn",
]

_KEPT = 0.4  # of what a grown model took off where it was fitted, to be found on the recordings held back
FLOOR_UNSURE = 0.6  # of a floor, by which that may be more: what little is missing is known the worse
HARDLY = 0.6  # with more than this left, something unknown remains however little is known of the floor
_TWINS = 5
_DECIDED = 0.5  # of what the refitted nominal model lacks: with more, twins of the grown one say nothing
_LOCATING = 600.0  # [rad/s], for spans of time
_RESAMPLED = 20  # blocks, each longer than what is left hangs together
_DRAWS = 1000  # of them, with replacement


def most_left(growth: Growth) -> float:
    """Share of what is missing that an explanation leaves at most, as well as both are known."""
    most = UNEXPLAINED if len(growth.steps) < MANY else LITTLE_LEFT
    return min(most + FLOOR_UNSURE * growth.begin.floor / max(growth.begin.excess, 1e-300), HARDLY)


def unless_worse(validation: Sequence[Record], whole: Sequence[Track], growth: Growth) -> Growth:
    """``growth`` without the terms that only help, where the recordings held back speak against them."""
    plain = growth.unhelped
    if plain is None:
        return growth
    held = shown(validation, growth.track, growth.begin.fit.model, growth.slower)
    left = [held.residual(as_fast(whole, held, each)[2].model) for each in (growth, plain)]
    return growth if float(left[0] @ left[0]) < float(left[1] @ left[1]) else plain


def growth_told(growth: Growth) -> tuple[Grown, ...]:
    """How the model grew, on blocks of the learning recordings left out in turn."""
    excess = max(growth.begin.excess, 1e-300)
    found = [Grown("", 1.0, "")]
    for step in growth.steps:
        own = step.term.split("#")[0]
        rival = next((each for each in step.rivals if each.effect.id != own), None)
        beside = "" if rival is None else f"{rival.effect.id}: {100 * max(rival.left - growth.begin.floor, 0.0) / excess:.3g} %"
        found.append(Grown(step.term, max(step.after - growth.begin.floor, 0.0) / excess, beside))
    return tuple(found)


def paired(growth: Growth, noe: dict[str, float], noise_floor: float) -> bool:
    """True when the grown model takes off the recordings held back what it took off the others: the noise is the same in both.

    Beside the floor itself so little could not be seen.
    """
    promised = (growth.begin.left - growth.end.left) / max(growth.begin.floor, 1e-300)
    return bool(growth.steps) and noe["refit"] - noe["augmented"] > _KEPT * promised * noise_floor


def withdrawn(growth: Growth, missing: bool) -> list[tuple[str, str]]:
    """Terms that the recordings held back speak against, with the reason."""
    why = "makes the recordings held back worse" if missing else "the recordings held back show no mismatch"
    return [(step.term.split("#")[0], why) for step in growth.steps]


def shown(validation: Sequence[Record], track: Track, begin: Model, as_track: bool) -> Track:
    """The validation recordings, followed as fast as what is missing still stands out from the floor, or ``as_track`` is."""
    step = max(record.sample_time for record in validation)
    tried = (track.bandwidth,) if as_track else (*BANDWIDTHS, track.bandwidth)
    for bandwidth in sorted({min(w, FAST / step) for w in tried}, reverse=True):
        held = replace(Track.of(validation, bandwidth, begin, track.late), mass=track.mass, noticeable=track.noticeable)
        if not held.runs:
            raise DiagnosisError(validation[0].source, "has no valid part of 200 samples", "record for longer")
        left = held.residual(begin)
        floor = [held.residual(begin, twin) for twin in twins(held, begin, 2)]
        if bandwidth <= track.bandwidth or float(left @ left) > 3.0 * mean_square(floor):
            break
    return held


def as_fast(whole: Sequence[Track], held: Track, growth: Growth) -> tuple[Track, Fit, Fit]:
    """A track as fast as that of the recordings held back, and the refitted nominal and the grown model fitted to it.

    What a slow observer can't tell from nothing, such as how stops are damped, shows to a fast one.
    """
    fits = growth.begin.fit, growth.end.fit
    track = next((each for each in whole if each.bandwidth == held.bandwidth), None)
    if track is None or held.bandwidth <= growth.track.bandwidth:
        return growth.track, *fits
    bounds = [bounds_of(fit.model, scales_of(track)) for fit in fits]
    begin, end = (track.fit(fit.model, fit.names, FROM_NEAR, among) for fit, among in zip(fits, bounds, strict=True))
    return track, begin, end if growth.steps else begin


def floor_of(held: Track, begin: Model, end: Model, lacking: Array) -> list[Array]:
    """What twins of the grown model ``end`` leave [F], shape ``(n,)`` each.

    Where blows and sticking are decided by the noise, that is more than twins of the refitted nominal ``begin`` leave, and no
    physics left out. But where it comes near all that this lacks, the model sticks and slips where the axis doesn't, and its
    twins say nothing: then the quieter ones count.
    """
    own = [held.residual(end, twin) for twin in twins(held, end, _TWINS)]
    if end is begin or float(np.median([each @ each for each in own])) < _DECIDED * float(lacking @ lacking):
        return own
    return min(own, [held.residual(begin, twin) for twin in twins(held, begin, _TWINS)], key=mean_square)


def interval_of(share: float, left: Mapping[str, Array], floor: Sequence[Array]) -> tuple[float, float]:
    """95 % of the ``share`` that is left, by resampling blocks of the recordings held back."""
    blocks = [np.array_split(each, _RESAMPLED) for each in (left["augmented"], left["refit"])]
    chance = np.mean([[float(part @ part) for part in np.array_split(each, _RESAMPLED)] for each in floor], axis=0)
    end, begin = (np.array([float(part @ part) for part in parts]) - chance for parts in blocks)
    drawn = np.random.default_rng(0).integers(0, _RESAMPLED, (_DRAWS, _RESAMPLED))
    shares = np.clip(np.sum(end[drawn], axis=1) / np.maximum(np.sum(begin[drawn], axis=1), 1e-300), 0.0, 1.0)
    low, high = (float(each) for each in np.quantile(shares, [0.025, 0.975]))
    return min(low, share), max(high, share)


def mean_square(residuals: Sequence[Array]) -> float:
    """Mean over ``residuals`` of their sums of squares [F^2]."""
    return float(np.mean([each @ each for each in residuals]))


def with_errors(track: Track, fit: Fit) -> Model:
    """The fitted model with standard errors, residual correlation taken into account."""
    covariance = sandwich_covariance(fit.jacobian, fit.residual, np.ones(fit.residual.shape[0]), track.starts)
    errors = np.sqrt(np.maximum(np.diag(covariance), 0.0)) * fit.scale
    known = {name: float(error) for name, error in zip(fit.names, errors, strict=True) if math.isfinite(error) and error > 0.0}
    return replace(fit.model, standard_errors=known, provenance={"method": "diagnosis, fitted as a whole to what is missing"})


def nominal_part(nominal: Model, fit: Fit) -> NominalPart:
    """Values of the nominal model as they were given and as they are fitted."""
    given = {p.name: p.value for p in nominal.parameters()}
    found = {p.name: p.value for p in fit.model.parameters()}
    off = {name: 100.0 * (given[name] - value) / value for name, value in found.items() if name in given and value != 0.0}
    return NominalPart(given, found, off)


def locating(validation: Sequence[Record], held: Track, growth: Growth) -> Track:
    """The validation recordings, followed as fast as spans of time ask for."""
    return Track.of(validation, min(_LOCATING, FAST / held.runs[0].step[0]), growth.begin.fit.model, held.late)


def difference_of(fast: Track, before: Model, after: Model) -> list[Array]:
    """Energy of the force in which two models differ, without the noise of either [F^2], per run, one value per interval."""
    change = fast.padded(fast.residual(before) - fast.residual(after))
    return [moved_back(part, run.sample_time, fast.bandwidth) ** 2 for run, part in zip(fast.runs, change, strict=True)]


def energy_left(held: Track, residual: Array, floor: Sequence[Array]) -> list[Array]:
    """Energy of the rest above what twins leave at the same speed [F^2], per run, one value per interval."""
    level = mean_square(floor) / residual.shape[0]
    energy = []
    for run, part in zip(held.runs, held.padded(residual), strict=True):
        h = run.sample_time
        energy.append(np.maximum(steady(moved_back(part, h, held.bandwidth) ** 2, h) - 2.0 * level, 0.0))
    return energy


def predictions_of(validation: Sequence[Record], held: Track, left: Mapping[str, Array]) -> list[Prediction]:
    """Measured and predicted force of each validation recording at its samples, both as the observer sees them.

    What is missing is the force that the model takes less the recorded one, low-passed by the observer. The recorded force,
    low-passed alike, is taken away from it: what is left is the model's, and repeats nothing of what was recorded.
    """
    seen = held.seen([run.effort for run in held.runs])
    split = {
        name: held.split(each) for name, each in (("measured", seen), *((name, seen + each) for name, each in left.items()))
    }
    found = []
    for number, record in enumerate(validation):
        columns: dict[str, list[Array]] = {"time": [], "measured": [], "nominal": [], "refit": [], "augmented": []}
        for k, run in enumerate(held.runs):
            if held.record[k] != number:
                continue
            late = round(2.0 / (held.bandwidth * run.sample_time))
            n = max(split["measured"][k].shape[0] - late, 0)
            columns["time"].append(held.time[k][len(held.time[k]) - n - late :][:n])
            for name, parts in split.items():
                columns[name].append(parts[k][late:])
        joined = {name: np.concatenate(parts) if parts else np.zeros(0) for name, parts in columns.items()}
        found.append(
            Prediction(
                record.source, joined["time"], joined["measured"], joined["nominal"], joined["refit"], joined["augmented"]
            )
        )
    return found
