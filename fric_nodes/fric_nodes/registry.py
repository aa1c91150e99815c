"""Finding the members of a catalogue: every module of a package that defines one constant.

A catalogue (effects, plants, excitations, identification methods) is a folder. A new member is one new file in it; the listing
of the folder is the listing of the catalogue.
"""

from __future__ import annotations

import importlib
import pkgutil
from typing import TypeVar

__all__ = ["discover"]

Member = TypeVar("Member")


def discover(package: str, constant: str, kind: type[Member]) -> list[Member]:
    """Every ``constant`` of type ``kind`` that a module directly below ``package`` defines, in the order of file names.

    Raises:
        TypeError: a module defines the constant with another type.
    """
    found: list[Member] = []
    search_path = importlib.import_module(package).__path__
    for module_info in sorted(pkgutil.iter_modules(search_path), key=lambda info: info.name):
        member = getattr(importlib.import_module(f"{package}.{module_info.name}"), constant, None)
        if member is None:
            continue
        if not isinstance(member, kind):
            raise TypeError(f"{package}.{module_info.name}.{constant} is a {type(member).__name__}, not a {kind.__name__}")
        found.append(member)
    return found
