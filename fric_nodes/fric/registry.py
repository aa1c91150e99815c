"""Finding the members of a catalogue: every module of a package that defines one constant, here or in a plugin.

A catalogue (effects, plants, excitations, importers, checks, identification methods, ...) is a folder. A new member is one new
file in it; the listing of the folder is the listing of the catalogue.

A package of somebody else's adds members of any kind. It names itself under the entry point group ``fric.plugins``::

    [project.entry-points."fric.plugins"]
    my_axis = "my_axis"

and holds its members in modules or folders with the names of the catalogues here: ``my_axis/effects.py`` or
``my_axis/effects/my_law.py`` with a constant ``EFFECT``, likewise ``plants`` (``PLANT``), ``excitation`` (``EXCITATION``),
``importers`` (``IMPORTER``), ``methods`` (``METHOD``), ``estimators`` (``ESTIMATOR``), ``checks`` (``CHECK``), ``feedbacks``
(``CONTROLLER``), ``feedforwards`` (``FEEDFORWARD``), ``benchmarks`` (``BENCHMARK``), ``peers`` (``PEER``) and ``report``
(``REPORT``). Each is imported when its catalogue is, so that an effect must not import what is built on effects. A folder
``cli`` adds verbs to the command ``fric``, one per file: :mod:`fric_nodes.cli.main`.
"""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
from collections.abc import Iterator
from functools import cache
from importlib.metadata import entry_points
from types import ModuleType
from typing import TypeVar

__all__ = ["GROUP", "discover", "plugins"]

GROUP = "fric.plugins"
"""Entry point group under which other packages add members to the catalogues."""

Member = TypeVar("Member")


def discover(package: str, constant: str, kind: type[Member]) -> list[Member]:
    """Every ``constant`` of type ``kind`` that a module directly below ``package`` or in a plugin defines, by file name.

    Args:
        package: dotted name of the folder that holds the catalogue.
        constant: name of the constant that makes a module a member.
        kind: its type.

    Raises:
        TypeError: a module defines the constant with another type.
        ImportError: a plugin can't be imported; its message names the plugin.
    """
    found: list[Member] = []
    for module in (*_below(importlib.import_module(package)), *_in_plugins(package.rpartition(".")[2])):
        member = vars(module).get(constant)
        if member is None:
            continue
        if not isinstance(member, kind):
            raise TypeError(f"{module.__name__}.{constant} is a {type(member).__name__}, not a {kind.__name__}")
        found.append(member)
    return found


def _below(package: ModuleType) -> Iterator[ModuleType]:
    """The modules of a folder, by file name; a single module stands for itself."""
    if not hasattr(package, "__path__"):
        yield package
        return
    for name in sorted(info.name for info in pkgutil.iter_modules(package.__path__)):
        yield importlib.import_module(f"{package.__name__}.{name}")


@cache
def plugins() -> tuple[tuple[str, str], ...]:
    """Name and package of every plugin."""
    return tuple(sorted({(each.name, each.value) for each in entry_points(group=GROUP)}))


def _in_plugins(catalogue: str) -> Iterator[ModuleType]:
    """The modules of every plugin that belong to a catalogue, by its folder's name."""
    for name, package in plugins():
        try:
            if importlib.util.find_spec(f"{package}.{catalogue}") is not None:
                yield from _below(importlib.import_module(f"{package}.{catalogue}"))
        except ImportError as error:
            raise ImportError(f"plugin '{name}' ({package}) can't be imported: {error}; mend it or uninstall it") from error
