"""The decorator of every compiled function, so that all are compiled alike.

Division follows IEEE 754 (no exception inside a step loop) and the arithmetic is strict: the same inputs give the same bits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

__all__ = ["kernel"]

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """``function``, compiled at its first call, for use in a step loop."""
    return cast(Function, njit(error_model="numpy", nogil=True, forceinline=True)(function))
