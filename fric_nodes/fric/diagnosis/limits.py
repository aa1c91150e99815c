"""How large an effect that was not found would have to be, for these recordings to show it.

An effect of the strength A changes the missing force, at first order, by A c, with c its column on the observer. What the
fitted parameters can do themselves is taken out of c; E is the energy of the rest. The limit is the A at which A^2 E is enough
for three things: :data:`EVIDENCE`, with the log likelihood that rises by (N / 2) ln(1 + A^2 E / L) where N independent values
leave L; what a term has to take off to come at all (:mod:`.price`); and that the effect would be said to be as likely there as
not (:mod:`.expected`), beside what stays unexplained and beside its best rival. At one and a half of the limit most such
effects are found, at half of it hardly any.

Of rivals, what the best of them can't do of c must bring twenty to one. Where it doesn't at the limit, the effect shows, but
perhaps as that other one.

What the model leaves may hold some of an effect that was not found, because nothing singles it out there. The size at which it
would take most of that away is added: so much of it may be there already. A force that would have to be larger than any of the
recordings is no limit: it could not have been there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..effect import Effect
from ..effects import EFFECTS, by_name
from ..model import ModelError, Term
from ..record import Array, Units
from .additive.residual import independent_values
from .costs import EVIDENCE
from .expected import Expected
from .faint import beyond_chance
from .fitting import State
from .moves import TWENTY_TO_ONE
from .price import OF_EXCESS, least_gain
from .screen import OWN, Column, Tried
from .track import Track

__all__ = ["EVIDENCE", "Limit", "limits_of"]


_NEAR = 1.3  # numerical: so near to the limit the change is about proportional to the size
_STEP = 30.0  # numerical: of one step towards the limit
_ROUNDS = 8  # numerical
_BEYOND = "shows only where the command goes beyond it"
_THE_SAME = "the fitted parameters do the same on these motions"
_TOO_LARGE = "would have to be larger than any force of these recordings"


@dataclass(frozen=True)
class Limit:
    """What would have shown of one effect.

    Attributes:
        effect: id of the vocabulary.
        title: in a sentence.
        parameter: that says how strong it is; empty where no size can be stated.
        size: the smallest that would have been found, or, where ``softer``, the largest stiffness [SI].
        softer: True where the effect grows as the parameter falls, as with a stiffness in series or the limit of a drive.
        unit: of the size.
        why: no size can be stated; empty where one is.
        like: id of another effect that does nearly the same on these motions, so that it may be told as that; empty: none.
        term: the effect of that size; None where none can be stated.
    """

    effect: str
    title: str
    parameter: str
    size: float | None
    softer: bool
    unit: str
    why: str
    like: str = ""
    term: Term | None = field(default=None, repr=False)

    def as_json(self) -> dict[str, Any]:
        """As ``report.json`` has it."""
        names = ("effect", "parameter", "size", "softer", "unit", "why", "like")
        return {name: getattr(self, name) for name in names}

    @property
    def sentence(self) -> str:
        """In one phrase."""
        if self.size is None:
            return f"{self.title}: {self.why}"
        like = f", perhaps as {self.like_title}" if self.like else ""
        return f"{self.title} {'below' if self.softer else 'above'} {self.stated}{like}"

    @property
    def like_title(self) -> str:
        """What the effect is called as which it may be told; empty where there is none."""
        other = by_name(self.like) if self.like else None
        return "" if other is None else other.title

    @property
    def stated(self) -> str:
        """The size, with its unit and the parameter that it is one of; empty where no size can be stated."""
        if self.size is None:
            return ""
        size = f"{float(f'{self.size:.2g}'):g}"
        return f"{size} ({self.parameter})" if self.unit == "1" else f"{size} {self.unit} ({self.parameter})"


def limits_of(track: Track, state: State, tried: Sequence[Tried], units: Units, *, anything: bool) -> tuple[Limit, ...]:
    """The limit of every effect that ``state`` has not, by name.

    Args:
        track: the recordings learnt from.
        state: the model that was found, fitted.
        tried: every candidate beside it at first order.
        units: of the model.
        anything: True where something was found.
    """
    n = state.fit.residual.shape[0]
    basis, _ = np.linalg.qr(state.fit.jacobian / np.maximum(np.linalg.norm(state.fit.jacobian, axis=0), 1e-300))
    there = {held.effect.id for held in state.fit.model.terms}
    by_effect = {each.column.term.effect.id: each for each in tried if each.column.parts[0].shape[0] == n}
    rivals = {name: _beside(basis, trial.column) for name, trial in by_effect.items()}
    found = []
    for name, effect in sorted({effect.id: effect for effect in EFFECTS.values()}.items()):
        if name not in there:
            trial = by_effect.get(name)
            if trial is None:
                found.append(_none(effect, "these recordings hold nothing by which it could show"))
            else:
                others = {other: span for other, span in rivals.items() if other != name}
                search = _Search(track, state, basis, _expected(track, state, trial, anything), others, units)
                found.append(search.linear(trial.column) if trial.column.amplitudes else search.whole(trial.column))
    return tuple(found)


def _expected(track: Track, state: State, trial: Tried, anything: bool) -> Expected:
    """What an effect would come beside; one that is weak beside the noise is looked for only where nothing was found."""
    left, excess = max(float(state.fit.residual @ state.fit.residual), 1e-300), state.excess
    independent = max(independent_values(track, state.fit.residual), 1.0)
    by_nats = math.expm1(min(2.0 * EVIDENCE / independent, 50.0)) * left
    least = least_gain(state, trial.by_chance)
    if not anything:
        least = min(least, beyond_chance(track, state, (trial,)))
    # What an effect takes off is itself missing.
    least = max(by_nats, least, OF_EXCESS / (1.0 - OF_EXCESS) * excess, 1e-300)
    return Expected(left, state.floor, excess, independent, least)


def _beside(basis: Array, column: Column) -> Array:
    """Orthonormal columns of what the fitted parameters can't do of ``column``, shape ``(n, n_parts)``."""
    parts = np.stack(column.parts, axis=1)
    left = parts - basis @ (basis.T @ parts)
    span, _ = np.linalg.qr(left / np.maximum(np.linalg.norm(left, axis=0), 1e-300))
    return np.asarray(span)


