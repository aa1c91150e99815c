"""Settings of a fit, each declared once: type, text, unit and limits stand together, in the field that holds the value.

The command line, the JSON of a result and the parameters of a node are made from these declarations. A method names the common
settings that it honours (``Method.uses``), and may add settings of its own in a dataclass derived from :class:`Options`
(``Method.settings``)::

    @dataclass(frozen=True)
    class Mine(Options):
        rules: Annotated[int, Setting("Number of rules", lower=1)] = 5

This module imports nothing that is slow to import: the help of the command line is made from it.
"""

from __future__ import annotations

import math
import types
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from .errors import InputError

__all__ = ["FILTER", "PARAMETERS", "Options", "Setting", "declarations", "own_settings", "parsed", "set_values", "value_type"]


@dataclass(frozen=True)
class Setting:
    """Declaration of one setting.

    Attributes:
        doc: what it is, in one sentence without its full stop.
        unit: of its value; ``""`` for a text, a flag or a pure number.
        unset: what holds when it is not given.
        option: on the command line; ``""``: the field's name with dashes.
        lower: smallest value allowed.
        positive: the value must be larger than zero.
        choices: the texts allowed; empty: any.
        form: how one entry of a repeated setting is written, with an example.
        read: an entry from its text; raises ValueError for one that isn't of that form.
    """

    doc: str
    unit: str = ""
    unset: str = ""
    option: str = ""
    lower: float = -math.inf
    positive: bool = False
    choices: tuple[str, ...] = ()
    form: str = ""
    read: Callable[[str], Any] | None = None

    @property
    def help(self) -> str:
        """The sentence with its unit, and what holds when the setting is not given."""
        unit = f", in {self.unit}" if self.unit else ""
        return f"{self.doc}{unit}.{f' If not given: {self.unset}.' if self.unset else ''}"

    def check(self, option: str, value: Any) -> None:
        """Refuse a value outside the limits.

        Raises:
            InputError: it is not finite, too small, or none of the choices.
        """
        if isinstance(value, str):
            if self.choices and value not in self.choices:
                raise InputError(option, f"'{value}' is not known", f"use one of {', '.join(filter(None, self.choices))}")
            return
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            return
        if not math.isfinite(value) or value < self.lower or (self.positive and value <= 0.0):
            least = "a finite number" if self.lower == -math.inf else f"{self.lower:g} or more"
            raise InputError(option, f"is {value}", f"give {'a positive number' if self.positive else least}")


def _pair(text: str) -> tuple[float, float]:
    first, second = (float(part) for part in text.split(","))
    if not (math.isfinite(first) and math.isfinite(second)):
        raise ValueError(text)
    return first, second


def _limits(text: str) -> tuple[str, float, float]:
    name, _, numbers = text.partition("=")
    low, high = _pair(numbers)
    if not low < high:
        raise ValueError(text)
    return name, low, high


@dataclass(frozen=True)
class Options:
    """Settings of a fit; None lets the method choose from the data.

    Attributes:
        cutoff: of the zero-phase low-pass filter on the position [Hz].
        decimation: keep every n-th sample of the filtered equations.
        rest_velocity: a joint that stays slower than this rests, and tells nothing about sliding friction meanwhile [x/s].
        held: names of parameters to hold at their value.
        freed: names of shape parameters to fit as well.
        robust: weigh down outliers (Huber) instead of plain least squares.
        horizon: length of the free runs of an output-error fit [s]; None: the whole recording in one run.
        gains: P [F/x] and D [F s/x] of the feedback under which each recording was made, for oscillations; empty: not given.
        bounds: limits of parameters, ``(name, lower, upper)``, inside those that they are declared with.
        starts: number of starts of a search; the best end of all is taken.
        start_states: where the runs of an output-error fit start: as ``measured``; ``tied`` to that by its standard error;
            ``free``. Empty: for a whole recording tied where that error matters, else as measured; free for shorter runs.
        continuity: weight of the jumps from the end of one of these runs to the start of the next; 0: they may jump.
    """

    cutoff: Annotated[
        float | None,
        Setting("Cutoff of the low-pass filter on the position", "Hz", "chosen from its noise, at most 100 Hz", positive=True),
    ] = None
    decimation: Annotated[
        int | None, Setting("Keep every n-th of the filtered equations", unset="chosen from the noise of the position", lower=1)
    ] = None
    rest_velocity: Annotated[
        float | None,
        Setting("A joint slower than this counts as at rest", "m/s or rad/s", "chosen from the position noise", lower=0.0),
    ] = None
    held: Annotated[
        tuple[str, ...],
        Setting("Hold this parameter at the value of the model file; may be repeated", option="--hold", form="NAME"),
    ] = ()
    freed: Annotated[
        tuple[str, ...],
        Setting("Fit this shape parameter too, which is held otherwise; may be repeated", option="--free", form="NAME"),
    ] = ()
    robust: Annotated[bool, Setting("Give outliers less weight (Huber) than plain least squares does")] = False
    horizon: Annotated[
        float | None,
        Setting("Length of the simulated free runs of output-error", "s", "the whole recording in one run", positive=True),
    ] = None
    gains: Annotated[
        tuple[tuple[float, float], ...],
        Setting(
            "Gains P,D of the position feedback during a recorded oscillation; once per recording, in their order",
            option="--gain",
            form="two finite numbers, such as 0.6,0.01",
            read=_pair,
        ),
    ] = ()
    bounds: Annotated[
        tuple[tuple[str, float, float], ...],
        Setting(
            "Keep a parameter between two limits, NAME=LO,HI; may be repeated",
            option="--bound",
            form="NAME=LO,HI, such as stribeck.velocity=0.001,0.05",
            read=_limits,
        ),
    ] = ()
    starts: Annotated[
        int, Setting("Number of start values from which output-error searches; the best fit is taken", lower=1)
    ] = 1
    start_states: Annotated[
        str,
        Setting(
            "Start of each free run of output-error: measured, tied (to the measurement by its standard error) or free",
            unset="chosen from the recording",
            choices=("", "measured", "tied", "free"),
        ),
    ] = ""
    continuity: Annotated[
        float,
        Setting("Weight of the jumps between successive free runs of output-error", unset="0, not weighted", lower=0.0),
    ] = 0.0


