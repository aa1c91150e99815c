"""``fric env``: print what a shell needs so that the tools of ROS 2 find this installation."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Mapping
from pathlib import Path

import typer
from fric.errors import InputError

__all__ = ["register", "variables"]

_PATHS = {"AMENT_PREFIX_PATH": "", "CMAKE_PREFIX_PATH": "", "PATH": "bin"}
"""Variables that list folders, and what of the installation each is to list."""

_DISTRIBUTION = {"ROS_VERSION": "2", "ROS_PYTHON_VERSION": "3", "ROS_DISTRO": "jazzy"}
"""What a setup file of ROS 2 sets besides; the wheels are Jazzy's."""


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command("env", epilog='Example: eval "$(fric env)" && ros2 run fric_nodes plant')(env)


def env() -> None:
    """Print lines for the shell: eval "$(fric env)" lets ros2 run, colcon and the like find fric where pip installed it."""
    for name, value in variables(installed_prefix(), os.environ).items():
        typer.echo(f"export {name}={shlex.quote(value)}")


def installed_prefix() -> Path:
    """The prefix under which ROS 2 finds the package.

    Raises:
        InputError: there is none: fric runs from its source tree.
    """
    marker = Path("share", "ament_index", "resource_index", "packages", "fric_nodes")
    # colcon's own setup file has set the variable already.
    places = [*os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep), sys.prefix]
    for place in filter(None, places):
        if (Path(place) / marker).is_file():
            return Path(place)
    raise InputError("fric env", f"no installed package fric_nodes in {sys.prefix}", "install it: pip install .")


def variables(prefix: Path, present: Mapping[str, str]) -> dict[str, str]:
    """The variables and their values.

    Args:
        prefix: of the installation; it comes behind what is there already, so that a sourced ROS 2 stays first.
        present: variables that are set; those that don't change are left out.
    """
    found = {}
    for name, folder in _PATHS.items():
        listed = [each for each in present.get(name, "").split(os.pathsep) if each]
        wanted = str(prefix / folder)
        if wanted not in listed:
            # The environment's own commands come first, as its activate script has it.
            found[name] = os.pathsep.join([wanted, *listed] if name == "PATH" else [*listed, wanted])
    return found | {name: value for name, value in _DISTRIBUTION.items() if not present.get(name)}
