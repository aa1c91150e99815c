"""Where a diagnosis begins: recordings, followed, and a nominal model with values that a fit can start from.

What belongs to the instrument and to the question comes first: how a force is held between samples, where no recording says
it, and whether the model is one of the plant that was recorded at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..effect import Place
from ..errors import InputError
from ..identification.methods import inverse_dynamics
from ..identification.result import IdentificationError, Options
from ..model import Model, build_model
from ..plants import PLANTS
from ..record import Record
from .align import Z
from .candidates import scales_of
from .fitting import bounds_of, free_names
from .price import FAR_OFF, mass_off
from .track import Track
from .twin import twins

__all__ = [
    "BANDWIDTHS",
    "FAST",
    "FIRST_FIT",
    "DiagnosisError",
    "held_as",
    "lateness",
    "refuse_other_plant",
    "spread_of",
    "started",
    "tracks_of",
]

BANDWIDTHS = (45.0, 140.0, 400.0)
"""Of the observers that follow the recordings [rad/s]."""
FAST = 1.0
"""Largest product of bandwidth and sample time."""
FIRST_FIT = 6
"""Iterations, by which starts are compared."""
_NEXT_TO_NOTHING = 1e-3  # of an inertia, where all of it may be chance
_LACKS_MUCH = 0.3  # of the force's variance: more than a model that has most of the physics
_EXPLAINED = 0.02  # of the force: a plant that leaves less of it may be the one recorded
_FAR_BETTER = 0.25  # of what the given plant leaves: where a mass with the same terms leaves less, it is another plant
_HELD_LATE = 0.1  # of a sample: less isn't worth a word
_HELD = 0.65  # of a sample: a force that acts later than that, or earlier, does so for another reason


class DiagnosisError(InputError):
    """Recordings or a model that can't be compared."""


def spread_of(track: Track) -> float:
    """Sum of squares of the recorded force about its mean [F^2]."""
    effort = track.seen([run.effort for run in track.runs])
    return float(np.sum((effort - np.mean(effort)) ** 2))


def started(nominal: Model, train: Sequence[Record], as_given: bool = False) -> tuple[list[Track], Model]:
    """The recordings, followed, and the nominal structure with values that a fit can start from: the given or better ones."""
    starts = [replace(nominal, standard_errors={})]
    if not as_given and (found := _by_inverse_dynamics(starts[0], train)) is not None:
        starts.insert(0, found)
    tracks = tracks_of(train, starts[0], lateness(train, starts[0]))
    bounds = bounds_of(starts[0], scales_of(tracks[0]))
    fits = [tracks[0].fit(start, free_names(start), FIRST_FIT, bounds) for start in starts]
    best = min(fits, key=lambda fit: float(fit.residual @ fit.residual))
    lacks = float(best.residual @ best.residual) / max(spread_of(tracks[0]), 1e-300)
    if lacks > _LACKS_MUCH and not nominal.plant.led and mass_off((tracks[0].mass,), nominal) > FAR_OFF:
        # Where so much is missing that it makes up a mass of its own, the one given is the better measure.
        tracks = [replace(track, mass=nominal.total_inertia) for track in tracks]
    # Lag and viscous friction that are left out can make up a mass, too: what is plausible beside either is plausible.
    given = nominal.total_inertia
    return [replace(track, given=given, noticeable=_noticeable(track, best.model)) for track in tracks], best.model


def _noticeable(track: Track, model: Model) -> tuple[float, float]:
    """Root mean square of the force that ``model`` lacks, and of what a twin leaves [F]."""
    lacking = track.residual(model)
    hidden = track.residual(model, *twins(track, model, 1))
    return float(np.sqrt(np.mean(lacking**2))), float(np.sqrt(np.mean(hidden**2)))


