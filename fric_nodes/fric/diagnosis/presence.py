"""How sure each effect is there, whatever else stays unexplained: found alone in halves of the recordings, beside its rivals.

The grown model is fitted with a term and without it, everything else fitted anew. From there both are fitted to one half of the
recordings, at first order, and judged on the other half; and the other way round. What is there takes its part off either half.
So the smaller of the two differences counts, as the logarithm of a likelihood ratio of so many values as what stays unexplained
leaves independent. A rival fitted in full shares the probability by Bayes' rule.

What belongs to no law may be mended by the same wrong law in either half. So a law has to be asked for, too, where flexible
functions of all other components of the machine are there (:mod:`.additive.asked`): what these explain as well is no evidence
for it. How sure all this makes an effect was learnt from examinations (:mod:`.calibration`): physics outside the vocabulary
imitates some laws with much evidence, and likelihoods alone would be too sure.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..model import Model
from .additive.asked import Asked
from .additive.residual import independent_values
from .calibration import Evidence, calibration
from .fitting import refit
from .least_squares import Fit
from .screen import restraint
from .settle import Step
from .track import Track

__all__ = ["Half", "Presence", "presences"]

_A_LITTLE = 0.1  # of a residual of the half that is judged on: it says what the other one tells hardly at all
_ITERATIONS = 6
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
    track: Track, end: Model, steps: Sequence[Step], shares: Mapping[str, float], unexplained: float
) -> dict[str, Presence]:
    """How sure each term of the grown model ``end`` is there, by the name of the term.

    Args:
        track: the recordings learnt from.
        end: the grown model, fitted.
        steps: by which its terms came.
        shares: of what is missing that each of them explains, by the name of the term.
        unexplained: share of what is missing that it leaves, 0 to 1.
    """
    if not steps:
        return {}
    left = track.residual(end)
    n = left.shape[0]
    independent = independent_values(track, left)
    first = (np.arange(n) * 4 // n) % 2 == 0
    state = refit(track, end, _ITERATIONS)
    with_all = [_on_other(track, state.fit, rows) for rows in (first, ~first)]
    found: dict[str, Presence] = {}
    asked = Asked(track, state)
    places = list(end.prefixes)
    for step in steps:
        place = places.index(step.term)
        without = asked.without(place)
        halves = []
        for rows, (values, lacks) in zip((first, ~first), with_all, strict=True):
            nats = 0.25 * independent * math.log(max(_on_other(track, without, rows)[1], 1e-300) / max(lacks, 1e-300))
            halves.append(Half(nats, {name: value for name, value in values.items() if name.startswith(f"{step.term}.")}))
        least = min(each.nats for each in halves)
        functions = asked.nats(place)
        evidence = Evidence(shares[step.term], unexplained, least, functions, _among_rivals(step, independent))
        sure = calibration().probability(step.term.split("#")[0], evidence)
        found[step.term] = Presence(round(sure, 4), (halves[0], halves[1]), evidence)
    return found


def _on_other(track: Track, fit: Fit, rows: NDArray[np.bool_]) -> tuple[dict[str, float], float]:
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
    left = (fit.residual + jacobian @ change)[~rows]
    # Where first order leads far away, fits to both halves are the better guess.
    return values, min(float(left @ left), _INFLATION * float(fit.residual[~rows] @ fit.residual[~rows]))


def _among_rivals(step: Step, independent: float) -> float:
    """Probability of the effect of ``step`` among itself and what was fitted in its place."""
    own = step.term.split("#")[0]
    best: dict[str, float] = {}
    for rival in step.rivals:
        if own not in {name.split("#")[0] for name in rival.names}:
            best[rival.effect.id] = min(rival.left, best.get(rival.effect.id, math.inf))
    odds = [-0.5 * independent * math.log(max(left, 1e-300) / max(step.after, 1e-300)) for left in best.values()]
    return 1.0 / (1.0 + sum(math.exp(min(each, 50.0)) for each in odds))
