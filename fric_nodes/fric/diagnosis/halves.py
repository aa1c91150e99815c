"""What each half of the recordings says of a term of the grown model, judged on the other half.

The grown model is fitted with the term and without it, everything else fitted anew. From there both are fitted to one half of
the recordings, at first order, and judged on the other half; and the other way round (two-fold cross-validation). What is there
takes its part off either half. What stays unexplained wanders: both residuals pass the filter that makes white what the model
with the term leaves, so that a wander counts as one value and not as many. The result is a logarithm of a likelihood ratio.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from ..record import Array
from .additive.asked import Asked
from .fitting import State
from .least_squares import INFLATION, Fit
from .screen import restraint
from .track import Track

__all__ = ["Half", "Halves"]

_A_LITTLE = 0.1  # of a residual of the half that is judged on: it says what the other one tells hardly at all
_ORDER = 12  # numerical: values before, a dozen time constants of the observer
_UNSURE = 1e-4  # numerical, of a residual's energy: keeps the equations of the filter regular


@dataclass(frozen=True)
class Half:
    """What one half of the recordings says of an effect by itself.

    Attributes:
        nats: logarithm of the likelihood ratio on the other half, with the effect over without it.
        parameters: of the effect, by name, as this half alone tells them [SI].
    """

    nats: float
    parameters: Mapping[str, float]


class Halves:
    """Both halves of the recordings, and what they say of the terms of one model.

    Args:
        track: the recordings.
        state: the fitted model.
    """

    def __init__(self, track: Track, state: State) -> None:
        self._track, self.state = track, state
        self.asked = Asked(track, state)
        n = state.fit.residual.shape[0]
        first = (np.arange(n) * 4 // n) % 2 == 0
        self._white = _whitening(track, state.fit.residual)
        self._with_all = [(rows, *_on_other(track, state.fit, rows, self._white)) for rows in (first, ~first)]

    def of(self, place: int) -> tuple[Half, Half]:
        """What each half says of the term number ``place`` of the model."""
        without, name = self.asked.without(place), self.state.fit.model.prefixes[place]
        found = []
        for rows, values, lacks in self._with_all:
            ratio = max(_on_other(self._track, without, rows, self._white)[1], 1e-300) / max(lacks, 1e-300)
            nats = float(np.sum(~rows)) / self._white.stride * (0.5 * math.log(ratio) - self.asked.indifferent(place))
            found.append(Half(nats, {key: value for key, value in values.items() if key.startswith(f"{name}.")}))
        return found[0], found[1]

    def agreement(self, place: int) -> float:
        """How well both halves agree about the term number ``place``: energy of its own force over that of the difference.

        Its own force is what no other parameter of the model brings about. The logarithm of that ratio; 0 where there is no
        such force, or bounds alone make both say the same.
        """
        fit = self.state.fit
        own = self.asked.without(place).residual - fit.residual
        values = [half.parameters for half in self.of(place)]
        of_term = [k for k, name in enumerate(fit.names) if name in values[0]]
        apart = np.array([(values[0][fit.names[k]] - values[1][fit.names[k]]) / fit.scale[k] for k in of_term])
        others = fit.jacobian[:, [k for k in range(len(fit.names)) if k not in of_term]]
        change = fit.jacobian[:, of_term] @ apart
        change -= others @ np.linalg.lstsq(others, change, rcond=None)[0]
        energy, differs = float(own @ own), float(change @ change)
        return math.log(energy / differs) if energy > 0.0 and differs > 0.0 else 0.0

    def least(self, place: int) -> float:
        """The smaller of what both say for the term number ``place`` [nats]."""
        return min(half.nats for half in self.of(place))


@dataclass(frozen=True, eq=False)
class _Whitening:
    """A filter of every ``stride``-th value of a residual; ``taps`` of shape ``(order + 1,)``, the first of them one."""

    stride: int
    taps: Array

    def energy(self, residual: Array, rows: NDArray[np.bool_]) -> float:
        """Sum of squares behind the filter of those of the values of a ``residual`` that are among ``rows`` [F^2]."""
        return float(np.sum(lfilter(self.taps, 1.0, residual[:: self.stride])[rows[:: self.stride]] ** 2))


def _whitening(track: Track, residual: Array) -> _Whitening:
    """The filter that foretells each value of ``residual`` from those before and leaves what is new (Yule-Walker)."""
    stride = max(round(1.0 / (track.bandwidth * min(run.sample_time for run in track.runs))), 1)
    thinned = residual[::stride]
    lags = np.array([float(thinned[k:] @ thinned[: thinned.shape[0] - k]) for k in range(_ORDER + 1)])
    lags[0] = lags[0] * (1.0 + _UNSURE) + 1e-300
    return _Whitening(stride, np.append(1.0, -solve_toeplitz(lags[:-1], lags[1:])))


def _on_other(track: Track, fit: Fit, rows: NDArray[np.bool_], white: _Whitening) -> tuple[dict[str, float], float]:
    """Values of the parameters of ``fit`` from the half ``rows`` alone, and what it lacks in the other one then [F^2].

    At first order from where it is fitted to both halves; what a bound holds stays there.
    """
    used = fit.solution.free
    weights = np.where(rows, 1.0, _A_LITTLE)
    jacobian = fit.jacobian[:, used]
    normal = jacobian.T @ (weights[:, None] ** 2 * jacobian) + restraint(track, fit) * np.eye(jacobian.shape[1])
    change = np.linalg.solve(normal, -jacobian.T @ (weights**2 * fit.residual))
    values = {p.name: p.value for p in fit.model.parameters()}
    for name, moved in zip(np.array(fit.names)[used].tolist(), (change * fit.scale[used]).tolist(), strict=True):
        values[name] += moved
    left = white.energy(fit.residual + jacobian @ change, ~rows)
    # Where first order leads far away, fits to both halves are the better guess.
    return values, min(left, INFLATION * white.energy(fit.residual, ~rows))
