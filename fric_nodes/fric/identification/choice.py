"""By which method a model is fitted: the one named, or the usual one for its structure; whether it uses what is set."""

from __future__ import annotations

from ..errors import InputError
from ..method_settings import Options, declarations, set_values
from ..model import Model
from . import METHODS
from .result import Method

__all__ = ["method_for", "refuse_unused"]


def method_for(name: str | None, structure: Model | None = None) -> Method:
    """The method ``name``, or the usual one for ``structure``.

    The filters of inverse dynamics take pre-sliding for inertia and damping: these were off by up to 5 standard errors where
    it was tried (2 kg, 2e5 N/m, steps of 10 um).

    Raises:
        InputError: the name isn't known, or the method would get this structure wrong.
    """
    slips = structure is not None and structure.has_slip_dynamics
    if name == "inverse-dynamics" and slips:
        raise InputError(
            "--method", "inverse-dynamics gives wrong values for a model with pre-sliding", "use --method prediction-error"
        )
    name = name or ("prediction-error" if slips else "inverse-dynamics")
    if name not in METHODS:
        raise InputError("--method", f"'{name}' is not known", f"use one of {', '.join(METHODS)}")
    return METHODS[name]


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
