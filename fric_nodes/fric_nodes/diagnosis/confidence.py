"""How sure a finding is: the share of cases in which findings of this kind were right.

Two things tell: how much better the effect explains what is missing than its best rival does, and how much of it is left. Both
enter a logistic function. The ratio of its slopes was found on 60 examined cases (``fric prove --cases 60 --seed 101``), its
steepness on 230 findings of another examination (``--cases 300 --seed 7``), which no published figure of calibration uses.
"""

from __future__ import annotations

import math

from .settle import Step

__all__ = ["AS_LIKELY", "UNEXPLAINED", "confidence_of", "margin_of", "unknown_confidence"]

AS_LIKELY = 0.5
"""Confidence below which a finding is more likely wrong than right."""

UNEXPLAINED = 0.15
"""Share of what was missing beyond which, where it stays, something unknown remains."""

_OFFSET, _BY_RIVAL, _BY_REST = 0.9, 1.58, -14.1
_MOST = 0.995


def margin_of(step: Step) -> float:
    """Logarithm of what the best rival leaves over what the effect leaves, the price of parameters included."""
    slack = 0.15 * step.floor + 0.01 * step.missing
    effect_id = step.term.split("#")[0]
    others = [each.score for each in step.rivals if effect_id not in {name.split("#")[0] for name in each.names}]
    rival = min(others, default=step.before)
    own = step.after + step.price
    return math.log((max(rival - step.floor, 0.0) + slack) / (max(own - step.floor, 0.0) + slack))


def confidence_of(rest: float, step: Step) -> float:
    """Probability that the effect of ``step`` is what is missing, where the share ``rest`` of that is left unexplained."""
    return round(min(1.0 / (1.0 + math.exp(-(_OFFSET + _BY_RIVAL * margin_of(step) + _BY_REST * rest))), _MOST), 4)


def unknown_confidence(rest: float) -> float:
    """Probability that no known effect explains what is left."""
    return round(0.88 + 0.05 * min(max(rest, 0.0), 1.0), 4)
