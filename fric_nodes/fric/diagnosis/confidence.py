"""Whether effects are an explanation: how often findings of their kind were right, by what they leave.

This decides whether something unknown is said and in which order effects stand. How sure each of them is told to be is in
:mod:`.presence`.

Three things tell: how much better the effect explains what is missing than its best rival does, how much of that is left, and
how much of it the effect is: what is a small part may only mend the form of another's law. They enter a logistic function. The
ratio of its first two slopes was found on 60 examined cases (``fric prove --cases 60 --seed 101``), their steepness on 230
findings of another examination (``--cases 300 --seed 7``), the third on 900 findings of examinations in which the laws of the
truth have other forms, too (``--seed 32 --variant form`` and others); no published figure of calibration uses any of these.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from .settle import Step

__all__ = [
    "AS_LIKELY",
    "FAINT",
    "LITTLE_LEFT",
    "MANY",
    "MOST_SURE",
    "UNEXPLAINED",
    "confidence_of",
    "is_doubtful",
    "margin",
    "margin_of",
    "unknown_confidence",
]

AS_LIKELY = 0.5
"""Confidence below which a finding is more likely wrong than right."""

UNEXPLAINED = 0.15
"""Share of what was missing beyond which, where it stays, something unknown remains."""

MANY = 3
"""Effects at once that still leave something are more likely to have stood in for one."""

MOST_SURE = 0.995
"""Confidence at most."""

LITTLE_LEFT = 0.05
"""Share of what was missing: with more left by so many, it is looked at what else it could be."""

_OFFSET, _BY_RIVAL, _BY_REST = 1.2, 1.58, -14.1
_BY_SHARE, _WHOLE = 0.7, 0.2  # of what is missing: what takes more of it doesn't mend another's law
_LEAST = 0.01  # of what is missing: what takes less has come since it takes nearly all that the others leave
_FAINTLY_UNKNOWN = 0.35  # statistical: where hardly more than noise is missing, as unknown_confidence says

FAINT = 1.0
"""Noise floors: with less missing than that, what it is can hardly be told."""


def margin_of(step: Step) -> float:
    """Logarithm of what the best rival leaves over what the effect leaves, the price of parameters included."""
    effect_id = step.term.split("#")[0]
    others = [each.score for each in step.rivals if effect_id not in {name.split("#")[0] for name in each.names}]
    rival = min(others, default=step.before)
    own = step.after + step.price
    return margin(rival - step.floor, own - step.floor, step.floor, step.missing)


def margin(rival: float, own: float, floor: float, missing: float) -> float:
    """Logarithm of what a rival leaves over what an effect leaves, of noise and of little differences less.

    Args:
        rival: what is left with it above the floor [F^2].
        own: what is left with the effect [F^2].
        floor: of noise [F^2].
        missing: above the floor, without either [F^2].
    """
    slack = 0.15 * floor + 0.01 * missing
    return math.log((max(rival, 0.0) + slack) / (max(own, 0.0) + slack))


def confidence_of(rest: float, step: Step, share: float) -> float:
    """Probability that the effect of ``step`` is missing.

    Args:
        rest: share of what is missing that is left unexplained.
        step: by which the effect came.
        share: of what is missing that the effect explains.
    """
    small = min(math.log(max(share, _LEAST) / _WHOLE), 0.0)
    logit = _OFFSET + _BY_RIVAL * margin_of(step) + _BY_REST * rest + _BY_SHARE * small
    return round(min(1.0 / (1.0 + math.exp(-logit)), MOST_SURE), 4)


def is_doubtful(confidences: Sequence[float], rest: float) -> bool:
    """True where no finding is more likely right than wrong, or where many leave something and not all are likely to be right.

    Several effects together come near to anything. What little they leave is put down to a floor that isn't known well only
    where they are sure by themselves.

    Args:
        confidences: of the findings.
        rest: share of what is missing that they leave.
    """
    if len(confidences) >= MANY and rest > LITTLE_LEFT and math.prod(confidences) < AS_LIKELY:
        return True
    return all(each < AS_LIKELY for each in confidences)


def unknown_confidence(rest: float, stands_out: float = math.inf) -> float:
    """Probability that no known effect explains what is left.

    Args:
        rest: share of what is missing that is left unexplained.
        stands_out: what is missing, over the noise floor. Where it is less than that, known effects can't be told from each
            other either: it was one of these in all six of such cases among 700 (seeds 81 to 95).
    """
    if stands_out < FAINT:
        return _FAINTLY_UNKNOWN
    return round(0.88 + 0.05 * min(max(rest, 0.0), 1.0), 4)
