"""What a feedforward is: its parameters and texts, and a force along the reference, sample by sample.

A feedforward is one file in ``control/feedforwards/`` with a constant ``FEEDFORWARD``, found by being there. Controller files
(``fric-controller/1``) and benchmarks take its parameters from the declaration. What all of them share, scale, limits and the
handling of reversals, is in :mod:`fric.control.shaping`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from ..errors import InputError
from ..parameter import Parameter
from ..record import Units

__all__ = ["FeedforwardKind", "FeedforwardKindError", "Force", "Setting", "Text", "checked_units"]


class FeedforwardKindError(InputError):
    """A feedforward that can't be built as asked, or a reference that it can't take."""


class Force(Protocol):
    """A feedforward at work, with its state."""

    @property
    def friction(self) -> float:
        """Share of the last force that changes its sign with the direction of motion [F]."""

    def reset(self) -> None:
        """Start anew, at rest."""

    def step(self, time: float, position: float, velocity: float, acceleration: float) -> float:
        """Force [F] for the reference ``position`` [x], ``velocity`` [x/s], ``acceleration`` [x/s^2] at ``time`` [s]."""


@dataclass(frozen=True)
class Text:
    """A setting that is no number.

    Attributes:
        name: key in a file.
        doc: what it is, one sentence.
        default: taken when a file leaves it out; None when it must be given.
        several: True for a list of texts.
        is_file: True for the path of a file, relative to the file that names it.
    """

    name: str
    doc: str
    default: str | None = None
    several: bool = False
    is_file: bool = False


@dataclass(frozen=True)
class Setting:
    """What a feedforward is built from.

    Attributes:
        period: between two references [s].
        preview: how much later than its stamp the force of a reference acts, on average [s].
        units: of position and force.
        values: of all parameters, by name.
        texts: by name; files with their whole path.
        lists: of texts, by name.
    """

    period: float
    preview: float
    units: Units
    values: Mapping[str, float] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)
    lists: Mapping[str, Sequence[str]] = field(default_factory=dict)


@dataclass(frozen=True)
class FeedforwardKind:
    """One kind of feedforward.

    Attributes:
        id: its name in files.
        title: its name in a sentence.
        build: the force from a setting that holds all values.
        parameters: numbers that it takes.
        texts: what it takes besides.
        source: where it comes from.
    """

    id: str
    title: str
    build: Callable[[Setting], Force] = field(repr=False)
    parameters: tuple[Parameter, ...] = ()
    texts: tuple[Text, ...] = ()
    source: str = ""

    def setting(self, period: float, units: Units, given: Mapping[str, object], preview: float, folder: Path) -> Setting:
        """``given`` by name, with defaults filled in.

        Args:
            period: between two references [s].
            units: of position and force.
            given: numbers, texts and lists of texts by name.
            preview: how much later than its stamp the force of a reference acts [s].
            folder: to which paths are relative.

        Raises:
            FeedforwardKindError: something is unknown, missing or out of bounds.
        """
        where = f"feedforward '{self.id}'"
        declared: list[Parameter | Text] = [*self.parameters, *self.texts]
        known = [each.name for each in declared]
        unknown = sorted(set(given) - set(known))
        if unknown:
            raise FeedforwardKindError(where, f"unknown setting '{unknown[0]}'", f"use only {', '.join(known) or 'its type'}")
        for each in declared:
            if each.name not in given and each.default is None:
                raise FeedforwardKindError(where, f"'{each.name}' is missing", f"give {each.doc}")
        values: dict[str, float] = {}
        for parameter in self.parameters:
            value = given.get(parameter.name, parameter.default)
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                raise FeedforwardKindError(where, f"{parameter.name} is {value!r}, not a number", f"give {parameter.doc}")
            said = parameter.refusal(float(value))
            if said is not None:
                raise FeedforwardKindError(where, f"{parameter.name} {said}", f"give {parameter.doc}")
            values[parameter.name] = float(value)
        texts: dict[str, str] = {}
        lists: dict[str, Sequence[str]] = {}
        for text in self.texts:
            said_text = given.get(text.name, text.default)
            if text.several:
                listed = [] if said_text == "" else said_text
                if not isinstance(listed, (list, tuple)) or not all(isinstance(one, str) for one in listed):
                    raise FeedforwardKindError(where, f"{text.name} is no list of names", f"give {text.doc}")
                lists[text.name] = tuple(listed)
            elif not isinstance(said_text, str):
                raise FeedforwardKindError(where, f"{text.name} is {said_text!r}, not a text", f"give {text.doc}")
            else:
                texts[text.name] = str(folder / said_text) if text.is_file and said_text else said_text
        return Setting(period, preview, units, values, texts, lists)


def checked_units(given: Units, setting: Setting, source: str) -> None:
    """Raise when ``source`` has other units than the setting.

    Raises:
        FeedforwardKindError: it does.
    """
    if given != setting.units:
        problem = (
            f"units are {given.position} and {given.force}, those of the controller are "
            f"{setting.units.position} and {setting.units.force}"
        )
        raise FeedforwardKindError(source, problem, "give gains and model in the same units")
