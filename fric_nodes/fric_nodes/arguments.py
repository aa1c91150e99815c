"""Command line of a node: what can't be used is refused in one line before anything starts; ``--help`` lists parameters."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from pathlib import Path

from fric.errors import InputError
from rclpy.utilities import remove_ros_args

from .parameters import NodeParameter

__all__ = ["ArgumentError", "check_arguments", "help_text", "params_files"]

_WIDTH = 100  # columns of the help
_HELP = ("-h", "--help")


class ArgumentError(InputError):
    """A command line that can't be used."""


def check_arguments(arguments: Sequence[str]) -> bool:
    """True when the help is asked for.

    Args:
        arguments: of the process; the first one is its name.

    Raises:
        ArgumentError: a parameter file that is not there or not readable, an argument that nobody takes, a broken rule.
    """
    for path in params_files(arguments):
        if not Path(path).is_file():
            raise ArgumentError(f"--params-file {path}", "there is no such file", "give the path of a ROS parameter file")
    try:
        rest = remove_ros_args(list(arguments))[1:]
    except RuntimeError as error:  # rclpy's own errors have no public names
        said = re.sub(r",? ?at /\S+:\d+", "", str(error)).removeprefix("Failed to parse ROS arguments: ")
        raise ArgumentError("ROS arguments", said.strip(" .,"), "see --help for the form of parameters") from None
    if any(argument in _HELP for argument in rest):
        return True
    if rest:
        remedy = "ROS arguments follow --ros-args: --ros-args -p NAME:=VALUE; see --help"
        raise ArgumentError(f"argument {rest[0]}", "is not known", remedy)
    return False


def params_files(arguments: Sequence[str]) -> list[str]:
    """The parameter files that the ROS arguments among ``arguments`` name."""
    found, ros = [], False
    for argument, following in zip(arguments, [*arguments[1:], ""], strict=True):
        if argument in {"--ros-args", "--"}:
            ros = argument == "--ros-args"
        elif ros and argument == "--params-file" and following:
            found.append(following)
    return found


def help_text(name: str, about: str, declarations: Sequence[NodeParameter]) -> str:
    """What ``--help`` prints.

    Args:
        name: of the node's executable.
        about: what the node is for.
        declarations: its parameters.
    """
    head = [
        f"usage: fric node {name} --ros-args -p NAME:=VALUE ... --params-file FILE",
        f"   or: ros2 run fric_nodes {name} --ros-args ...",
        "",
        *textwrap.wrap(about, _WIDTH),
        "",
        "parameters (those marked * may be set while the node runs):",
    ]
    return "\n".join([*head, *(_entry(each) for each in declarations)]) + "\n"


def _entry(parameter: NodeParameter) -> str:
    mark = "*" if parameter.settable else " "
    unit = f" {parameter.unit}" if parameter.unit else ""
    about = f"{parameter.doc}; {parameter.allowed}" if parameter.allowed else parameter.doc
    indented = textwrap.fill(about, _WIDTH, initial_indent=" " * 6, subsequent_indent=" " * 6)
    return f"{mark} {parameter.name} ({parameter.type_name}) = {parameter.default_text}{unit}\n{indented}"
