"""``fric node NODE``: run one ROS 2 node, as ``ros2 run fric_nodes NODE`` does."""

from __future__ import annotations

import importlib
import sys
from typing import Annotated

import typer
from fric.errors import InputError

__all__ = ["NODES", "register"]

NODES = (
    "plant",
    "excitation",
    "identifier",
    "compensator",
    "pid",
    "recorder",
    "player",
    "experiment",
    "monitor",
    "hardware_bridge",
)


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command(
        "node",
        no_args_is_help=True,
        # What follows the node's name is the node's, --help as well.
        context_settings={"allow_extra_args": True, "ignore_unknown_options": True, "allow_interspersed_args": False},
        epilog="Example: fric node plant --ros-args --params-file config/plant.yaml    or: fric node plant --help",
    )(node)


def node(
    context: typer.Context,
    name: Annotated[str, typer.Argument(help=f"One of {', '.join(NODES)}.")],
) -> None:
    """Run one ROS 2 node. Arguments after its name go to it, such as --help, or --ros-args -p name:=value."""
    if name not in NODES:
        raise InputError("fric node", f"no node '{name}'", f"choose one of {', '.join(NODES)}")
    sys.argv = [name, *context.args]
    importlib.import_module(f"fric_nodes.nodes.{name}").main()
