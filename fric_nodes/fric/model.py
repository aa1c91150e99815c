"""Model: a plant and a list of terms, each one physical effect with its values.

A model is immutable; a fit makes a new one with :meth:`Model.with_values`. Parameters are named ``mass`` (the plant's own) and
``coulomb.force`` (a term's), with ``#2`` behind the effect where a model holds the same effect twice. The text form,
``fric-model/1``, is in :mod:`fric.model_file`; what a model does is in :mod:`fric.simulation`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from .effect import Effect, Place
from .effects import EFFECTS, by_name
from .engine.compile import Loops, loops_for
from .engine.linked import Linked, linked, linked_loops
from .errors import InputError
from .parameter import Parameter
from .plant import Plant
from .plants import PLANTS
from .record import Array, Units

__all__ = ["ENCODERS", "Model", "ModelError", "NamedParameter", "Term", "build_model", "term"]

ENCODERS = ("motor", "load")
"""Sides of a transmission on which a position may be measured; the first where nothing is said."""


class ModelError(InputError):
    """A model, or a file that holds one, that cannot be used."""


class NamedParameter(NamedTuple):
    """One parameter of a model with its place in the vector of all values."""

    name: str
    declaration: Parameter
    value: float


@dataclass(frozen=True)
class Term:
    """One effect with the values of its parameters, in the order of their declaration."""

    effect: Effect
    values: tuple[float, ...]

    @property
    def by_name(self) -> dict[str, float]:
        """The values by the names of their parameters."""
        return dict(zip((p.name for p in self.effect.parameters), self.values, strict=True))


@dataclass(frozen=True)
class Model:
    """A plant and its terms.

    Attributes:
        plant: kind of plant; its driven form where the terms hold a transmission.
        plant_values: values of the plant's own parameters.
        terms: in the order of assembly (by place).
        joint: name of the joint the model belongs to.
        units: units of position and force.
        nominal: the ``normal_load`` and the ``temperature`` [degC] at which the values hold, where known.
        standard_errors: standard error of identified parameters, by parameter name.
        provenance: where the values come from, free text by key.
        encoder: the side of a transmission on which the position is measured: ``motor`` or ``load``. Without a transmission
            both are one; it counts as soon as the model gets one.
    """

    plant: Plant
    plant_values: tuple[float, ...]
    terms: tuple[Term, ...]
    joint: str = "axis"
    units: Units = field(default_factory=Units)
    nominal: Mapping[str, float] = field(default_factory=dict)
    standard_errors: Mapping[str, float] = field(default_factory=dict)
    provenance: Mapping[str, str] = field(default_factory=dict)
    encoder: str = ENCODERS[0]

    def __post_init__(self) -> None:
        _check_structure(self)

    def parameters(self) -> Iterator[NamedParameter]:
        """Every parameter in the order of :attr:`values`."""
        for declaration, value in zip(self.plant.parameters, self.plant_values, strict=True):
            yield NamedParameter(declaration.name, declaration, value)
        for prefix, held in zip(self.prefixes, self.terms, strict=True):
            for declaration, value in zip(held.effect.parameters, held.values, strict=True):
                yield NamedParameter(f"{prefix}.{declaration.name}", declaration, value)

    @property
    def prefixes(self) -> tuple[str, ...]:
        """The name of each term: its effect, numbered from the second of a kind."""
        seen: dict[str, int] = {}
        names = []
        for held in self.terms:
            seen[held.effect.id] = seen.get(held.effect.id, 0) + 1
            names.append(held.effect.id if seen[held.effect.id] == 1 else f"{held.effect.id}#{seen[held.effect.id]}")
        return tuple(names)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters."""
        return tuple(parameter.name for parameter in self.parameters())

    @property
    def values(self) -> Array:
        """Values of all parameters, shape ``(n_parameters,)``, the plant's first."""
        return np.array([*self.plant_values, *(value for held in self.terms for value in held.values)], dtype=np.float64)

    def value(self, name: str) -> float:
        """The value of the parameter ``name``.

        Raises:
            ModelError: the model has no such parameter.
        """
        for parameter in self.parameters():
            if parameter.name == name:
                return parameter.value
        raise ModelError("model", f"no parameter '{name}'", f"choose one of {', '.join(self.names)}")

    def unit(self, name: str) -> str:
        """The unit of the parameter ``name``."""
        return next(p.declaration.unit(self.units) for p in self.parameters() if p.name == name)

    def with_values(self, values: Array, standard_errors: Mapping[str, float] | None = None) -> Model:
        """The same structure with other values, shape ``(n_parameters,)``; the caller vouches for their bounds."""
        numbers = [float(value) for value in values]
        at = len(self.plant_values)
        terms = []
        for held in self.terms:
            terms.append(Term(held.effect, tuple(numbers[at : at + len(held.values)])))
            at += len(held.values)
        if at != len(numbers):
            raise ValueError(f"{len(numbers)} values for {at} parameters")
        return replace(
            self,
            plant_values=tuple(numbers[: len(self.plant_values)]),
            terms=tuple(terms),
            standard_errors=self.standard_errors if standard_errors is None else dict(standard_errors),
        )

    def with_value(self, name: str, value: float) -> Model:
        """The same model with one value changed."""
        values = self.values
        values[self.names.index(name)] = value
        return self.with_values(values)

    def with_terms(self, terms: Iterable[Term]) -> Model:
        """The same plant with other terms; standard errors are dropped, since they belonged to the old structure."""
        ordered = _in_order(terms)
        plant = _form(PLANTS[self.plant.id], ordered, self.encoder)
        values = _plant_values(plant, {p.name: v for p, v in zip(self.plant.parameters, self.plant_values, strict=True)})
        return replace(self, plant=plant, plant_values=values, terms=ordered, standard_errors={})

    @property
    def has_transmission(self) -> bool:
        """True when it has two bodies because its terms hold a transmission."""
        alone = PLANTS[self.plant.id]
        return self.plant is alone.driven or self.plant is alone.behind

    @property
    def loops(self) -> Loops:
        """The compiled loops of this structure; the first call in a fresh cache compiles."""
        return loops_for(self.plant, [held.effect for held in self.terms])

    @property
    def linked_loops(self) -> Loops:
        """Loops compiled once for all structures, which take :attr:`linked` for values; where many structures are tried."""
        return linked_loops(self.plant, [held.effect for held in self.terms])

    @property
    def linked(self) -> Linked:
        """Values and functions of the model as :attr:`linked_loops` take them."""
        return linked(self.plant, self.plant_values, self.terms)

    def inner_states(self, velocity: float = 0.0, force: float = 0.0) -> tuple[Array, Array]:
        """States of the slip dynamics and memory of all terms at the start of a run.

        It begins with ``velocity`` [x/s], and under ``force`` [F] at the contact where that is known.
        """
        slip = [held.effect.start(held.values, force) for held in self.terms if held.effect.slip is not None]
        memory = [held.effect.memory(velocity) for held in self.terms if held.effect.n_memory]
        return slip[0] if slip else np.zeros(0), np.concatenate([np.zeros(0), *memory])

    @property
    def has_command_path(self) -> bool:
        """True when the force that acts isn't the one that is commanded."""
        return any(held.effect.command is not None for held in self.terms)

    def uncommand(self, force: float) -> float:
        """The command that makes the command path give ``force`` [F], as far as its terms have no memory."""
        for held in reversed(self.terms):
            if held.effect.uncommand is not None:
                force = held.effect.uncommand(force, *held.values)
        return force

    @property
    def has_slip_dynamics(self) -> bool:
        """True when a pre-sliding law replaces exact sticking."""
        return any(held.effect.slip is not None for held in self.terms)

    @property
    def total_inertia(self) -> float:
        """Of all bodies together [F s^2/x]."""
        return self.plant.total_inertia(*self.plant_values)

    def max_rate(self) -> float:
        """Fastest rate of the plant and of the model's terms on its mass [1/s]; 0 when nothing is fast."""
        inertia = self.plant.inertia(*self.plant_values)
        rates = [held.effect.rate(inertia, *held.values) for held in self.terms if held.effect.rate is not None]
        if self.plant.rate is not None:
            rates.append(self.plant.rate(*self.plant_values))
        return max(rates, default=0.0)


