"""Compiled functions called through a table: what a loop needs that knows its terms only when it runs.

Addresses are whole numbers. Nothing here checks them: the tables are made by :mod:`fric.engine.linked` alone.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, cast

from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

from .kernel import COMMON, UNWRAPPED, array_over

__all__ = [
    "address_of",
    "array_at",
    "call_led",
    "call_linked",
    "call_prepared",
    "entry",
    "instant",
    "led",
    "linked",
    "prepared",
]

_NUMBER = types.float64
_MANY = cast(Any, types).CPointer(types.float64)


_LINKED = (_MANY, _NUMBER, _MANY, _MANY)
_LED = (_MANY, _MANY, _NUMBER, _NUMBER, _NUMBER, _MANY, _MANY)
_PREPARED = (_MANY, _MANY)


class Placed:
    """A compiled function at an address, kept alive by this."""

    def __init__(self, function: Callable[..., float], kinds: tuple[Any, ...]) -> None:
        self._made = cast(Any, njit)(_NUMBER(*kinds), cache=True, **COMMON, **UNWRAPPED)(function)
        (compiled,) = self._made.overloads.values()
        self.address: int = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)


def linked(function: Callable[..., float]) -> Placed:
    """``function(c, total, memory, p) -> float`` as one that a table can hold, by its address."""
    return Placed(function, _LINKED)


def led(function: Callable[..., float]) -> Placed:
    """As :func:`linked`, for slip dynamics, ``function(z, z_next, v, h, level, constants, p) -> float``."""
    return Placed(function, _LED)


def prepared(function: Callable[..., float]) -> Placed:
    """As :func:`linked`, for what derives constants, ``function(constants, p) -> float``; the number means nothing."""
    return Placed(function, _PREPARED)


def _data(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Where the numbers of an array are, or what is at an address."""
    if isinstance(kind, types.Array):
        return context.make_array(kind)(context, builder, value).data
    return builder.inttoptr(value, context.get_value_type(_MANY))


def _address_of(typing_context: Any, array: Any) -> Any:
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.ptrtoint(_data(context, builder, signature.args[0], arguments[0]), context.get_value_type(types.int64))

    return types.int64(array), code


address_of = cast(Callable[[Any], int], intrinsic(_address_of))
"""``address_of(array)``: where its numbers are; the caller keeps it alive."""


def _array_at(typing_context: Any, pointer: Any) -> Any:
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return array_over(context, builder, arguments[0], 1)

    return types.Array(_NUMBER, 1, "C")(pointer), code


array_at = cast(Callable[[Any], Any], intrinsic(_array_at))
"""``array_at(pointer)``: the numbers there as an array; its shape says one number, whatever there are."""


def _entry(typing_context: Any, table: Any, number: Any) -> Any:
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        whole = context.get_value_type(types.int64)
        loaded = builder.load(builder.gep(builder.inttoptr(arguments[0], whole.as_pointer()), [arguments[1]]))
        # A table stays as it is while a loop runs, whatever the loop writes elsewhere.
        loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
        return loaded

    return types.int64(types.int64, types.int64), code


entry = cast(Callable[[int, int], int], intrinsic(_entry))
"""``entry(table, number)``: a whole number of the table at the address ``table``."""


class Instant(NamedTuple):
    """A context in a linked loop: as plants look at it, by name, and all of it in the order in which terms take it.

    Attributes:
        numbers: the fields of a :class:`fric.effect.Context` but the memory, shape ``(9,)``; the other attributes are these.
    """

    position: float
    velocity: float
    direction: float
    time: float
    load: float
    temperature: float
    acceleration: float
    step: float
    memory: Any
    push: float
    numbers: Any


def _instant(
    typing_context: Any, position: Any, velocity: Any, direction: Any, time: Any, load: Any, temperature: Any,
    acceleration: Any, step: Any, memory: Any, push: Any,
) -> Any:  # fmt: skip
    given = (*[_NUMBER] * 8, memory, _NUMBER)
    kind = cast(Any, types).NamedTuple((*given, types.Array(_NUMBER, 1, "C")), Instant)

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        number = context.get_value_type(_NUMBER)
        fields = [*arguments[:8], arguments[9]]
        place = cast(Any, cgutils).alloca_once(builder, ir.ArrayType(number, len(fields)))
        first = builder.bitcast(place, number.as_pointer())
        for k, field in enumerate(fields):
            builder.store(field, builder.gep(first, [ir.Constant(context.get_value_type(types.intp), k)]))
        numbers = array_over(context, builder, first, len(fields))
        return context.make_tuple(builder, kind, (*arguments, numbers))

    return kind(*given), code


instant = cast(Callable[..., Instant], intrinsic(_instant))
"""The context with these fields, which linked loops take for :class:`fric.effect.Context`; it lives as long as its caller."""


def _calling(wanted: tuple[Any, ...], kinds: tuple[Any, ...]) -> tuple[Any, Callable[..., Any]]:
    """Type and code of a call of the function at an address with ``kinds`` of arguments, of which it wants ``wanted``."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        passed = [
            _data(context, builder, kind, value) if want is _MANY else value
            for want, kind, value in zip(wanted, signature.args[1:], arguments[1:], strict=True)
        ]
        shape = context.call_conv.get_function_type(_NUMBER, wanted)
        function = builder.inttoptr(arguments[0], shape.as_pointer())
        _, result = context.call_conv.call_function(builder, function, _NUMBER, wanted, passed)
        return result

    return _NUMBER(types.int64, *kinds), code


def _call_linked(typing_context: Any, function: Any, c: Any, total: Any, memory: Any, p: Any) -> Any:
    return _calling(_LINKED, (c, _NUMBER, memory, p))


def _call_led(
    typing_context: Any, function: Any, z: Any, z_next: Any, v: Any, h: Any, level: Any, constants: Any, p: Any
) -> Any:
    return _calling(_LED, (z, z_next, _NUMBER, _NUMBER, _NUMBER, constants, p))


def _call_prepared(typing_context: Any, function: Any, constants: Any, p: Any) -> Any:
    return _calling(_PREPARED, (constants, p))


call_linked = cast(Callable[..., float], intrinsic(_call_linked))
"""``call_linked(function, c, total, memory, p)``: a :func:`linked` one, by its address; arrays may be addresses, too."""

call_led = cast(Callable[..., float], intrinsic(_call_led))
"""``call_led(function, z, z_next, v, h, level, constants, p)``: as :func:`call_linked`, one that is :func:`led`."""

call_prepared = cast(Callable[..., float], intrinsic(_call_prepared))
"""``call_prepared(function, constants, p)``: as :func:`call_linked`, one that is :func:`prepared`."""
