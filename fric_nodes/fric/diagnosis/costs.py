"""What a parameter costs, wherever models of different size are compared, and what a form of a law costs beyond that law."""

from __future__ import annotations

from ..effect import Effect
from ..effects import EFFECTS

__all__ = ["NATS_PER_PARAMETER", "PER_PARAMETER", "further_parameters", "n_free"]

PER_PARAMETER = 0.012
"""Statistical, of what is missing above the floor: the price of a parameter."""
NATS_PER_PARAMETER = 4.0
"""Statistical, nats: half the logarithm of some thousand independent values (Schwarz's criterion)."""


def n_free(effect: Effect) -> int:
    """Number of parameters of ``effect`` that a fit moves."""
    return sum(not p.shape for p in effect.parameters)


def further_parameters(effect: Effect) -> int:
    """By how many parameters that a fit moves a form of a law has more than that law; 0 for what is no form of another."""
    if not effect.form_of:
        return 0
    law = next(each for each in EFFECTS.values() if each.id == effect.id and each.law == effect.form_of)
    return max(n_free(effect) - n_free(law), 0)
