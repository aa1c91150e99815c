"""Terms of the same effect by other laws, with values that follow from those of the law that is there."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import lru_cache

from ..effect import Effect
from ..effects import EFFECTS
from ..model import Term
from ..parameter import Parameter
from .candidates import Scales
from .worth_trying import worth_trying

__all__ = ["laws_beside", "laws_further", "strained", "told"]

_AT_THE_END = 1e-3  # of the range
_FOLLOWED = 5.0  # samples, in which sliding elements come after their level


def laws_beside(held: Term, scales: Scales) -> Iterator[Term]:
    """By other shapes that machines have, and by laws that aren't tried otherwise and ask for nothing that isn't known."""
    given = held.by_name

    def usual(p: Parameter) -> float | None:
        # How fast sliding elements come after the level hardly shows; it has no natural value but by the recording.
        return scales.level / (_FOLLOWED * scales.step) if p.dimension == "F/s" else p.default

    yield from _shaped(held)
    for law in EFFECTS.values():
        if law.id != held.effect.id or law.key == held.effect.key or law.near:
            continue
        if law in worth_trying() and held.effect in worth_trying():
            continue  # both are tried otherwise
        if law.form_of not in ("", held.effect.law):
            continue
        # A shape means something else in every law.
        known = {p.name: given[p.name] for p in law.parameters if p.name in given and not p.shape}
        if all(p.name in known or usual(p) is not None for p in law.parameters):
            term = _taken_over(law, known, usual)
            yield term
            yield from _shaped(term)


def strained(held: Term) -> bool:
    """True where a number that says how the law is bent has run to a bound: it isn't by this law that the force is bent."""
    for p, value in zip(held.effect.parameters, held.values, strict=True):
        bends = p.dimension == "1" and p.default is not None and not p.shape and p.name not in held.effect.amplitudes
        within = _AT_THE_END * (p.upper - p.lower)
        if bends and math.isfinite(within) and min(value - p.lower, p.upper - value) < within:
            return True
    return False


def told(held: Term, scales: Scales) -> bool:
    """Whether a recording of these ``scales`` tells ``held`` from the usual law: its place was visited, its form is no end."""
    for p, value in zip(held.effect.parameters, held.values, strict=True):
        place = held.effect.level is not None and p.dimension == "x" and not p.positive
        if place and not scales.low <= value <= scales.high:
            return False
    return not strained(held)


def _shaped(held: Term) -> Iterator[Term]:
    """``held`` with each other shape that machines have."""
    given = held.by_name
    for p in held.effect.parameters:
        for value in p.also and sorted({p.default or 0.0, *p.also} - {given[p.name]}):
            yield _taken_over(held.effect, given | {p.name: value}, lambda other: other.default)


def laws_further(held: Term, scales: Scales) -> Iterator[Term]:
    """By laws of which its own is the case where some further strength is nothing: with a little of that."""
    given = held.by_name

    def little(p: Parameter) -> float:
        # Bent as the typical force bends the linear spring, it is twice as strong as that.
        if p.dimension == "F/x^3":
            stiffness = next(given[other.name] for other in held.effect.parameters if other.dimension == "F/x")
            return stiffness**3 / scales.level**2
        return p.lower if p.default is None else p.default

    for law in _further(held.effect):
        yield _taken_over(law, given, little)


@lru_cache(maxsize=64)
def _further(effect: Effect) -> tuple[Effect, ...]:
    own = {p.name for p in effect.parameters}
    found = []
    for other in EFFECTS.values():
        more = [p for p in other.parameters if p.name not in own]
        if other.id != effect.id or other.near or not more or own - {p.name for p in other.parameters}:
            continue
        if all(p.lower == 0.0 and not p.positive and not p.shape for p in more):
            found.append(other)
    return tuple(found)


def _taken_over(law: Effect, given: dict[str, float], else_: Callable[[Parameter], float | None]) -> Term:
    """A term by ``law`` with the values ``given``, and what ``else_`` says for the others."""
    values = []
    for p in law.parameters:
        value = given[p.name] if p.name in given else else_(p)
        assert value is not None
        values.append(float(value))
    return Term(law, tuple(values))
