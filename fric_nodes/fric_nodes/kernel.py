"""The decorator of every compiled function, so that all are compiled alike.

Division follows IEEE 754 (no exception inside a step loop) and the arithmetic is strict: the same inputs give the same bits.
Everything is inlined into the loop that uses it, and nothing allocates or counts references: what a step needs is handed in.
With the counting, passing an array from function to function costs more than evaluating a friction law.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

__all__ = ["kernel", "loop"]

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """``function``, compiled at its first call, for use in a step loop."""
    return cast(Function, njit(error_model="numpy", nogil=True, forceinline=True, _nrt=False)(function))


def loop(function: Function) -> Function:
    """``function`` as a loop over steps, compiled at its first call or taken from the disk cache of its module."""
    return cast(Function, njit(error_model="numpy", nogil=True, cache=True, _nrt=False)(function))
