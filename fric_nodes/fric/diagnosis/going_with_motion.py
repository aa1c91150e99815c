"""How much of what is missing goes with the motion, and isn't noise of the force that is stronger at low frequencies.

The twins of a recording (:mod:`.twin`) have white noise, as strong as that from sample to sample. The force of many drives has
more of it at low frequencies, where the motion hides it. Physics that is left out belongs to the motion, and such noise does
not: moved in time, it would go with the motion as well as before. So flexible functions of all components of the machine
(:mod:`.additive`) explain what goes with the motion, and what they explain by chance is told by what they explain of the same
missing force moved in time.

Source: circular shifts keep the autocorrelation of a noise; as a test of dependence see Harris 2020, arXiv:2012.06862.
"""

from __future__ import annotations

import numpy as np

from ..model import Model
from ..record import Array
from .additive.evidence import Grouped
from .additive.residual import functions_of
from .fitting import State, refit
from .growth import FAINTLY, NAMELESS
from .track import Track

__all__ = ["going_with_motion", "only_noise"]

_SHIFTS = 9
_NEAREST = 20  # parts of the recording: of a shift by less than one of them the motion could still be the same


def going_with_motion(track: Track, state: State) -> float:
    """What a fitted model lacks beyond noise from sample to sample and goes with the motion [F^2], a sum of squares."""
    fit = state.fit
    groups, rows, _ = functions_of(track, fit.model)
    grouped = Grouped(fit.residual[rows], fit.jacobian[rows], groups)

    def linked(lacking: Array) -> float:
        n = lacking.shape[0]
        shifts = np.random.default_rng(1).integers(n // _NEAREST, n - n // _NEAREST, _SHIFTS)
        by_chance = float(np.mean([grouped.of(np.roll(lacking, shift)).explained_by_all() for shift in shifts.tolist()]))
        # What doesn't go with the motion is explained by chance to the same share.
        share = (grouped.of(lacking).explained_by_all() - by_chance) / max(1.0 - by_chance, 1e-300)
        return float(max(share, 0.0) * (lacking @ lacking) * fit.residual.shape[0] / n)

    # Noise from sample to sample may go with the motion, too, as where nothing moves at rest.
    return linked(fit.residual[rows]) - float(np.mean([linked(each[rows]) for each in state.chance]))


def only_noise(track: Track, model: Model) -> bool:
    """Whether little is missing in ``model``, and of that too little goes with the motion to be physics without a name."""
    state = refit(track, model, max_iterations=4)
    return state.excess < FAINTLY * state.floor and going_with_motion(track, state) < NAMELESS * state.floor
