"""Options that several verbs share, and the reading of recordings behind them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from fric.errors import InputError

if TYPE_CHECKING:
    from fric.bagio.topics import Topics
    from fric.record import Record

__all__ = [
    "EndOption",
    "JointOption",
    "JointsOption",
    "JsonOption",
    "OutOption",
    "ReadOptions",
    "RepairOption",
    "StartOption",
    "TimeOption",
    "TopicOption",
    "progress",
    "read_all",
]

JointOption = Annotated[str | None, typer.Option("--joint", help="Name of the joint, where a recording holds several.")]
JointsOption = Annotated[
    str | None, typer.Option("--joint", help="Name of the joint, where a recording holds several; 'all' for each of them.")
]
RepairOption = Annotated[
    bool, typer.Option("--repair", help="Drop or mark bad samples instead of refusing the recording; says what was dropped.")
]
TimeOption = Annotated[str, typer.Option("--time", help="Take time from the messages' own 'stamp' or from the 'log'.")]
StartOption = Annotated[float | None, typer.Option("--start", help="Leave out what comes before this time [s].")]
EndOption = Annotated[float | None, typer.Option("--end", help="Leave out what comes after this time [s].")]
TopicOption = Annotated[
    list[str] | None,
    typer.Option(
        "--topic",
        help="Another topic name, such as joint_states=/robot/joint_states; may be repeated. Which number of a message is "
        "meant stands behind a colon: force_command=/arm/commands:0 is the first value of a list, "
        ":shoulder,elbow gives the joints in the order of its values, effort=/ft/wrench:wrench.force.z names a field.",
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output, for programs.")]
OutOption = Annotated[Path, typer.Option("--out", help="Folder for the results; made when missing.")]


@dataclass(frozen=True)
class ReadOptions:
    """How recordings are read."""

    joint: str | None = None
    repair: bool = False
    time: str = "stamp"
    start: float | None = None
    end: float | None = None
    topics: tuple[str, ...] = ()

    def topic_names(self) -> Topics:
        """Names of the topics.

        Raises:
            InputError: not ROLE=NAME, or no such role.
        """
        from fric.bagio.topics import Topics

        names = {}
        for entry in self.topics:
            role, found, name = entry.partition("=")
            if not found or not name.partition(":")[0].strip() or role not in Topics.__dataclass_fields__:
                roles = ", ".join(Topics.__dataclass_fields__)
                raise InputError("--topic", f"'{entry}' is not ROLE=NAME", f"use a role of {roles}")
            names[role] = name
        return Topics(**names)


def read_all(paths: list[Path], options: ReadOptions) -> list[Record]:
    """The recordings at ``paths``, with end stops and saturation left out.

    Raises:
        InputError: one of them can't be used.
    """
    from fric.bagio.read import read_record
    from fric.identification.screen import screened

    if options.time not in {"stamp", "log"}:
        raise InputError("--time", f"'{options.time}' is not known", "use stamp or log")
    topics = options.topic_names()
    return [
        screened(
            read_record(
                path,
                joint=options.joint,
                topics=topics,
                time="log" if options.time == "log" else "stamp",
                repair=options.repair,
                start=options.start,
                end=options.end,
            )
        )
        for path in paths
    ]


def progress(text: str) -> None:
    """A line about what is going on, on standard error, so that ``--json`` stays clean."""
    typer.echo(text, err=True)