def term(effect: str, law: str = "", **values: float) -> Term:
    """A term by name, for code: ``term("coulomb", force=4.0)``.

    Raises:
        ModelError: unknown effect or parameter, or one is missing or out of bounds.
    """
    found = by_name(effect, law)
    if found is None:
        known = sorted({known.id for known in EFFECTS.values()})
        name = f"{effect}/{law}" if law else effect
        raise ModelError("term", f"unknown effect '{name}'", f"choose one of {', '.join(known)}")
    unknown = set(values) - {parameter.name for parameter in found.parameters}
    if unknown:
        names = ", ".join(parameter.name for parameter in found.parameters)
        raise ModelError(f"term '{effect}'", f"unknown parameter '{min(unknown)}'", f"it takes {names}")
    for parameter in found.parameters:
        if parameter.name not in values and parameter.default is None:
            raise ModelError(f"term '{effect}'", f"parameter '{parameter.name}' is missing", f"give {parameter.doc}")
    numbers = tuple(found.values(values))
    for parameter, number in zip(found.parameters, numbers, strict=True):
        refusal = parameter.refusal(number)
        if refusal is not None:
            raise ModelError(f"term '{effect}'", f"{parameter.name} {refusal}", f"give {parameter.doc}")
    return Term(found, numbers)


