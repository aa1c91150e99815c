"""Terms of the same effect by other laws, with values that follow from those of the law that is there.

A law that is a form of that one may ask for values of which that one says nothing: up to which speed friction differs between
the directions, where it differs at low speed. Those are tried as the recording suggests them, and the ones that promise most at
first order are where its fit begins.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from ..effect import Effect
from ..effects import EFFECTS
from ..model import Term
from ..parameter import Parameter
from ..record import Array
from ..threads import mapped
from .candidates import Scales, scales_of, values_to_try
from .fitting import with_amplitudes
from .least_squares import Fit
from .screen import OWN
from .track import Track
from .worth_trying import worth_trying

__all__ = ["laws_beside", "laws_further", "laws_in_place", "strained", "told"]

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
        if law in worth_trying() and held.effect in worth_trying() and law.form_of != held.effect.law:
            continue  # both are tried otherwise
        if law.form_of not in ("", held.effect.law):
            continue
        # A shape means something else in every law.
        known = {p.name: given[p.name] for p in law.parameters if p.name in given and not p.shape}
        if all(p.name in known or usual(p) is not None for p in law.parameters):
            term = _taken_over(law, known, usual)
            yield term
            yield from _shaped(term)


def laws_in_place(track: Track, fit: Fit, place: int) -> list[Term]:
    """What may stand in the place of a term: :func:`laws_beside`, :func:`laws_further`, and forms with values the law lacks.

    Args:
        track: the recordings.
        fit: of the model.
        place: number of the term in the model.
    """
    held, scales = fit.model.terms[place], scales_of(track)
    found = list(laws_beside(held, scales))
    for further in laws_further(held, scales):
        if further.effect not in [each.effect for each in found]:
            found.append(_least_bent(track, fit, place, further))
    for law in EFFECTS.values():
        if law.id == held.effect.id and law.form_of == held.effect.law and law.form_of:
            term = _begun(track, fit, place, list(_suggested(law, held, scales)))
            found += [] if term is None else [term]
    return found


def _least_bent(track: Track, fit: Fit, place: int, term: Term) -> Term:
    """``term``, or the same with less of what bends it, by powers of ten, whichever leaves least before it is fitted.

    A fit that begins with a spring that is bent too much ends with another spring.
    """
    held = fit.model.terms[place].by_name
    terms = [
        replace(
            term,
            values=tuple(
                v if p.name in held else v * 0.1**power for p, v in zip(term.effect.parameters, term.values, strict=True)
            ),
        )
        for power in range(4)
    ]

    def left(tried: Term) -> float:
        model = fit.model.with_terms(tried if k == place else each for k, each in enumerate(fit.model.terms))
        return float(np.linalg.norm(track.residual(model)))

    return terms[int(np.argmin(mapped(left, terms)))]


def _suggested(law: Effect, held: Term, scales: Scales) -> Iterator[Term]:
    """Terms by ``law`` with a little of the one strength that ``held`` lacks, at each of the values that a recording suggests.

    None where ``held`` says everything that isn't usual anyway.
    """
    given = held.by_name
    if len(_lacking(law, held)) == 1 and any(p.name not in given and p.default is None for p in law.parameters):
        grids = [(given[p.name],) if p.name in given else values_to_try(law, p, scales) for p in law.parameters]
        for values in itertools.product(*grids):
            yield Term(law, tuple(float(value) for value in values))


def _lacking(law: Effect, held: Term) -> list[str]:
    """The strengths that ``law`` has beyond those of ``held``."""
    return [name for name in law.amplitudes if name not in held.by_name]


def _begun(track: Track, fit: Fit, place: int, terms: Sequence[Term]) -> Term | None:
    """The one of ``terms`` in the place of that of ``fit`` that promises most, as strong as it is at first order, if any."""
    held = fit.model.terms[place]

    def changed(term: Term) -> Array:
        (name,) = _lacking(term.effect, held)
        model = fit.model.with_terms(term if k == place else each for k, each in enumerate(fit.model.terms))
        return np.asarray((track.residual(model) - fit.residual) / term.by_name[name])

    basis, _ = np.linalg.qr(fit.jacobian / np.maximum(np.linalg.norm(fit.jacobian, axis=0), 1e-300))
    best, most = None, 0.0
    for term, column in zip(terms, mapped(changed, terms), strict=True):
        own = column - basis @ (basis.T @ column)
        size, along = float(own @ own), float(own @ fit.residual)
        if size <= OWN**2 * float(column @ column):
            continue  # the other parameters do the same
        if along**2 > most * size:
            best, most = with_amplitudes(term, _lacking(term.effect, held), [-along / size]), along**2 / size
    return best


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
