"""The model that an identification starts from when a user names nothing but effects."""

from __future__ import annotations

from collections.abc import Iterable

from ..effects import by_name
from ..model import Model, Term, build_model, term
from ..record import Units

__all__ = ["start_model"]


def start_model(names: Iterable[str], joint: str, units: Units) -> Model:
    """A rigid axis with the effects ``names`` (``effect`` or ``effect/law``), with values that a fit replaces.

    Raises:
        ModelError: an effect is not known.
    """
    return build_model("rigid", {"mass": 1.0}, [_start_term(name) for name in names], joint=joint, units=units)


def _start_term(name: str) -> Term:
    effect = by_name(*name.split("/", 1))
    if effect is None:
        return term(name)  # which says what can be chosen
    return term(effect.id, effect.law, **{p.name: 0.0 if p.linear else 1.0 for p in effect.parameters if p.default is None})
