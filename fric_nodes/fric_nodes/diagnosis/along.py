"""What a model lacks, by the shorter way: the force that it needs along the measured motion, less the one that was recorded.

Beside the observer of :mod:`fric_nodes.diagnosis.track`, whose model moves by itself, this is the older equation error: motion
by differentiation, force by the model's inverse. It says nothing of rests and of what lies behind a transmission, and noise
gets into the motion; but it is linear in the linear parameters however far off they are, and costs a tenth. So it says where
to start: which of many values of a candidate promise most, and from which values a fit begins.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..identification.gauss_newton import minimise
from ..model import Model, Term
from ..plants import PLANTS
from ..record import Array
from ..simulate import respond
from .track import Track
from .twin import smooth
from .universe import universe_of

__all__ = ["Along", "Motion", "motions"]

_SMOOTH = 4.0  # times the observer's bandwidth: of the motion
_REST = 0.01  # of the fast speed, below which the body may rest
_ITERATIONS = 5


@dataclass(frozen=True, eq=False)
class Motion:
    """The measured motion of one run, smoothed, in the middle of each interval.

    Attributes:
        position: [x], shape ``(n,)`` as the next two.
        velocity: [x/s].
        acceleration: [x/s^2].
        step: between them [s].
    """

    position: Array
    velocity: Array
    acceleration: Array
    step: float


def motions(track: Track) -> list[Motion]:
    """The smoothed motion of each run."""
    found = []
    for run in track.runs:
        step = run.sample_time
        position = smooth(np.concatenate([[run.start[0]], run.position]), step, _SMOOTH * track.bandwidth)
        velocity = np.diff(position) / step
        found.append(Motion(0.5 * (position[1:] + position[:-1]), velocity, np.gradient(velocity, step), step))
    return found


class Along:
    """A track's motion, once for all models that are held against it.

    Args:
        track: the recordings.

    Attributes:
        motion: of each run.
        moving: rows of the observer's signals in which the axis moves, shape ``(n,)``.
    """

    def __init__(self, track: Track) -> None:
        self._track = track
        self._path: tuple[object, list[Array]] | None = None
        self.motion = motions(track)
        speed = np.abs(np.concatenate([each.velocity for each in self.motion]))
        rest = max(_REST * float(np.quantile(speed, 0.98)), 4.0 * max(track.noise) * track.bandwidth)
        self.moving = track.joined([(np.abs(each.velocity) > rest).astype(np.float64) for each in self.motion]) > 0.5

    def can(self, model: Model) -> bool:
        """True for models whose force the motion at the sensor tells."""
        return PLANTS[model.plant.id].driven is not model.plant and bool(np.any(self.moving))

    def residual(self, model: Model, extra: Term | None = None) -> Array:
        """The force that ``model``, with the term ``extra``, lacks [F], as the observer would see it, where the axis moves."""
        universe = universe_of(model)
        values = universe.values(model)
        if extra is not None:
            universe.put(values, extra)
        track = self._track
        found = []
        for run, time, each in zip(track.runs, track.time, self.motion, strict=True):
            effort, friction = np.empty_like(time), np.empty_like(time)
            universe.loops.predict(
                values, time - 0.5 * each.step, each.position, each.velocity, each.acceleration, each.step, run.load,
                run.temperature, *universe.inner_states(model), effort, friction,
            )  # fmt: skip
            found.append(effort)
        found = [a - b for a, b in zip(found, self._applied(model), strict=True)]
        return np.nan_to_num(track.seen(found)[self.moving], nan=0.0, posinf=0.0, neginf=0.0)

    def _applied(self, model: Model) -> list[Array]:
        """What comes out of the command path of ``model`` [F], per run; that of the last model is kept."""
        path = tuple((held.effect.key, held.values) for held in model.terms if held.effect.command is not None)
        if self._path is None or self._path[0] != path:
            runs = zip(self._track.runs, self.motion, strict=True)
            self._path = path, [respond(model, run.effort, each.step) for run, each in runs]
        return self._path[1]

    def fitted(self, model: Model, names: Sequence[str], scale: Array, bounds: Mapping[str, tuple[float, float]]) -> Model:
        """``model`` with the parameters ``names``, of the sizes ``scale``, such that it lacks least along the motion."""
        index = np.array([model.names.index(name) for name in names], dtype=np.int64)
        declared = [parameter.declaration for parameter in model.parameters()]
        lower = np.array([1e-9 * s if declared[k].positive else declared[k].lower for k, s in zip(index, scale, strict=True)])
        upper = np.array([declared[k].upper for k in index])
        for k, name in enumerate(names):
            low, high = bounds.get(name, (-np.inf, np.inf))
            lower[k], upper[k] = max(lower[k], low), min(upper[k], high)
        values = model.values

        def at(point: Array) -> Model:
            trial = values.copy()
            trial[index] = point * scale
            return model.with_values(trial)

        answer = minimise(
            lambda point: self.residual(at(point)),
            values[index] / scale,
            lower / scale,
            upper / scale,
            difference=1e-3,
            point_tolerance=1e-3,
            cost_tolerance=1e-4,
            max_iterations=_ITERATIONS,
        )
        return at(answer.point)

    def changes(self, model: Model, names: Sequence[str], scale: Array) -> Array:
        """Derivative of :meth:`residual` by the parameters ``names``, per ``scale`` of each, shape ``(n, n_names)``."""
        base = self.residual(model)
        columns = []
        for name, size in zip(names, scale, strict=True):
            values = model.values
            values[model.names.index(name)] += 1e-3 * size
            columns.append((self.residual(model.with_values(values)) - base) / 1e-3)
        return np.stack(columns, axis=1) if columns else np.zeros((base.shape[0], 0))
