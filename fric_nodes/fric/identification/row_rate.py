"""How far apart the rows of the equations lie: as close as the filter lets them, unless errors of the position forbid it.

Errors of the position make the acceleration of the rows noisy, which pulls the mass towards zero by the share of that noise in
what the rows tell about it (errors in variables, Fuller 1987). A wider window averages both sides of the equations alike, so
that nothing but noise is lost until the motion itself is averaged away. So the closest rows are taken whose mass is pulled by
less than a quarter of its standard error, with which an interval of 90 % still holds 89 %; where no rows are, those with the
least error in all, whose known bias the fit then removes (:mod:`.noise_bias`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..record import Array, Index
from ..signals.instrument_noise import errors_like
from .rests import MIN_ROWS, SLOW
from .statistics import sandwich_covariance
from .stretch import Stretch

__all__ = ["UNSURE", "decimation_of"]

UNSURE = 0.3
"""Share by which a noise level from a recording may be off; so is what is taken off for it."""

_WIDER = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0)
_PULL = 0.25  # standard errors
_FEWEST = 5 * MIN_ROWS


def decimation_of(
    stretches: Sequence[Stretch], edge: int, closest: int, thin: Callable[[int, int, Stretch, Array], Array]
) -> int:
    """Samples from row to row.

    Args:
        stretches: the recordings at full rate.
        edge: samples dropped at either end of each.
        closest: rows, in samples, that the filter's cutoff asks for.
        thin: makes rows of a signal, from edge, decimation, stretch and signal.
    """
    random = np.random.default_rng(1)
    noisy = [s.along(s.position + errors_like(s.raw_position, s.position, random, s.level)) for s in stretches]
    errors = [b.acceleration - a.acceleration for a, b in zip(stretches, noisy, strict=True)]
    fastest = max(float(np.quantile(np.abs(s.velocity), 0.98)) for s in stretches)
    best, least = closest, np.inf
    for wider in _WIDER:
        every = max(round(wider * closest), 1)
        rows = sum(len(range(edge, s.time.shape[0] - edge, every)) for s in stretches)
        if rows < _FEWEST or any(every > edge for _ in stretches):
            break
        columns, force, noise = [], [], []
        for stretch, error in zip(stretches, errors, strict=True):
            sign = np.sign(stretch.velocity) * (np.abs(stretch.velocity) > SLOW * fastest)
            each = np.column_stack([stretch.acceleration, sign, stretch.velocity, np.ones_like(sign)])
            columns.append(thin(edge, every, stretch, each))
            force.append(thin(edge, every, stretch, stretch.smooth(stretch.force)))
            noise.append(thin(edge, every, stretch, error))
        starts = np.cumsum([0, *(part.shape[0] for part in force[:-1])], dtype=np.int64)
        pull, unsure = _mass_errors(np.concatenate(columns), np.concatenate(force), np.concatenate(noise), starts)
        if UNSURE * pull < _PULL * unsure:
            return every
        error_in_all = (UNSURE * pull) ** 2 + unsure**2
        if error_in_all < least:
            best, least = every, error_in_all
    return best


def _mass_errors(columns: Array, force: Array, noise: Array, starts: Index) -> tuple[float, float]:
    """Share by which noise pulls the mass towards zero, and the relative standard error of the mass."""
    others = columns[:, 1:]
    alone = columns[:, 0] - others @ np.linalg.lstsq(others, columns[:, 0], rcond=1e-10)[0]
    power = float(alone @ alone)
    if power == 0.0:
        return np.inf, np.inf
    mass = float(alone @ force) / power
    left = force - mass * columns[:, 0]
    left = left - others @ np.linalg.lstsq(others, left, rcond=1e-10)[0]
    variance = sandwich_covariance(alone[:, None], left, np.ones(left.shape[0]), starts)[0, 0]
    pull = float(noise @ noise) / power
    return pull, float(np.sqrt(max(variance, 0.0))) / max(abs(mass), 1e-300)
