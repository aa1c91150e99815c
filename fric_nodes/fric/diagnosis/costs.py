"""What a parameter costs, wherever models of different size are compared, and what a form of a law costs beyond that law."""

from __future__ import annotations

from ..effect import Effect
from ..effects import by_name

__all__ = ["EVIDENCE", "NATS_PER_PARAMETER", "PER_PARAMETER", "further_parameters", "law_of_form", "n_free"]

EVIDENCE = 10.0
"""Statistical [nats]: what a term must gain on unseen blocks to be more than chance among some hundred trials."""
PER_PARAMETER = 0.012
"""Statistical, of what is missing above the floor: the price of a parameter."""
NATS_PER_PARAMETER = 4.0
"""Statistical, nats: half the logarithm of some thousand independent values (Schwarz's criterion)."""


def n_free(effect: Effect) -> int:
    """Number of parameters of ``effect`` that a fit moves."""
    return sum(not p.shape for p in effect.parameters)


def further_parameters(effect: Effect) -> int:
    """By how many parameters that a fit moves a form of a law has more than that law; 0 for what is no form of another."""
    law = law_of_form(effect)
    return 0 if law is None else max(n_free(effect) - n_free(law), 0)


def law_of_form(effect: Effect) -> Effect | None:
    """The law of which ``effect`` is a form; None for what is no form of another, or of one that asks for other values."""
    law = by_name(effect.id, effect.form_of) if effect.form_of else None
    known = {p.name for p in effect.parameters}
    return law if law is not None and all(p.name in known for p in law.parameters) else None
