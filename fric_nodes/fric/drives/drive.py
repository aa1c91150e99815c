"""What a drive is to the bridge: it takes a force and gives a reading of the joint, once per period."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from ..errors import InputError

__all__ = ["Drive", "DriveError", "DriveKind", "DriveOption", "JointReading", "Link", "Options", "checked_options"]

Options = Mapping[str, float | int | str]
"""Values of a drive's options by name."""


class DriveError(InputError):
    """A drive that can't be used, or has reported a fault; one clear line."""


class JointReading(NamedTuple):
    """What a drive reports of its joint; NaN stands for what it doesn't measure.

    Attributes:
        stamp: time of measurement [ns], in the clock of the caller.
        position: [x].
        velocity: [x/s].
        effort: force or torque [F].
        temperature: [degC].
    """

    stamp: int
    position: float
    velocity: float = math.nan
    effort: float = math.nan
    temperature: float = math.nan


class Drive(Protocol):
    """A drive in use. Nothing but :meth:`exchange` gives it a force."""

    def open(self) -> None:
        """Connect, and make the drive ready to take forces; it gives none yet.

        Raises:
            DriveError: that isn't possible; the drive may be opened again later.
        """
        ...

    def exchange(self, force: float) -> JointReading | None:
        """Send ``force`` [F], and give the newest reading that hasn't been given yet; None when there is none.

        Raises:
            DriveError: the connection is lost or the drive has a fault; it has to be closed and opened again.
        """
        ...

    def close(self) -> None:
        """Take the force away as far as the connection allows it, and let go of the device. May be called at any time."""
        ...


class Link(Protocol):
    """Topics that a drive protocol uses; the node that has a graph provides them."""

    def send(self, topic: str, values: list[float]) -> None:
        """Publish numbers."""
        ...

    def newest(self) -> tuple[int, dict[str, tuple[float, float, float]]] | None:
        """Stamp [ns] of the newest joint state, and position, velocity and effort of its joints by name; None: none yet."""
        ...


@dataclass(frozen=True)
class DriveOption:
    """One option of a drive protocol.

    Attributes:
        name: of the option.
        default: value when none is given; its type is the option's type.
        doc: what it is, one sentence.
        unit: empty for a text or a pure number.
        lower: smallest number allowed.
        upper: largest number allowed.
        choices: texts allowed; empty allows any.
    """

    name: str
    default: float | int | str
    doc: str
    unit: str = ""
    lower: float = -math.inf
    upper: float = math.inf
    choices: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class DriveKind:
    """One drive protocol.

    Attributes:
        id: its name.
        title: what it is, in a few words.
        options: what can be set.
        make: the drive from the values of its options and, where it uses topics, a link to them; ``now`` is the clock [ns].
    """

    id: str
    title: str
    options: tuple[DriveOption, ...]
    make: Callable[[Options, Callable[[], int], Link | None], Drive]


def checked_options(kind: DriveKind, given: Options) -> dict[str, float | int | str]:
    """``given`` completed by the defaults.

    Raises:
        DriveError: an option is unknown, or has a value that can't be used.
    """
    known = {option.name: option for option in kind.options}
    for name in given:
        if name not in known:
            raise DriveError(f"drive '{kind.id}'", f"no option '{name}'", f"choose from {', '.join(known) or 'none'}")
    values: dict[str, float | int | str] = {}
    for name, option in known.items():
        value = given.get(name, option.default)
        if isinstance(value, str) != isinstance(option.default, str):
            raise DriveError(f"drive '{kind.id}'", f"{name} is {value!r}", f"give a {type(option.default).__name__}")
        if isinstance(value, str):
            if option.choices and value not in option.choices:
                raise DriveError(f"drive '{kind.id}'", f"{name} is '{value}'", f"choose from {', '.join(option.choices)}")
        elif not option.lower <= value <= option.upper:
            raise DriveError(f"drive '{kind.id}'", f"{name} is {value}", f"give a value in [{option.lower}, {option.upper}]")
        values[name] = value
    return values