def _by_inverse_dynamics(model: Model, train: Sequence[Record]) -> Model | None:
    """``model`` fitted to ``train`` by inverse dynamics, or None where these don't tell its values."""
    try:
        # Without its verdict: that an inertia comes out at nothing is what is asked.
        fitted = inverse_dynamics.fit_force(model, list(train), Options())
    except (IdentificationError, np.linalg.LinAlgError):
        return None
    found = fitted.model
    # Of an inertia that hardly shows no more is taken than is sure.
    for name, variance in zip(fitted.free.names, np.diag(fitted.covariance), strict=True):
        value, reach = found.value(name), Z * float(np.sqrt(max(variance, 0.0)))
        if name in model.plant.inertia_names and reach >= value:
            found = found.with_value(name, max(_NEXT_TO_NOTHING * value, value - reach))
    return found if np.all(np.isfinite(found.values)) else None


def lateness(train: Sequence[Record], start: Model) -> float:
    """Part of a sample by which the force acts after its stamps, where no recording says how it is held; at most one half.

    Of a controller's output that is held from its stamp to the next it is one half, in a log slower than the controller less.
    It belongs to the instrument: within a sample no recording tells it from a delay of the axis.
    """
    if start.plant.led or any(record.hold != "linear" for record in train):
        return 0.0
    path = [held.effect for held in start.terms if held.effect.place is Place.COMMAND_PATH]
    if any(p.dimension == "s" for effect in path for p in effect.parameters):
        return 0.0  # the model has a delay or a lag of its own, which takes it in
    lacks = []
    for late in (-0.5, 0.0, 0.5):
        track = tracks_of(train, start, late)[-1]
        left = track.fit(start, free_names(start), FIRST_FIT, bounds_of(start, scales_of(track))).residual
        lacks.append(float(left @ left))
    bend = lacks[0] - 2.0 * lacks[1] + lacks[2]
    if bend <= 0.0:
        return 0.0
    best = 0.25 * (lacks[0] - lacks[2]) / bend
    return min(max(best, -0.5), 0.5) if abs(best) < _HELD else 0.0


def tracks_of(train: Sequence[Record], start: Model, late: float = 0.0) -> list[Track]:
    """The recordings followed at several bandwidths, their force ``late`` by a part of a sample."""
    step = max(record.sample_time for record in train)
    allowed = [w for w in BANDWIDTHS if w * step <= FAST] or [FAST / step]
    if start.plant.led:
        allowed = [min(BANDWIDTHS[-1], FAST / step)]
    tracks = [Track.of(train, bandwidth, start, late) for bandwidth in allowed]
    if not tracks[0].runs:
        raise DiagnosisError(train[0].source, "has no valid part of 200 samples", "record for longer")
    return tracks


def refuse_other_plant(train: Sequence[Record], track: Track, start: Model) -> None:
    """Refuse a plant that explains far less of the force than a plain mass with the same terms does.

    No effect is what is missing in it.
    """
    rigid = PLANTS["rigid"]
    if start.plant.led or start.plant in (rigid, rigid.driven, rigid.behind):
        return
    spread = spread_of(track)
    plain = build_model("rigid", {"mass": start.total_inertia}, start.terms, units=start.units, nominal=start.nominal)
    lacks = []
    for model in (start, _by_inverse_dynamics(plain, train) or plain):
        followed = replace(track, mass=model.total_inertia)
        residual = followed.fit(model, free_names(model), bounds=bounds_of(model, scales_of(followed))).residual
        lacks.append(float(residual @ residual) / max(spread, 1e-300))
        if lacks[0] < _EXPLAINED:
            return
    if lacks[1] < _FAR_BETTER * lacks[0]:
        raise DiagnosisError(
            train[0].source,
            f"is of no '{start.plant.id}': refitted, that leaves {100.0 * min(lacks[0], 1.0):.0f} % of the force's energy, a "
            f"mass with the same terms {100.0 * lacks[1]:.2g} %",
            "give the model of the plant that was recorded (for one body: plant 'rigid')",
        )


def held_as(track: Track) -> list[str]:
    """What is taken for the hold of the force, where no recording says it."""
    if abs(track.late) < _HELD_LATE:
        return []
    part, time = abs(track.late), 1e3 * abs(track.late) * track.runs[0].sample_time
    return [
        f"how the force is held between samples isn't known (effort_hold: linear); it fits best {part:.2g} of a sample "
        f"({time:.2g} ms) {'after' if track.late > 0.0 else 'before'} its stamps, and is taken so: a controller that holds its "
        "output until the next sample comes half a sample late; no delay shorter than that is looked for"
    ]
