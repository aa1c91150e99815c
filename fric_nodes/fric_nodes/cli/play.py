"""``fric play``: publish a bag into the running ROS graph."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import EndOption, StartOption

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command("play", no_args_is_help=True, epilog="Example: fric play bags/run --rate 2 --clock")(play)


def play(
    bag: Annotated[Path, typer.Argument(help="Bag to play: a rosbag2 folder, or a .mcap or .db3 file.")],
    rate: Annotated[float, typer.Option("--rate", help="Speed relative to the recording; 0: as fast as possible.")] = 1.0,
    start: StartOption = None,
    end: EndOption = None,
    loop: Annotated[bool, typer.Option("--loop", help="Play again from the start, until Ctrl-C.")] = False,
    topic: Annotated[
        list[str] | None, typer.Option("--topic", help="Topic to play; may be repeated. If not given: all.")
    ] = None,
    clock: Annotated[bool, typer.Option("--clock", help="Publish the time of the recording on /clock.")] = False,
    wait: Annotated[int, typer.Option("--wait", help="Wait for this many subscribers before playing.")] = 0,
) -> None:
    """Publish a recording into the running graph, the same messages in the same order."""
    from ..nodes.player import main
    from .ros_arguments import ros_arguments

    values = {"bag": bag, "rate": float(rate), "start": float(start or 0.0), "end": float(end or 0.0), "loop": loop}
    main(ros_arguments("play", {**values, "clock": clock, "wait_for_subscribers": wait}, topic))
