"""By which method a model is fitted: the one that was named, or the usual one for its structure."""

from __future__ import annotations

from ..errors import InputError
from ..model import Model
from . import METHODS
from .result import Method

__all__ = ["method_for"]


def method_for(name: str | None, structure: Model | None = None) -> Method:
    """The method ``name``, or the usual one for ``structure``.

    The filters of inverse dynamics take pre-sliding for inertia and damping: these were off by up to 5 standard errors where
    it was tried (2 kg, 2e5 N/m, steps of 10 um).

    Raises:
        InputError: the name isn't known, or the method would get this structure wrong.
    """
    slips = structure is not None and structure.has_slip_dynamics
    if name == "inverse-dynamics" and slips:
        raise InputError("--method", "inverse-dynamics gets a model with pre-sliding wrong", "use --method prediction-error")
    name = name or ("prediction-error" if slips else "inverse-dynamics")
    if name not in METHODS:
        raise InputError("--method", f"'{name}' is not known", f"use one of {', '.join(METHODS)}")
    return METHODS[name]
