"""What a model lacks, by the shorter way: the force that it needs along the measured motion, less the one that was recorded.

Beside the observer of :mod:`fric.diagnosis.track`, whose model moves by itself, this is the older equation error: motion
by differentiation, force by the model's inverse. It says nothing of rests and of what lies behind a transmission, and noise
gets into the motion; but it is linear in the linear parameters however far off they are, and costs a tenth. So it says where
to start: which of many values of a candidate promise most, and from which values a fit begins.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..model import Model, Term
from ..record import Array
from .least_squares import Bounds, fitted_values
from .track import Track

__all__ = ["REST", "Along"]

REST = 0.01
"""Physical: share of the fast speed of the axis below which it may rest."""
_ITERATIONS = 5
_STRIDE = 0.4  # times 1/w


class Along:
    """A track's motion, once for all models that are held against it.

    Args:
        track: the recordings.

    Attributes:
        stride: rows of the observer's signals that are told from each other.
        moving: rows of the observer's signals in which the axis moves, shape ``(n,)``.
    """

    def __init__(self, track: Track) -> None:
        self._track = track
        slowest = min((run.sample_time for run in track.runs), default=1.0)
        self.stride = max(int(_STRIDE / (track.bandwidth * slowest)), 1)
        speed = np.abs(np.concatenate([each.velocity for each in track.motion]))
        rest = max(REST * float(np.quantile(speed, 0.98)), 4.0 * max(track.noise) * track.bandwidth)
        self.moving = track.joined([(np.abs(each.velocity) > rest).astype(np.float64) for each in track.motion]) > 0.5

    @property
    def bandwidth(self) -> float:
        """Of the observer [rad/s]."""
        return self._track.bandwidth

    def seen(self, name: str) -> Array:
        """The signal ``name`` of the measured motion, as late as the observer sees a force, where the axis moves."""
        signals = [np.asarray(getattr(each, name)) for each in self._track.motion]
        begins = self._track.joined([np.full_like(signal, signal[0]) for signal in signals])
        return (self._track.seen([signal - signal[0] for signal in signals]) + begins)[self.moving]

    def can(self, model: Model) -> bool:
        """True for models whose force the motion at the sensor tells."""
        at_sensor = not model.has_transmission and not model.plant.led
        return at_sensor and bool(np.any(self.moving))

    def residual(self, model: Model, extra: Term | None = None) -> Array:
        """The force that ``model``, with the term ``extra``, lacks [F], as the observer would see it, where the axis moves."""
        return self._track.needed(model, extra)[self.moving]

    def fitted(self, model: Model, names: Sequence[str], scale: Array, bounds: Bounds) -> Model:
        """``model`` with the parameters ``names``, of the sizes ``scale``, such that it lacks least along the motion."""
        return fitted_values(
            lambda trial: self.residual(trial)[:: self.stride],  # of a low-passed force, as many as tell something
            model,
            names,
            scale,
            bounds,
            difference=1e-3,
            point_tolerance=1e-3,
            cost_tolerance=1e-3,
            max_iterations=_ITERATIONS,
            secant=True,
        )[0]

    def changes(self, model: Model, names: Sequence[str], scale: Array) -> Array:
        """Derivative of :meth:`residual` by the parameters ``names``, per ``scale`` of each, shape ``(n, n_names)``."""
        base = self.residual(model)
        columns = []
        for name, size in zip(names, scale, strict=True):
            values = model.values
            values[model.names.index(name)] += 1e-3 * size
            columns.append((self.residual(model.with_values(values)) - base) / 1e-3)
        return np.stack(columns, axis=1) if columns else np.zeros((base.shape[0], 0))
