"""The text form of a controller, ``format: fric-controller/1`` (YAML): what a closed loop is simulated with.

    format: fric-controller/1
    units: {position: m, force: N}
    period: 0.001              # [s] between two readings of the position
    delay: 0.0                 # [s] from a reading until the force that answers it acts
    force_limit: 100.0         # [F]
    resolution: 1.0e-6         # [x] step of the encoder that it reads; 0: ideal
    controller: {type: pid, proportional: 1.0e+5, integral: 1.0e+6, derivative: 400.0, filter_time: 5.0e-4}
    feedforward: {model: model.yaml}    # relative to this file; terms: [coulomb, viscous] takes these only

``controller: {type: cascade, position_gain: ..., velocity_gain: ...}`` is the other kind. The parameters are those of
:class:`fric.control.pid.PidGains` and :class:`fric.control.cascade.CascadeGains`.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from ..errors import InputError
from ..model import Model
from ..model_file import read_model
from ..record import Units
from ..text_form import STRICT, Positive, UnitsEntry, line_of, loaded, text_of, validated
from .cascade import CascadeGains
from .feedforward import Feedforward
from .pid import PidGains

__all__ = ["FORMAT", "ControllerError", "ControllerSettings", "read_controller"]

FORMAT = "fric-controller/1"
NotNegative = Annotated[float, Field(strict=True, ge=0.0)]


class ControllerError(InputError):
    """A controller file that cannot be used."""


class _PidEntry(BaseModel):
    model_config = STRICT
    type: Literal["pid"]
    proportional: NotNegative
    integral: NotNegative = 0.0
    derivative: NotNegative = 0.0
    filter_time: NotNegative = 0.0
    position_weight: NotNegative = 1.0
    velocity_weight: NotNegative = 1.0
    tracking_time: NotNegative = 0.0


class _CascadeEntry(BaseModel):
    model_config = STRICT
    type: Literal["cascade"]
    position_gain: NotNegative
    velocity_gain: Positive
    velocity_integral: NotNegative = 0.0
    velocity_weight: NotNegative = 0.0
    filter_time: NotNegative = 0.0


class _FeedforwardEntry(BaseModel):
    model_config = STRICT
    model: str = Field(min_length=1)
    terms: list[str] = []


class _File(BaseModel):
    model_config = STRICT
    format: Literal["fric-controller/1"]
    units: UnitsEntry
    period: Positive
    controller: dict[str, Any]
    delay: NotNegative = 0.0
    force_limit: Positive | None = None
    resolution: NotNegative = 0.0
    feedforward: _FeedforwardEntry | None = None


_KINDS: dict[str, type[_PidEntry] | type[_CascadeEntry]] = {"pid": _PidEntry, "cascade": _CascadeEntry}


@dataclass(frozen=True)
class ControllerSettings:
    """What a controller file says.

    Attributes:
        units: of position and force.
        period: between two readings [s].
        gains: of the control law.
        delay: from a reading until the force that answers it acts [s].
        force_limit: largest output [F].
        resolution: step of the encoder that is read [x]; 0: ideal.
        feedforward: model whose force along the reference is added, with the terms that count; None: none.
    """

    units: Units
    period: float
    gains: PidGains | CascadeGains
    delay: float = 0.0
    force_limit: float = math.inf
    resolution: float = 0.0
    feedforward: Model | None = None


def read_controller(path: str | os.PathLike[str]) -> ControllerSettings:
    """The controller in the file ``path``.

    Raises:
        InputError: the file, or the model that it names, can't be used; with line and reason.
    """
    source = str(path)
    tree = loaded(text_of(path, FORMAT, ControllerError), source, "a controller file", FORMAT, ControllerError)
    entry = validated(_File, tree, tree, source, ControllerError)
    kind = _KINDS.get(str(entry.controller.get("type")))
    if kind is None:
        given = entry.controller.get("type")
        problem = "type is missing" if given is None else f"type '{given}' is not known"
        raise ControllerError(
            f"{source}, line {line_of(tree, ('controller', 'type'))}", problem, f"use one of {', '.join(_KINDS)}"
        )
    values = validated(kind, entry.controller, tree, source, ControllerError, ("controller",)).model_dump(exclude={"type"})
    gains = PidGains(**values) if kind is _PidEntry else CascadeGains(**values)
    units = Units(entry.units.position, entry.units.force)
    limit = math.inf if entry.force_limit is None else entry.force_limit
    model = None
    if entry.feedforward is not None:
        at = Path(source).parent / entry.feedforward.model
        model = Feedforward(entry.period, terms=entry.feedforward.terms).selected(read_model(at))
        _same_units(model.units, units, str(at), source)
    return ControllerSettings(units, entry.period, gains, entry.delay, limit, entry.resolution, model)


def _same_units(one: Units, other: Units, source: str, file: str) -> None:
    if one != other:
        problem = f"units are {one.position} and {one.force}, those of {file} are {other.position} and {other.force}"
        raise ControllerError(source, problem, "give gains and model in the same units")