def build_model(plant: str, plant_values: Mapping[str, float], terms: Iterable[Term] = (), **rest: object) -> Model:
    """A model by names, for code: ``build_model("rigid", {"mass": 1.2}, [term("coulomb", force=4.0)])``.

    Raises:
        ModelError: unknown plant or value, a value is missing, or the terms can't stand together.
    """
    if plant not in PLANTS:
        raise ModelError("model", f"unknown plant '{plant}'", f"use one of {', '.join(PLANTS)}")
    ordered = _in_order(terms)
    kind = _form(PLANTS[plant], ordered, str(rest.get("encoder", ENCODERS[0])))
    known = {parameter.name for parameter in kind.parameters}
    for name in plant_values:
        if name not in known:
            problem = f"plant '{plant}' has no '{name}'"
            if kind.driven is not None and name in {parameter.name for parameter in kind.driven.parameters}:
                problem = f"'{name}' of plant '{plant}' has no meaning without a transmission"
            raise ModelError("model", problem, f"use {', '.join(parameter.name for parameter in kind.parameters)}")
    return Model(kind, _plant_values(kind, plant_values), ordered, **rest)  # type: ignore[arg-type]


def _form(plant: Plant, terms: Sequence[Term], encoder: str) -> Plant:
    """The plant itself, or its driven form by the side of the encoder where the terms hold a transmission, if there is one."""
    transmitted = any(held.effect.link is not None or held.effect.play is not None for held in terms)
    driven = plant.behind if encoder == "load" else plant.driven
    return driven if transmitted and driven is not None else plant


def _plant_values(plant: Plant, given: Mapping[str, float]) -> tuple[float, ...]:
    """The plant's values in order, defaults filled in."""
    values = []
    for parameter in plant.parameters:
        value = given.get(parameter.name, parameter.default)
        if value is None:
            raise ModelError("model", f"'{parameter.name}' of plant '{plant.id}' is missing", f"give {parameter.doc}")
        values.append(float(value))
    return tuple(values)


def _in_order(terms: Iterable[Term]) -> tuple[Term, ...]:
    places = list(Place)
    return tuple(sorted(terms, key=lambda held: (places.index(held.effect.place), held.effect.order)))


def _check_structure(model: Model) -> None:
    """Raise when the terms can't stand together."""
    laws = [held.effect for held in model.terms if held.effect.slip is not None]
    if len(laws) > 1:
        raise ModelError("model", f"two terms with slip dynamics ({laws[0].key}, {laws[1].key})", "keep one of them")
    if model.encoder not in ENCODERS:
        raise ModelError("model", f"encoder '{model.encoder}' is not known", f"use one of {', '.join(ENCODERS)}")
    if model.encoder != ENCODERS[0] and PLANTS[model.plant.id].behind is None:
        able = ", ".join(plant.id for plant in PLANTS.values() if plant.behind is not None)
        problem = f"plant '{model.plant.id}' has no transmission with two sides to measure on"
        raise ModelError("model", problem, f"leave the encoder out or use one of the plants {able or '(none)'}")
    if PLANTS[model.plant.id].driven is None:
        for held in model.terms:
            if held.effect.link is not None or held.effect.play is not None:
                able = ", ".join(plant.id for plant in PLANTS.values() if plant.driven is not None)
                problem = f"plant '{model.plant.id}' has no transmission for '{held.effect.id}'"
                raise ModelError("model", problem, f"leave the term out or use one of the plants {able or '(none)'}")
    seen: set[str] = set()
    for held in model.terms:
        if held.effect.id in seen and not held.effect.repeatable:
            raise ModelError("model", f"effect '{held.effect.id}' is there twice", "keep one and add up their values")
        seen.add(held.effect.id)
