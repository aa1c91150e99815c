"""How large an effect is made that is concealed in a recording: by what it leaves missing there, beside what is missing anyway.

The unit is what stays unexplained where the effect acts. What an effect leaves missing is reckoned as an observer sees it that
follows the recording as a diagnosis does, after the parameters of the nominal model have taken up what they can of it: of
friction that levels off slowly a Coulomb level takes up most, and what is left is all that a diagnosis can find. And where the
axis itself lacks the opposite, that is made up for first: two that cancel each other leave nothing to be found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from ...identification.equations import nominal_conditions
from ...instrument import inspect
from ...record import Array, Record
from ...signals.stamps import evened
from ..candidates import scales_of
from ..fitting import bounds_of, free_names
from ..intake import of_use, without_faults
from ..least_squares import limits_of
from ..result import Diagnosis
from ..start import lateness
from ..track import Track
from .injection import acting, injected

__all__ = ["Measure", "Yardstick"]

_TAKEN_UP = 0.1  # of itself: what leaves less, less than motion and its turns are known to, is taken up
_STEPS = 4  # numerical: towards the size
_NEAR = 0.2  # numerical, of what is to be left missing: a size that comes no nearer in so many steps isn't one
_LITTLE = 0.01  # of the force of friction: an added force so small that it changes nothing but in proportion


@dataclass(frozen=True)
class Measure:
    """How large an effect is made.

    Attributes:
        size: root mean square of the added force [F]; infinite where the parameters of the nominal model take it up, or no size
            leaves as much missing.
        opposite: part of it that makes up for the opposite that the axis itself lacks [F].
        rest: root mean square of what stays unexplained where the effect acts [F].
    """

    size: float
    opposite: float
    rest: float


class Yardstick:
    """Says how large effects have to be in recordings that have been diagnosed as they are.

    Args:
        records: of one axis.
        bare: their diagnosis; what its model leaves is what stays unexplained.

    Attributes:
        records: as they are diagnosed, without what can't be used.
        most: root mean square of their effort [F]; an effect that would have to be larger isn't concealed.
    """

    def __init__(self, records: Sequence[Record], bare: Diagnosis) -> None:
        usable, _ = of_use(records)
        whole, _, _ = without_faults(usable, [], bare.given, inspect(usable, bare.given))
        conditions = nominal_conditions(whole) | dict(bare.given.nominal)
        self.records = [evened(replace(record, nominal=conditions)) for record in whole]
        self._nominal = bare.refit
        late = lateness(self.records, bare.refit)
        self._late, self._bandwidth = late, bare.bandwidth
        track = self._track(self.records)
        names, bounds = free_names(bare.refit), bounds_of(bare.refit, scales_of(track))
        fit = track.fit(bare.refit, names, 1, bounds)
        size = np.maximum(np.linalg.norm(fit.jacobian, axis=0), 1e-300)
        self._columns = fit.jacobian / size
        # A parameter at its bound takes up what moves it inwards.
        point = np.array([fit.model.value(name) for name in names]) / fit.scale
        lower, upper = limits_of(fit.model, names, fit.scale, bounds)
        self._free = np.where(point > lower, -np.inf, 0.0), np.where(point < upper, np.inf, np.nextafter(0.0, 1.0))
        self._lacking = fit.residual
        self._stays = track.residual(bare.model)
        self.most = float(np.sqrt(np.mean(np.concatenate([each.effort for each in self.records]) ** 2)))
        self._little = _LITTLE * scales_of(track).level

    def _track(self, records: Sequence[Record]) -> Track:
        track = Track.of(records, self._bandwidth, self._nominal, self._late)
        return replace(track, mass=self._nominal.total_inertia)

    def measure(self, effect: str, times: float) -> Measure:
        """How large ``effect`` has to be to leave ``times`` as much missing as stays unexplained where it acts."""
        size = self._little
        missing = self._missing(effect, size)
        if not np.any(missing):
            return Measure(np.inf, 0.0, 0.0)
        acts = acting(missing)
        rest = float(np.sqrt(np.mean(self._stays[acts] ** 2)))
        opposite = max(-float(self._lacking @ missing) / float(missing @ missing) * size, 0.0)
        for _ in range(_STEPS):
            # What changes the effort itself isn't in proportion to its size.
            leaves = float(np.sqrt(np.mean(missing[acts] ** 2)))
            size *= times * rest / max(leaves, 1e-300)
            if not size + opposite < self.most:
                return Measure(np.inf, opposite, rest)
            missing = self._missing(effect, size)
        leaves = float(np.sqrt(np.mean(missing[acts] ** 2)))
        # Gear friction that makes up most of the force is a gain, which the nominal model takes up again.
        near = abs(leaves - times * rest) <= _NEAR * times * rest
        return Measure(size + opposite if near else np.inf, opposite, rest)

    def _missing(self, effect: str, size: float) -> Array:
        """What ``effect`` of that ``size`` leaves missing [F], shape ``(n,)``; nothing where the model takes up all of it."""
        changed = injected(self.records, effect, size)
        added = self._track(changed).residual(self._nominal) - self._lacking
        left = added + self._columns @ lsq_linear(self._columns, -added, self._free).x
        return left if np.linalg.norm(left) > _TAKEN_UP * np.linalg.norm(added) else np.zeros_like(left)
