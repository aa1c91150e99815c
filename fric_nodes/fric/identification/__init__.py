"""Identification: parameters from recordings, with honest uncertainty.

Every method is one file with a constant ``METHOD`` and the same contract: ``fit(structure, records, options) ->
Identification``.
"""

from __future__ import annotations

from ..errors import InputError
from ..method_settings import Options, declarations, set_values
from ..registry import discover
from .result import Method

__all__ = ["METHODS", "refuse_unused"]

METHODS: dict[str, Method] = {method.id: method for method in discover(f"{__name__}.methods", "METHOD", Method)}
"""Every method by its id."""


def refuse_unused(method: Method, options: Options) -> None:
    """Refuse a setting that was given and that ``method`` does not use.

    Raises:
        InputError: it names the option, and the methods that use it.
    """
    for name in set_values(options):
        if name not in method.honoured:
            users = ", ".join(each.id for each in METHODS.values() if name in each.honoured)
            option = declarations(type(options))[name][1].option
            raise InputError(option, f"is not used by the method {method.id}", f"leave it out, or use one of {users}")
