"""How sure each effect is there, whatever else stays unexplained: found alone in halves of the recordings, beside its rivals.

The grown model is fitted with a term and without it, everything else fitted anew. From there both are fitted to one half of the
recordings, at first order, and judged on the other half; and the other way round. What is there takes its part off either half.
So the smaller of the two differences counts, as the logarithm of a likelihood ratio. What stays unexplained wanders: both
residuals pass the filter that makes white what the model with the term leaves, so that a wander counts as one value and not as
many. How probable the effect is beside the rivals that were fitted in full is reckoned by
Bayes' rule.

What belongs to no law may be mended by the same wrong law in either half. So a law has to be asked for, too, where flexible
functions of all other components of the machine are there (:mod:`.additive.asked`): what these explain as well is no evidence
for it. How sure all this makes an effect, and what else speaks for it, was learnt from examinations (:mod:`.calibration`):
physics outside the vocabulary imitates some laws with much evidence, and likelihoods alone would be too sure.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from ..model import Model
from ..record import Array
from .additive.asked import Asked
from .additive.residual import independent_values
from .calibration import Evidence, calibration
from .confidence import margin_of
from .fitting import refit
from .least_squares import Fit
from .screen import restraint
from .settle import Step
from .track import Track

__all__ = ["Half", "Presence", "presences"]

_A_LITTLE = 0.1  # of a residual of the half that is judged on: it says what the other one tells hardly at all
_ITERATIONS = 6
_ORDER = 12  # numerical: values before, a dozen time constants of the observer
_UNSURE = 1e-4  # numerical, of a residual's energy: keeps the equations of the filter regular
_INFLATION = 2.0  # numerical: of what both halves leave, the most that one leaves in the other


@dataclass(frozen=True)
class Half:
    """What one half of the recordings says of an effect by itself.

    Attributes:
        nats: logarithm of the likelihood ratio on the other half, with the effect over without it.
        parameters: of the effect, by name, as this half alone tells them [SI].
    """

    nats: float
    parameters: Mapping[str, float]


@dataclass(frozen=True)
class Presence:
    """How sure an effect is there.

    Attributes:
        probability: that it is, and not one of its rivals.
        halves: each by itself.
        evidence: that the probability follows from.
    """

    probability: float
    halves: tuple[Half, Half]
    evidence: Evidence


def presences(
    track: Track, end: Model, steps: Sequence[Step], shares: Mapping[str, float], unexplained: float, complete: bool = False
) -> dict[str, Presence]:
    """How sure each term of the grown model ``end`` is there, by the name of the term.

    Args:
        track: the recordings learnt from.
        end: the grown model, fitted.
        steps: by which its terms came.
        shares: of what is missing that each of them explains, by the name of the term.
        unexplained: share of what is missing that it leaves, 0 to 1.
        complete: True where that is no more than an explanation leaves.
    """
    if not steps:
        return {}
    state = refit(track, end, _ITERATIONS)
    n = state.fit.residual.shape[0]
    independent = independent_values(track, state.fit.residual)
    first = (np.arange(n) * 4 // n) % 2 == 0
    white = _whitening(track, state.fit.residual)
    with_all = [_on_other(track, state.fit, rows, white) for rows in (first, ~first)]
    found: dict[str, Presence] = {}
    asked = Asked(track, state)
    places = list(end.prefixes)
    for step in steps:
        place = places.index(step.term)
        without = asked.without(place)
        halves = []
        for rows, (values, lacks) in zip((first, ~first), with_all, strict=True):
            ratio = max(_on_other(track, without, rows, white)[1], 1e-300) / max(lacks, 1e-300)
            nats = float(np.sum(~rows)) / white.stride * (0.5 * math.log(ratio) - asked.indifferent(place))
            halves.append(Half(nats, {name: value for name, value in values.items() if name.startswith(f"{step.term}.")}))
        least = min(each.nats for each in halves)
        functions = asked.nats(place)
        rivals = _among_rivals(step, independent)
        evidence = Evidence(shares[step.term], unexplained, least, functions, rivals, margin_of(step), complete)
        sure = calibration().probability(step.term.split("#")[0], evidence)
        found[step.term] = Presence(round(sure, 4), (halves[0], halves[1]), evidence)
    return found


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
    return values, min(left, _INFLATION * white.energy(fit.residual, ~rows))


def _among_rivals(step: Step, independent: float) -> float:
    """Probability of the effect of ``step`` among itself and what was fitted in its place."""
    own = step.term.split("#")[0]
    best: dict[str, float] = {}
    for rival in step.rivals:
        if own not in {name.split("#")[0] for name in rival.names}:
            best[rival.effect.id] = min(rival.left, best.get(rival.effect.id, math.inf))
    odds = [-0.5 * independent * math.log(max(left, 1e-300) / max(step.after, 1e-300)) for left in best.values()]
    return 1.0 / (1.0 + sum(math.exp(min(each, 50.0)) for each in odds))
