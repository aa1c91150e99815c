"""The text form of a controller, ``format: fric-controller/1`` (YAML): what a closed loop is simulated with.

    format: fric-controller/1
    units: {position: m, force: N}
    period: 0.001              # [s] between two readings of the position
    delay: 0.0                 # [s] from a reading until the force that answers it acts
    force_limit: 100.0         # [F]
    resolution: 1.0e-6         # [x] step of the encoder that it reads; 0: ideal
    controller: {type: pid, proportional: 1.0e+5, integral: 1.0e+6, derivative: 400.0, filter_time: 5.0e-4}
    feedforward: {model: model.yaml}    # relative to this file; terms: [coulomb, viscous] takes these only

The types of controllers are those of :data:`fric.control.feedbacks.CONTROLLERS`, each with the parameters that it declares, and
those whose gains come from a design file with ``design``, its path relative to this file. Other feedforwards are named by their
type, see :mod:`fric.control.feedforward_file`.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, create_model

from ..errors import InputError
from ..model_file import read_model
from ..record import Units
from ..text_form import STRICT, Positive, UnitsEntry, field_of, line_of, loaded, text_of, validated
from .controller import Controller
from .feedbacks import CONTROLLERS
from .feedforward_file import FeedforwardPlan, feedforward_of

__all__ = ["FORMAT", "ControllerError", "ControllerSettings", "read_controller"]

FORMAT = "fric-controller/1"
NotNegative = Annotated[float, Field(strict=True, ge=0.0)]


class ControllerError(InputError):
    """A controller file that cannot be used."""


class _File(BaseModel):
    model_config = STRICT
    format: Literal["fric-controller/1"]
    units: UnitsEntry
    period: Positive
    controller: dict[str, Any]
    delay: NotNegative = 0.0
    force_limit: Positive | None = None
    resolution: NotNegative = 0.0
    feedforward: dict[str, Any] | list[dict[str, Any]] | None = None


@cache
def _entries() -> dict[str, type[BaseModel]]:
    """A pydantic model for each kind of controller, by its id."""
    entries = {}
    for kind in CONTROLLERS.values():
        fields: dict[str, Any] = {"type": (Literal[kind.id], ...)}
        fields |= {parameter.name: field_of(parameter) for parameter in kind.parameters}
        if kind.designed is not None:
            fields["design"] = (str, Field(min_length=1, description="path of the design file, relative to this one"))
        entries[kind.id] = create_model(f"controller_{kind.id}", __config__=STRICT, __doc__=kind.title, **fields)
    return entries


@dataclass(frozen=True)
class ControllerSettings:
    """What a controller file says.

    Attributes:
        units: of position and force.
        period: between two readings [s].
        kind: of the control law.
        gains: of the control law, by name.
        delay: from a reading until the force that answers it acts [s].
        force_limit: largest output [F].
        resolution: step of the encoder that is read [x]; 0: ideal.
        feedforward: whose force along the reference is added; None: none.
    """

    units: Units
    period: float
    kind: Controller
    gains: Mapping[str, float]
    delay: float = 0.0
    force_limit: float = math.inf
    resolution: float = 0.0
    feedforward: FeedforwardPlan | None = None


def read_controller(path: str | os.PathLike[str]) -> ControllerSettings:
    """The controller in the file ``path``.

    Raises:
        InputError: the file, or the model that it names, can't be used; with line and reason.
    """
    source = str(path)
    tree = loaded(text_of(path, FORMAT, ControllerError), source, "a controller file", FORMAT, ControllerError)
    entry = validated(_File, tree, tree, source, ControllerError)
    kind = CONTROLLERS.get(str(entry.controller.get("type")))
    if kind is None:
        given = entry.controller.get("type")
        problem = "type is missing" if given is None else f"type '{given}' is not known"
        raise ControllerError(
            f"{source}, line {line_of(tree, ('controller', 'type'))}", problem, f"use one of {', '.join(CONTROLLERS)}"
        )
    given_entry = _with_model(kind, dict(entry.controller), Path(source).parent)
    given = validated(_entries()[kind.id], given_entry, tree, source, ControllerError, ("controller",))
    gains: dict[str, float] = given.model_dump(exclude={"type", "design"})
    units = Units(entry.units.position, entry.units.force)
    if kind.designed is not None:
        design = Path(source).parent / str(entry.controller["design"])
        kind = kind.designed(design)
        if kind.units is not None:
            _same_units(Units(*kind.units), units, str(design), source)
    limit = math.inf if entry.force_limit is None else entry.force_limit
    plan = None
    if entry.feedforward is not None:
        plan = feedforward_of(entry.feedforward, units, Path(source).parent)
        plan.build(entry.period, 0.5 * entry.period + entry.delay)  # what can't be used is said now
    return ControllerSettings(units, entry.period, kind, gains, entry.delay, limit, entry.resolution, plan)


def _same_units(one: Units, other: Units, source: str, file: str) -> None:
    if one != other:
        problem = f"units are {one.position} and {one.force}, those of {file} are {other.position} and {other.force}"
        raise ControllerError(source, problem, "give gains and design in the same units")


def _with_model(kind: Controller, entry: dict[str, Any], folder: Path) -> dict[str, Any]:
    """``entry`` with the gains that the file of a model under its key ``model`` gives and that aren't given themselves."""
    if kind.from_model is None or "model" not in entry:
        return entry
    return kind.from_model(read_model(folder / str(entry.pop("model")))) | entry
