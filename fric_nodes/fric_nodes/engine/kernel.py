"""The decorator of every compiled function, so that all are compiled alike.

Division follows IEEE 754 (no exception inside a step loop) and the arithmetic is strict: the same inputs give the same bits.
Everything is inlined into the loop that uses it, and nothing allocates or counts references: what a step needs is handed in,
or is a :func:`local_array`. With the counting, passing an array from function to function costs more than evaluating a
friction law.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.core.errors import RequireLiteralValue
from numba.core.options import DefaultOptions
from numba.extending import intrinsic

__all__ = ["kernel", "local_array", "loop"]

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


def _local_array(typing_context: Any, n: Any) -> Any:
    if not isinstance(n, types.IntegerLiteral):
        raise RequireLiteralValue("the length of a local array must be a constant")
    length = n.literal_value
    array = types.Array(types.float64, 1, "C")

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        number, index = context.get_value_type(types.float64), context.get_value_type(types.intp)
        memory = cast(Any, cgutils).alloca_once(builder, ir.ArrayType(number, max(length, 1)))
        made = context.make_array(array)(context, builder)
        context.populate_array(
            made,
            data=builder.bitcast(memory, number.as_pointer()),
            shape=[ir.Constant(index, length)],
            strides=[ir.Constant(index, 8)],
            itemsize=ir.Constant(index, 8),
            meminfo=None,
        )
        return made._getvalue()

    return array(n), code


local_array = cast(Callable[[int], Any], intrinsic(_local_array))
"""``local_array(n)``: a float64 array of constant length ``n``, not initialised, that lives as long as the loop that makes it.

The compiler sees that no other array overlaps it, and keeps it in registers. An array that is handed in is written to memory
and read again in every step, since any other store might have changed it: a third of the time of a step.
"""
