"""How sure each effect is there, whatever else stays unexplained: found alone in halves of the recordings, beside its rivals.

What is there takes its part off either half of the recordings (:mod:`.halves`): the smaller of the two counts. How probable the
effect is beside the rivals that were fitted in full is reckoned by Bayes' rule.

What belongs to no law may be mended by the same wrong law in either half. So a law has to be asked for, too, where flexible
functions of all other components of the machine are there (:mod:`.additive.asked`): what these explain as well is no evidence
for it. How sure all this makes an effect, and what else speaks for it, was learnt from examinations (:mod:`.calibration`):
physics outside the vocabulary imitates some laws with much evidence, and likelihoods alone would be too sure.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..model import Model
from .additive.residual import independent_values
from .calibration import Evidence, calibration
from .confidence import margin_of
from .fitting import refit
from .halves import Half, Halves
from .settle import Step
from .track import Track

__all__ = ["Presence", "presences"]


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
    state = refit(track, end)
    independent = independent_values(track, state.fit.residual)
    judged = Halves(track, state)
    found: dict[str, Presence] = {}
    places = list(end.prefixes)
    for step in steps:
        place = places.index(step.term)
        halves = judged.of(place)
        least = min(each.nats for each in halves)
        functions = judged.asked.nats(place)
        rivals = _among_rivals(step, independent)
        agreement = judged.agreement(place)
        evidence = Evidence(shares[step.term], unexplained, least, functions, rivals, margin_of(step), complete, agreement)
        sure = calibration().probability(step.term.split("#")[0], evidence)
        found[step.term] = Presence(round(sure, 4), halves, evidence)
    return found


def _among_rivals(step: Step, independent: float) -> float:
    """Probability of the effect of ``step`` among itself and what was fitted in its place."""
    own = step.term.split("#")[0]
    best: dict[str, float] = {}
    for rival in step.rivals:
        if own not in {name.split("#")[0] for name in rival.names}:
            best[rival.effect.id] = min(rival.left, best.get(rival.effect.id, math.inf))
    odds = [-0.5 * independent * math.log(max(left, 1e-300) / max(step.after, 1e-300)) for left in best.values()]
    return 1.0 / (1.0 + sum(math.exp(min(each, 50.0)) for each in odds))
