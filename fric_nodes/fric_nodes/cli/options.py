"""Options that several verbs share, and the reading of recordings behind them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from fric.errors import InputError

from .groups import Group

if TYPE_CHECKING:
    from fric.bagio.topics import Topics
    from fric.record import Record

__all__ = [
    "EndOption",
    "JsonOption",
    "OutOption",
    "Reading",
    "ReadingGroup",
    "RepairOption",
    "StartOption",
    "progress",
    "read_all",
]

RepairOption = Annotated[
    bool, typer.Option("--repair", help="Drop or mark bad samples instead of refusing the recording; each is reported.")
]
StartOption = Annotated[float | None, typer.Option("--start", help="Leave out what was recorded before this time, in s.")]
EndOption = Annotated[float | None, typer.Option("--end", help="Leave out what was recorded after this time, in s.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output, for programs.")]
OutOption = Annotated[Path, typer.Option("--out", help="Folder for the results; made when missing.")]


@dataclass(frozen=True)
class Reading:
    """How recordings are read."""

    joint: Annotated[str | None, typer.Option("--joint", help="Name of the joint, if the recording holds several.")] = None
    repair: RepairOption = False
    time: Annotated[
        str,
        typer.Option(
            "--time", help="Clock of the samples: 'stamp' is the time in each message, 'log' the time at which it was recorded."
        ),
    ] = "stamp"
    start: StartOption = None
    end: EndOption = None
    topic: Annotated[
        tuple[str, ...],
        typer.Option(
            "--topic",
            help="Read a signal from another topic, such as joint_states=/robot/joint_states; may be repeated. A colon selects "
            "one number of a message: force_command=/arm/commands:0 is the first value of a list, "
            "force_command=/arm/commands:shoulder,elbow names the joints in the order of its values, "
            "effort=/ft/wrench:wrench.force.z is a field.",
        ),
    ] = ()

    @property
    def clock(self) -> Literal["stamp", "log"]:
        """Clock of the samples.

        Raises:
            InputError: it is not one of the two.
        """
        if self.time == "stamp":
            return "stamp"
        if self.time == "log":
            return "log"
        raise InputError("--time", f"'{self.time}' is not known", "use stamp or log")

    def topic_names(self) -> Topics:
        """Names of the topics.

        Raises:
            InputError: as :meth:`roles`.
        """
        from fric.bagio.topics import Topics

        return Topics(**self.roles())

    def roles(self) -> dict[str, str]:
        """Names of the topics that were given, by role.

        Raises:
            InputError: not ROLE=NAME, or no such role.
        """
        from fric.bagio.topics import Topics

        names = {}
        for entry in self.topic:
            role, found, name = entry.partition("=")
            if not found or not name.partition(":")[0].strip() or role not in Topics.__dataclass_fields__:
                roles = ", ".join(Topics.__dataclass_fields__)
                raise InputError("--topic", f"'{entry}' is not ROLE=NAME", f"use a role of {roles}")
            names[role] = name
        return names


ReadingGroup = Annotated[Reading, Group("Reading the recordings")]
"""How recordings are read, as a parameter of a command."""


def read_all(paths: list[Path], reading: Reading, as_recorded: bool = False) -> list[Record]:
    """The recordings at ``paths``, with end stops and saturation left out unless they are wanted ``as_recorded``.

    Raises:
        InputError: one of them can't be used.
    """
    from fric.bagio.read import read_record
    from fric.identification.screen import screened

    topics = reading.topic_names()
    records = [
        read_record(
            path,
            joint=reading.joint,
            topics=topics,
            time=reading.clock,
            repair=reading.repair,
            start=reading.start,
            end=reading.end,
        )
        for path in paths
    ]
    return records if as_recorded else [screened(record) for record in records]


def progress(text: str) -> None:
    """A line about what is going on, on standard error, so that ``--json`` stays clean."""
    typer.echo(text, err=True)