FILTER = ("cutoff", "decimation", "rest_velocity")
"""Settings of the filtered equations of motion."""

PARAMETERS = ("held", "freed", "bounds")
"""Settings that say which parameters are fitted, and within which limits."""


def declarations(kind: type[Options] | None = None) -> Mapping[str, tuple[Any, Setting]]:
    """Type and declaration of each setting, by the name of its field; the common ones when no type is given.

    Raises:
        TypeError: a field has no declaration.
    """
    return _declarations(Options if kind is None else kind)


@cache
def _declarations(kind: Any) -> Mapping[str, tuple[Any, Setting]]:
    found = {}
    for name, hint in get_type_hints(kind, include_extras=True).items():
        held = [each for each in get_args(hint)[1:] if isinstance(each, Setting)] if get_origin(hint) is Annotated else []
        if not held:
            raise TypeError(f"{kind.__name__}.{name} has no Setting in its annotation")
        option = held[0].option or f"--{name.replace('_', '-')}"
        found[name] = (get_args(hint)[0], Setting(**{**vars(held[0]), "option": option}))
    return found


def own_settings(kind: type[Options], common: type[Options] = Options) -> tuple[str, ...]:
    """Names of the settings that a method adds to the common ones."""
    return tuple(each.name for each in fields(kind) if each.name not in declarations(common))


def parsed(name: str, value: Any, kind: type[Options] = Options, subject: str = "") -> Any:
    """A setting as it is held, from what a user gave: texts of repeated settings are read, limits are checked.

    Args:
        name: of the setting's field.
        value: as it was given.
        kind: type of the options.
        subject: what an error names; empty: the option of the command line.

    Raises:
        InputError: the value can't be used.
    """
    hint, setting = declarations(kind)[name]
    subject = subject or setting.option
    if get_origin(hint) is tuple:
        return tuple(_entry(setting, each, subject) for each in value or ())
    if isinstance(value, str):
        value = _from_text(hint, value, subject)
    if value is not None:
        setting.check(subject, value)
    return value


def _entry(setting: Setting, value: Any, subject: str) -> Any:
    if setting.read is None or not isinstance(value, str):
        return value
    try:
        return setting.read(value)
    except ValueError:
        raise InputError(subject, f"is '{value}'", f"give {setting.form}") from None


def value_type(hint: Any) -> tuple[type, bool]:
    """Type of a setting's single value, or ``tuple`` for a repeated one, and whether it may be None."""
    if get_origin(hint) is tuple:
        return tuple, False
    kinds = get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,)
    return next(each for each in kinds if each is not type(None)), type(None) in kinds


def _from_text(hint: Any, text: str, subject: str) -> Any:
    """A single value from its text, by its declared type."""
    kind, _ = value_type(hint)
    try:
        if kind is bool:
            return {"true": True, "false": False}[text.lower()]
        return kind(text)
    except (ValueError, KeyError):
        words = {bool: "true or false", int: "a whole number", float: "a number"}
        raise InputError(subject, f"is '{text}'", f"give {words.get(kind, 'a value')}") from None


def set_values(options: Options) -> dict[str, Any]:
    """The settings that differ from their defaults, by the name of their field."""
    return {each.name: value for each in fields(options) if (value := getattr(options, each.name)) != each.default}
