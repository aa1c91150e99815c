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
from numba.core.registry import CPUDispatcher
from numba.extending import intrinsic

__all__ = ["COMMON", "UNWRAPPED", "array_over", "hidden", "kernel", "local_array", "loop"]

Function = TypeVar("Function", bound=Callable[..., Any])


# The counting is numba's only option without a documented name; where a version has it no longer, it is only slower.
_UNCOUNTED = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}
# Neither have those that leave out the ways into a function from Python and from C.
UNWRAPPED = {name: True for name in ("no_cpython_wrapper", "no_cfunc_wrapper") if hasattr(DefaultOptions, name)}
COMMON: dict[str, Any] = {"error_model": "numpy", "nogil": True, **_UNCOUNTED}
"""Options of every compiled function."""

_TAKEN_IN: dict[str, Any] = {**COMMON, **UNWRAPPED, "forceinline": True}


class _Kernel(CPUDispatcher):
    """A compiled function that other compiled ones take in; that from Python is compiled once more, when it is first called."""

    def __call__(self, *arguments: Any) -> Any:
        if "from_python" not in self.__dict__:
            self.__dict__["from_python"] = njit(**COMMON)(self.py_func)
        return self.__dict__["from_python"](*arguments)


def kernel(function: Function) -> Function:
    """``function``, compiled at its first call, for use in a step loop.

    It has no ways in from Python and C of its own: a third of the time of compiling a model went into these.
    """
    made = njit(**_TAKEN_IN)(function)
    cast(Any, made).__class__ = _Kernel
    return cast(Function, made)


def loop(function: Function) -> Function:
    """``function`` as a loop over steps, compiled at its first call or taken from the disk cache of its module."""
    return cast(Function, njit(**COMMON, cache=True)(function))


def array_over(context: Any, builder: Any, numbers: Any, length: int) -> Any:
    """Code that makes an array of the ``length`` numbers at a pointer, which it doesn't own."""
    index = context.get_value_type(types.intp)
    made = context.make_array(types.Array(types.float64, 1, "C"))(context, builder)
    context.populate_array(
        made,
        data=numbers,
        shape=[ir.Constant(index, length)],
        strides=[ir.Constant(index, 8)],
        itemsize=ir.Constant(index, 8),
        meminfo=None,
    )
    return made._getvalue()


def _local_array(typing_context: Any, n: Any) -> Any:
    if not isinstance(n, types.IntegerLiteral):
        raise RequireLiteralValue("the length of a local array must be a constant")
    length = n.literal_value
    array = types.Array(types.float64, 1, "C")

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        number = context.get_value_type(types.float64)
        memory = cast(Any, cgutils).alloca_once(builder, ir.ArrayType(number, max(length, 1)))
        return array_over(context, builder, builder.bitcast(memory, number.as_pointer()), length)

    return array(n), code


local_array = cast(Callable[[int], Any], intrinsic(_local_array))
"""``local_array(n)``: a float64 array of constant length ``n``, not initialised, that lives as long as the loop that makes it.

The compiler sees that no other array overlaps it, and keeps it in registers. An array that is handed in is written to memory
and read again in every step, since any other store might have changed it: a third of the time of a step.
"""


def _hidden(typing_context: Any, value: Any) -> Any:
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        # A register for whole numbers has the same letter on every machine.
        whole = context.get_value_type(types.int64)
        given = builder.bitcast(arguments[0], whole)
        call = builder.asm(ir.FunctionType(whole, [whole]), "", "=r,0", (given,), side_effect=False)
        call.attributes.add("nounwind")
        call.attributes.add("readnone")
        return builder.bitcast(call, arguments[0].type)

    return types.float64(types.float64), code


hidden = cast(Callable[[float], float], intrinsic(_hidden))
"""``hidden(x)``: x, of which the compiler knows nothing, so that what depends on it is only done where it is asked for.

The compiler takes exponentials for cheap: it would rather evaluate those of all terms, whether a model has the term or not, and
choose between the results.
"""
