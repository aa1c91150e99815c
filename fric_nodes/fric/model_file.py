"""The text form of a model, ``format: fric-model/1`` (YAML): read, check, write, and its JSON schema.

Every refusal names the file, the line, what is wrong there and what to write instead. Files are written aside and renamed, so a
failed write leaves the old file as it was.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import lru_cache, partial
from typing import Annotated, Any, Literal, Union

from pydantic import BaseModel, Field, create_model
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from .effects import EFFECTS, by_name
from .files import write_text
from .model import ENCODERS, Model, ModelError, Term, build_model
from .parameter import Parameter
from .plants import PLANTS
from .record import Units
from .text_form import STRICT, UnitsEntry, dumped, field_of, line_of, loaded, text_of, units_entry, validated

__all__ = ["FORMAT", "json_schema", "model_from_text", "model_to_text", "read_model", "write_model"]

FORMAT = "fric-model/1"


_EncoderEntry = Annotated[
    Literal[ENCODERS], Field(description="side of a transmission on which the position is measured")  # type: ignore[valid-type]
]


class _NominalEntry(BaseModel):
    model_config = STRICT
    normal_load: Annotated[float, Field(gt=0)] | None = None
    temperature: float | None = None


class _Header(BaseModel):
    """Everything of a file but the parts that depend on the plant and the effects."""

    model_config = STRICT
    format: Literal["fric-model/1"]
    joint: str = Field(min_length=1)
    units: UnitsEntry
    plant: dict[str, Any]
    terms: list[dict[str, Any]]
    nominal: _NominalEntry = Field(default_factory=_NominalEntry)
    standard_errors: dict[str, Annotated[float, Field(ge=0)]] = {}
    provenance: dict[str, str] = {}


@lru_cache(maxsize=1)
def _term_entries() -> dict[str, type[BaseModel]]:
    """A pydantic model for each effect, by its key."""
    entries = {}
    for key, effect in EFFECTS.items():
        fields: dict[str, Any] = {"effect": (Literal[effect.id], ...)}
        if effect.law:
            is_default = by_name(effect.id) is effect
            fields["law"] = (Literal[effect.law], effect.law if is_default else ...)
        fields |= {parameter.name: field_of(parameter) for parameter in effect.parameters}
        doc = f"{effect.title}: {effect.equation} ({effect.source})"
        entries[key] = create_model(f"term_{key.replace('/', '_')}", __config__=STRICT, __doc__=doc, **fields)
    return entries


@lru_cache(maxsize=1)
def _plant_entries() -> dict[str, type[BaseModel]]:
    """A pydantic model for each kind of plant, by its id."""
    entries = {}
    for plant in PLANTS.values():
        fields: dict[str, Any] = {"type": (Literal[plant.id], ...)}
        fields |= {parameter.name: field_of(parameter) for parameter in (plant.driven or plant).parameters}
        if plant.behind is not None:
            fields["encoder"] = (_EncoderEntry, ENCODERS[0])
        doc = f"{plant.title}: {plant.equation} ({plant.source})"
        entries[plant.id] = create_model(f"plant_{plant.id}", __config__=STRICT, __doc__=doc, **fields)
    return entries


def json_schema() -> dict[str, Any]:
    """JSON schema of a model file with all plants and effects that there are."""
    plants = tuple(_plant_entries().values())
    terms = tuple(_term_entries().values())
    whole = create_model(
        "fric_model_1",
        __base__=_Header,
        plant=(Union[plants], ...),  # type: ignore[arg-type] # noqa: UP007 - built from a tuple
        terms=(list[Union[terms]], ...),  # type: ignore[valid-type] # noqa: UP007
    )
    return whole.model_json_schema()


def read_model(path: str | os.PathLike[str]) -> Model:
    """The model in the file ``path``.

    Raises:
        ModelError: the file can't be read or isn't a valid model.
    """
    return model_from_text(text_of(path, FORMAT, ModelError), str(path))


def model_from_text(text: str, source: str = "model") -> Model:
    """The model that ``text`` describes; ``source`` names it in messages.

    Raises:
        ModelError: with line and reason.
    """
    tree = loaded(text, source, "a model file", FORMAT, ModelError)
    header = _validated(_Header, tree, tree, (), source)
    plant = _one_of(_plant_entries(), header.plant.get("type"), "type", tree, ("plant",), source)
    plant_entry = _validated(plant, header.plant, tree, ("plant",), source)
    terms = []
    for number, raw in enumerate(header.terms):
        at = ("terms", number)
        effect = by_name(str(raw.get("effect")), str(raw.get("law", "")))
        laws = [known.law for known in EFFECTS.values() if known.id == raw.get("effect")]
        if effect is None and laws:
            where = f"{source}, line {line_of(tree, (*at, 'law'))}"
            raise ModelError(where, f"law '{raw['law']}' of {raw['effect']} is not known", f"use one of {', '.join(laws)}")
        entry_type = _one_of(_term_entries(), effect.key if effect else raw.get("effect"), "effect", tree, at, source)
        entry = _validated(entry_type, raw, tree, at, source)
        assert effect is not None
        terms.append(Term(effect, tuple(float(getattr(entry, p.name)) for p in effect.parameters)))
    plant_values = {name: float(getattr(plant_entry, name)) for name in plant_entry.model_fields_set - {"type", "encoder"}}
    try:
        model = build_model(
            header.plant["type"],
            plant_values,
            terms,
            joint=header.joint,
            units=Units(header.units.position, header.units.force),
            nominal=header.nominal.model_dump(exclude_none=True),
            standard_errors=header.standard_errors,
            provenance=header.provenance,
            encoder=getattr(plant_entry, "encoder", ENCODERS[0]),
        )
    except ModelError as error:
        raise ModelError(f"{source}, line {line_of(tree, ('terms',))}", error.problem, error.remedy) from None
    stray = sorted(set(model.standard_errors) - set(model.names))
    if stray:
        where = f"{source}, line {line_of(tree, ('standard_errors', stray[0]))}"
        raise ModelError(
            where, f"standard error of '{stray[0]}', which the model doesn't have", f"use {', '.join(model.names)}"
        )
    return model


def _one_of(
    entries: Mapping[str, type[BaseModel]], name: object, key: str, tree: Any, at: tuple[str | int, ...], source: str
) -> type[BaseModel]:
    found = entries.get(str(name))
    if found is None:
        known = ", ".join(dict.fromkeys(entry.split("/")[0] for entry in entries))
        given = "is missing" if name is None else f"'{name}' is not known"
        raise ModelError(f"{source}, line {line_of(tree, (*at, key))}", f"{key} {given}", f"use one of {known}")
    return found


def _validated(kind: type[BaseModel], raw: Any, tree: Any, at: tuple[str | int, ...], source: str) -> Any:
    """``raw`` as ``kind``; the first thing wrong with it as a ModelError with its line."""
    return validated(kind, raw, tree, source, ModelError, at, partial(_remedy_for_missing, kind))


def _remedy_for_missing(kind: type[BaseModel], location: Sequence[int | str]) -> str:
    field = kind.model_fields.get(str(location[0]))
    described = field.description if field is not None and field.description else None
    if described is None and "units" in map(str, location):
        described = "units: {position: m, force: N} (or rad and N m)"
    return f"add it, {described}" if described else "add it"


def model_to_text(model: Model) -> str:
    """``model`` as the text of a model file, with a unit behind every value."""

    def entry(first: Mapping[str, str], parameters: Sequence[Parameter], values: Sequence[float]) -> CommentedMap:
        held = CommentedMap(first)
        for parameter, value in zip(parameters, values, strict=True):
            held[parameter.name] = value
            held.yaml_add_eol_comment(f"{parameter.symbol} [{parameter.unit(model.units)}]", parameter.name)
        return held

    root = CommentedMap()
    root["format"] = FORMAT
    root["joint"] = model.joint
    root["units"] = units_entry(model.units)
    plant = {"type": model.plant.id} | ({"encoder": model.encoder} if model.encoder != ENCODERS[0] else {})
    root["plant"] = entry(plant, model.plant.parameters, model.plant_values)
    terms = CommentedSeq()
    for held in model.terms:
        first = {"effect": held.effect.id} | ({"law": held.effect.law} if held.effect.law else {})
        terms.append(entry(first, held.effect.parameters, held.values))
    if not model.terms:
        terms.fa.set_flow_style()
    root["terms"] = terms
    if model.nominal:
        root["nominal"] = CommentedMap({name: float(value) for name, value in model.nominal.items()})
    if model.standard_errors:
        root["standard_errors"] = CommentedMap({name: float(error) for name, error in model.standard_errors.items()})
    if model.provenance:
        root["provenance"] = CommentedMap(model.provenance)
    return dumped(root)


def write_model(model: Model, path: str | os.PathLike[str]) -> None:
    """Write ``model`` to ``path``, all or nothing.

    Raises:
        InputError: the file can't be written.
    """
    write_text(path, model_to_text(model))