@dataclass(frozen=True, eq=False)
class _Search:
    """What a limit is found with.

    Attributes:
        track: the recordings.
        state: the model that was found.
        basis: orthonormal columns of what the fitted parameters do.
        beside: what an effect would come beside.
        rivals: orthonormal columns of what each rival does beside the fitted parameters, by its id.
        units: of the model.
    """

    track: Track
    state: State
    basis: Array
    beside: Expected
    rivals: Mapping[str, Array]
    units: Units

    def needed(self, effect: Effect, column: Array) -> float | None:
        """By what a column has to be multiplied; None where the fitted parameters do the same, or no size is enough."""
        own = self.own(column)
        if own <= OWN**2 * float(column @ column):
            return None
        _, apart = self.rival(column)
        energy = self.beside.needed(effect.id, apart)
        return None if energy is None else math.sqrt(energy / own)

    def rival(self, column: Array) -> tuple[str, float]:
        """Id of the rival that does most of a column, and the part of its energy that this leaves, 0 to 1."""
        own = self.apart(column)
        energy = float(own @ own)
        left = {name: 1.0 - float(np.sum((span.T @ own) ** 2)) / energy for name, span in self.rivals.items()}
        name = min(left, key=lambda each: left[each], default="")
        return name, max(left[name], 0.0) if name else 1.0

    def like(self, effect: Effect, column: Array) -> str:
        """Id of the rival that does most of a column, where it can't be told from that at its limit; else empty."""
        name, apart = self.rival(column)
        energy = self.beside.needed(effect.id, apart)
        return name if energy is not None and self.beside.nats(apart * energy) < TWENTY_TO_ONE else ""

    def own(self, column: Array) -> float:
        """Energy of what the fitted parameters can't do of a column [F^2]."""
        own = self.apart(column)
        return float(own @ own)

    def apart(self, column: Array) -> Array:
        """What the fitted parameters can't do of a column [F]."""
        return np.asarray(column - self.basis @ (self.basis.T @ column))

    def hidden(self, column: Array) -> float:
        """How many times a column is in what the model leaves; negative for its opposite."""
        return -float(self.apart(column) @ self.state.fit.residual) / self.own(column)

    def linear(self, column: Column) -> Limit:
        """Of an effect whose force grows in proportion to its amplitude."""
        effect = column.term.effect
        needed = self.needed(effect, column.parts[0])
        if needed is None:
            return _none(effect, _THE_SAME)
        strength = column.amplitudes[0]
        size = needed + abs(self.hidden(column.parts[0]))
        others = dict.fromkeys(column.amplitudes, 0.0)
        values = column.term.by_name | others | {strength: size}
        like = self.like(effect, column.parts[0])
        return self._stated(Term(effect, tuple(values.values())), strength, softer=False, like=like)

    def whole(self, column: Column) -> Limit:
        """Of an effect with another strength: from the size that was tried to the one at which its own column is enough."""
        held = column.term
        names = [p.name for p in held.effect.parameters]
        at = names.index((held.effect.amplitudes or tuple(names))[0])
        declared, value, change = held.effect.parameters[at], held.values[at], column.parts[0]
        if declared.dimension == "F" and held.effect.neutral is None:
            return _none(held.effect, _BEYOND)
        limits = held.effect.absent.get(declared.name, 0.0) > value
        softer = limits or declared.dimension in ("F/x", "1/s")
        needed = self.needed(held.effect, change)
        for _ in range(_ROUNDS):
            if needed is None or not math.isfinite(needed) or value == 0.0:
                return _none(held.effect, _BEYOND if limits else _THE_SAME)
            if 1.0 / _NEAR < needed < _NEAR:
                times = needed + max(self.hidden(change), 0.0)
                size = value / times if softer else value * times
                like = self.like(held.effect, change)
                return self._stated(_with(held, at, size), declared.name, softer=softer, like=like)
            by = min(max(needed, 1.0 / _STEP), _STEP)
            value = value / by if softer else value * by
            model = self.state.fit.model
            try:
                grown = model.with_terms((*model.terms, _with(held, at, value)))
            except ModelError:
                break
            change = self.track.residual(grown) - self.state.fit.residual
            needed = self.needed(held.effect, change)
        return _none(held.effect, "no size was found at which it begins to show")

    def _stated(self, held: Term, strength: str, *, softer: bool, like: str) -> Limit:
        """The limit that ``held`` has the size of, by its parameter ``strength``."""
        at = [p.name for p in held.effect.parameters].index(strength)
        if held.effect.parameters[at].dimension == "F" and not softer and abs(held.values[at]) > self.track.largest_force:
            return _none(held.effect, _TOO_LARGE)
        unit = held.effect.parameters[at].unit(self.units)
        return Limit(held.effect.id, held.effect.title, strength, held.values[at], softer, unit, "", like, held)


def _with(held: Term, at: int, value: float) -> Term:
    """``held`` with another value of its parameter number ``at``."""
    return Term(held.effect, tuple(value if k == at else each for k, each in enumerate(held.values)))


def _none(effect: Effect, why: str) -> Limit:
    return Limit(effect.id, effect.title, "", None, False, "", why)
