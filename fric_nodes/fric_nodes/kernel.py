"""The decorator of every compiled function, so that all are compiled alike.

Division follows IEEE 754 (no exception inside a step loop) and the arithmetic is strict: the same inputs give the same bits.
Everything is inlined into the loop that uses it, and nothing allocates or counts references: what a step needs is handed in.
With the counting, passing an array from function to function costs more than evaluating a friction law.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit
from numba.core.options import DefaultOptions

__all__ = ["kernel", "loop"]

Function = TypeVar("Function", bound=Callable[..., Any])


# The counting is numba's only option without a documented name; where a version has it no longer, it is only slower.
_UNCOUNTED = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}
_COMMON: dict[str, Any] = {"error_model": "numpy", "nogil": True, **_UNCOUNTED}


def kernel(function: Function) -> Function:
    """``function``, compiled at its first call, for use in a step loop."""
    return cast(Function, njit(**_COMMON, forceinline=True)(function))


def loop(function: Function) -> Function:
    """``function`` as a loop over steps, compiled at its first call or taken from the disk cache of its module."""
    return cast(Function, njit(**_COMMON, cache=True)(function))
