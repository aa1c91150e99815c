"""A term of a model exchanged for another."""

from __future__ import annotations

from ..model import Model, Term

__all__ = ["exchanged_at"]


def exchanged_at(model: Model, place: int, term: Term) -> tuple[Model, int]:
    """``model`` with ``term`` for its term number ``place``, and the number that it has: terms are kept in an order."""
    other = model.with_terms(term if k == place else held for k, held in enumerate(model.terms))
    return other, next(k for k, held in enumerate(other.terms) if held is term)
