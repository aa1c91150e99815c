"""Adding a term never makes a fit worse: the fit without it is one of the starts of the fit with it.

A structure with a term T more holds the one without it, at values of T at which it does nothing
(:attr:`fric.effect.Effect.neutral`). So the least sum of squares of the larger one is no larger. A search that ends
higher has gone into the wrong valley of a parameter that the force isn't linear in: a velocity, a time, a width. Each
such term is held at nothing while the rest is fitted, its own values are then let go from there, and the best end is taken.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from ..model import Model
from .free_parameters import FreeParameters

__all__ = ["Searched", "best_with_nested", "searched_terms"]

Found = TypeVar("Found")
_BETTER = 1e-9  # relative decrease of a sum of squares that is more than rounding


@dataclass(frozen=True)
class Searched:
    """A term that may be fitted into a wrong valley, and that can be held at nothing.

    Attributes:
        prefix: its name in the model.
        names: of its free parameters.
        nothing: value of each parameter that makes it do nothing, by name.
    """

    prefix: str
    names: frozenset[str]
    nothing: dict[str, float]

    def away(self, model: Model) -> Model:
        """``model`` with the term doing nothing."""
        values = model.values
        for number, name in enumerate(model.names):
            values[number] = self.nothing.get(name, values[number])
        return model.with_values(values)


def searched_terms(model: Model, free: FreeParameters) -> list[Searched]:
    """The terms of ``model`` with a free parameter that has to be searched for, and with values at which they do nothing."""
    return list(_searched(model, free))


def _searched(model: Model, free: FreeParameters) -> Iterator[Searched]:
    to_find = {name for name, linear in zip(free.names, free.linear, strict=True) if not linear}
    for prefix, held in zip(model.prefixes, model.terms, strict=True):
        own = frozenset(name for name in free.names if name.startswith(f"{prefix}."))
        if held.effect.neutral is None or not own & to_find:
            continue
        nothing = {f"{prefix}.{p.name}": 0.0 for p in held.effect.parameters if p.linear and not p.shape}
        nothing |= {f"{prefix}.{name}": value for name, value in held.effect.absent.items()}
        # One that is held at a value is meant to act.
        if all(name in own or model.value(name) == value for name, value in nothing.items()):
            yield Searched(prefix, own, nothing)


def best_with_nested(
    model: Model,
    free: FreeParameters,
    fit: Callable[[Model, FreeParameters], Found],
    end: Callable[[Found], tuple[Model, float]],
) -> tuple[Found, frozenset[str]]:
    """The best fit of ``model``, and the parameters of terms that are left at nothing in it.

    Args:
        model: its values are the start.
        free: the parameters that are fitted.
        fit: from a start, with some parameters free.
        end: the model at the end of a fit, and its sum of squares.
    """
    known: dict[frozenset[str], tuple[Found, frozenset[str]]] = {}

    def best(held: frozenset[str]) -> tuple[Found, frozenset[str]]:
        if held in known:
            return known[held]
        now = free.without(set(held)) if held else free
        start = model
        for each in terms:
            if each.names <= held:
                start = each.away(start)
        found, without = fit(start, now), held
        for each in terms:
            if each.names & held:
                continue
            below, left = best(held | each.names)
            at, cost = end(below)
            if cost >= end(found)[1] * (1.0 - _BETTER):
                continue
            # From where the smaller structure ended, with the term as it was found beside the others, or as it was given.
            found_now = end(found)[0]
            again = fit(_taken(at, found_now, each), now)
            found, without = (again, held) if end(again)[1] <= cost else (below, left)
        known[held] = found, without
        return known[held]

    terms = searched_terms(model, free)
    return best(frozenset())


def _taken(model: Model, other: Model, term: Searched) -> Model:
    """``model`` with the values that ``term`` has in ``other``."""
    values = model.values
    for number, name in enumerate(model.names):
        if name in term.names:
            values[number] = other.values[number]
    return model.with_values(np.asarray(values))
