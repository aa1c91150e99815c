"""What stands in a controller file below ``feedforward``: one feedforward or a list of them, whose forces are added.

    feedforward: {model: model.yaml}                                   # short for type: model
    feedforward: {type: dnlrx, file: guideway.yaml, scale: 0.8}
    feedforward:
      - {type: static_table, file: table.txt, build_up: 1.0e-5, let_down: 1.0e-5}
      - {type: dither, amplitude: 0.1, frequency: 80.0}

Beside the settings of its type each takes ``scale``, ``let_down``, ``build_up``, ``force_limit`` and ``slew_limit``, see
:mod:`fric.control.shaping`. Files are relative to the controller file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from ..record import Units
from .feedforward_kind import FeedforwardKind, FeedforwardKindError, Force
from .feedforwards import FEEDFORWARDS
from .shaping import Shaped, Shaping, Total

__all__ = ["FeedforwardPlan", "feedforward_of"]

_SHAPING = tuple(each.name for each in fields(Shaping))


@dataclass(frozen=True)
class _Part:
    kind: FeedforwardKind
    given: Mapping[str, object]
    shaping: Shaping


@dataclass(frozen=True)
class FeedforwardPlan:
    """Feedforwards with their settings, to be built once the timing of the loop is known.

    Attributes:
        parts: each kind with what was given of it.
        units: of position and force.
        folder: to which paths are relative.
    """

    parts: tuple[_Part, ...]
    units: Units
    folder: Path

    def build(self, period: float, preview: float) -> Force:
        """The force, with a state of its own.

        Args:
            period: between two references [s].
            preview: how much later than its stamp the force of a reference acts, on average [s].

        Raises:
            InputError: a setting or a file can't be used.
        """
        made = []
        for part in self.parts:
            setting = part.kind.setting(period, self.units, part.given, preview, self.folder)
            made.append(Shaped(part.kind.build(setting), part.shaping))
        return made[0] if len(made) == 1 else Total(made)


def feedforward_of(entry: Mapping[str, Any] | Sequence[Mapping[str, Any]], units: Units, folder: Path) -> FeedforwardPlan:
    """What ``entry`` says; see the module.

    Raises:
        FeedforwardKindError: a type is unknown or a value of the shaping can't be used.
    """
    parts = []
    for one in [entry] if isinstance(entry, Mapping) else list(entry):
        if not isinstance(one, Mapping):
            raise FeedforwardKindError("feedforward", f"holds {one!r}", "give a type with its settings")
        given = dict(one)
        name = str(given.pop("type", "model"))
        kind = FEEDFORWARDS.get(name)
        if kind is None:
            raise FeedforwardKindError("feedforward", f"type '{name}' is not known", f"use one of {', '.join(FEEDFORWARDS)}")
        shaped = {key: given.pop(key) for key in _SHAPING if key in given}
        for key, value in shaped.items():
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                raise FeedforwardKindError(f"feedforward '{name}'", f"{key} is {value!r}, not a number", "give a number")
        parts.append(_Part(kind, given, Shaping(**shaped)))
    if not parts:
        raise FeedforwardKindError("feedforward", "is an empty list", "leave the key out, or give a type")
    return FeedforwardPlan(tuple(parts), units, folder)
