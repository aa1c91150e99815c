"""From what speaks for an effect to the probability that it is there: a map learnt from examinations.

The logarithm of the odds is a weighted sum of a few measures of evidence (:class:`Evidence`) and of one number per effect:
unknown physics looks like some effects more often than like others. No weight is negative, so that more evidence never counts
for less. The weights are in ``calibration.json``, with the examinations that they were learnt from; ``fric prove --calibrate``
makes that file (:mod:`.prove.calibrating`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

__all__ = ["FORMAT", "Calibration", "Evidence", "calibration", "measures_of"]

FORMAT = "fric-calibration/1"
_LEAST = 1e-3  # numerical: of a share, whose logarithm is taken
_FAR = 7.0  # numerical: logarithm of a ratio: a rival that leaves a thousand times more is out, halves 3 % apart agree
_SURE = 12.0  # numerical: logarithm of odds, beyond which nothing is surer


@dataclass(frozen=True)
class Evidence:
    """What speaks for one effect.

    Attributes:
        share: of what is missing that the effect explains, 0 to 1.
        rest: share of what is missing that stays unexplained, 0 to 1.
        halves: how likely each half of the recordings makes it, judged on the other one; the smaller of both [nats].
        functions: evidence for it where flexible functions of all other components are there [nats]; infinite where
            that was not asked.
        rivals: probability of the effect among itself and what was fitted in its place.
        margin: logarithm of what the best of these leaves over what the effect leaves.
        complete: True where the effects named are a full explanation, so that nothing unknown is said beside them.
        agreement: logarithm of the energy of the effect's own force over that of the difference between what both halves tell
            of it; 0 where that was not asked.
    """

    share: float
    rest: float
    halves: float
    functions: float = math.inf
    rivals: float = 1.0
    margin: float = 0.0
    complete: bool = False
    agreement: float = 0.0


def measures_of(evidence: Evidence) -> dict[str, float]:
    """The measures that enter the odds, by name; each counts for the effect, the more the larger it is.

    What stays unexplained counts as that beside which an effect explains: a tenth of it may be any law's, and ten times as much
    is hardly what something unknown looks like. Halves or functions that speak against an effect count against it.
    """
    share, rest = (min(max(each, _LEAST), 1.0) for each in (evidence.share, evidence.rest))
    return {
        "share": math.log(share),
        "beside rest": math.log(share / rest),
        "halves": _signed(evidence.halves),
        "functions": _signed(evidence.functions),
        "rivals": math.log(min(max(evidence.rivals, _LEAST), 1.0)),
        "margin": min(max(evidence.margin, 0.0), _FAR),
        "complete": float(evidence.complete),
        "agreement": min(max(evidence.agreement, -_FAR), _FAR),
    }


def _signed(nats: float) -> float:
    """The order of magnitude of evidence, with its sign."""
    return math.copysign(min(math.log1p(abs(nats)), _SURE), nats)


@dataclass(frozen=True)
class Calibration:
    """The weights.

    Attributes:
        offset: logarithm of the odds without evidence.
        weights: of each measure.
        effects: what is added for an effect; 0 for one that isn't there.
    """

    offset: float
    weights: Mapping[str, float]
    effects: Mapping[str, float]

    def probability(self, effect: str, evidence: Evidence) -> float:
        """That the effect with the id ``effect`` is there and none of its rivals, 0 to 1."""
        odds = self.offset + self.effects.get(effect, 0.0)
        odds += sum(self.weights[name] * value for name, value in measures_of(evidence).items())
        return 1.0 / (1.0 + math.exp(-min(max(odds, -_SURE), _SURE)))


@lru_cache(maxsize=1)
def calibration() -> Calibration:
    """The map that this version was published with."""
    content = json.loads(Path(__file__).with_name("calibration.json").read_text(encoding="utf-8"))
    return Calibration(content["offset"], content["weights"], content["effects"])
