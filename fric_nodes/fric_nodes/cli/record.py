"""``fric record``: record topics of the running ROS graph into a bag."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command("record", no_args_is_help=True, epilog="Example: fric record bags/run --topic /robot/joint_states")(record)


def record(
    out: Annotated[Path, typer.Argument(help="Folder of the bag to write; must not exist.")],
    topic: Annotated[list[str] | None, typer.Option("--topic", help="Topic to record; may be repeated.")] = None,
    all_topics: Annotated[bool, typer.Option("--all", help="Record every topic.")] = False,
    storage: Annotated[str, typer.Option("--storage", help="mcap or sqlite3.")] = "mcap",
    compression: Annotated[str, typer.Option("--compression", help="none or zstd.")] = "none",
    joint: Annotated[str, typer.Option("--joint", help="Name of the joint, written into the bag.")] = "axis",
    effort_hold: Annotated[
        str,
        typer.Option(
            "--effort-hold",
            help="How effort acts between samples: following (from its stamp on), preceding (up to it), linear, unknown.",
        ),
    ] = "unknown",
    log_time: Annotated[
        str, typer.Option("--log-time", help="Time of each message in the bag: receive (when it arrived) or stamp (its own).")
    ] = "receive",
) -> None:
    """Record until Ctrl-C; a recorder that is killed leaves a bag that every verb reads."""
    from ..nodes.recorder import main
    from .ros_arguments import ros_arguments

    values = {"bag": out, "storage": storage, "compression": compression, "joint": joint, "log_time": log_time}
    values |= {"all_topics": all_topics, "effort_hold": effort_hold}
    main(ros_arguments("record", values, topic))
