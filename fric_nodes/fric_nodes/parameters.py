"""ROS parameters from one declaration each: type, unit, documentation, range or choices, default, and if it may be set later.

The declaration produces the ParameterDescriptor that ``ros2 param describe`` shows, and the check that every later change
passes.
"""

from __future__ import annotations

import difflib
import math
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from fric.errors import InputError
from fric.parameter import Parameter
from fric.record import Units
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

__all__ = ["NodeParameter", "NodeParameterError", "Settings", "from_declaration"]

_TYPE_NAMES: Mapping[type, str] = {bool: "bool", int: "integer", float: "double", str: "string", list: "string array"}
_OF_RCLPY = ("use_sim_time", "start_type_description_service", "qos_overrides.")
"""Parameters, or beginnings of their names, that every node of rclpy takes besides its own."""


class NodeParameterError(InputError):
    """A node parameter with a value that can't be used."""


@dataclass(frozen=True)
class NodeParameter:
    """One ROS parameter of a node.

    Attributes:
        name: as on the command line.
        default: value when none is given; its type is the parameter's type.
        doc: what it is, one sentence.
        unit: ``""`` for a text, a flag or a pure number.
        lower: smallest value allowed.
        upper: largest value allowed.
        choices: the texts allowed; empty allows any.
        settable: True when it may be changed while the node runs.
    """

    name: str
    default: bool | int | float | str | list[str]
    doc: str
    unit: str = ""
    lower: float = -math.inf
    upper: float = math.inf
    choices: tuple[str, ...] = ()
    settable: bool = False

    @property
    def type_name(self) -> str:
        """Name of the type, as ROS has it."""
        return _TYPE_NAMES[type(self.default)]

    @property
    def default_text(self) -> str:
        """The default as it is written on a command line."""
        if isinstance(self.default, bool):
            return str(self.default).lower()
        if isinstance(self.default, list):
            return f"[{', '.join(each for each in self.default if each)}]"
        return f"'{self.default}'" if isinstance(self.default, str) else repr(self.default)

    @property
    def allowed(self) -> str:
        """The values allowed, in words; empty: any."""
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        if self.lower == -math.inf and self.upper == math.inf:
            return ""
        if self.upper == math.inf:
            return f"at least {self.lower:g}"
        return f"from {self.lower:g} to {self.upper:g}"

    def descriptor(self) -> ParameterDescriptor:
        """What the node tells about the parameter."""
        described = ParameterDescriptor(name=self.name, read_only=not self.settable)
        described.description = f"{self.doc} [{self.unit}]" if self.unit else self.doc
        if self.choices:
            described.additional_constraints = f"one of {', '.join(self.choices)}"
        bounded = self.lower > -math.inf or self.upper < math.inf
        if bounded and isinstance(self.default, float):
            # The range message knows no infinity, so an open side gets the largest number there is.
            most = sys.float_info.max
            described.floating_point_range = [
                FloatingPointRange(from_value=max(self.lower, -most), to_value=min(self.upper, most))
            ]
        elif bounded and isinstance(self.default, int):
            most_int = 2**63 - 1
            lower, upper = max(self.lower, -most_int), min(self.upper, most_int)
            described.integer_range = [IntegerRange(from_value=int(lower), to_value=int(upper), step=1)]
        return described

    def refusal(self, value: Any) -> str | None:
        """Why ``value`` can't be used, or None when it can."""
        if isinstance(value, float) and not math.isfinite(value):
            return f"{self.name} is {value}, not a finite number"
        if isinstance(value, (int, float)) and not self.lower <= value <= self.upper:
            unit = f" {self.unit}" if self.unit else ""
            return f"{self.name} is {value:g}, must lie in [{self.lower:g}, {self.upper:g}]{unit}"
        if self.choices:
            for given in value if isinstance(value, list) else [value]:
                if given not in self.choices:
                    return f"{self.name} is '{given}', must be one of {', '.join(self.choices)}"
        return None


def from_declaration(parameter: Parameter, prefix: str, units: Units, settable: bool = False) -> NodeParameter:
    """The ROS parameter ``prefix.name`` for a parameter of the core, which must have a default.

    Raises:
        ValueError: the parameter has no default.
    """
    if parameter.default is None:
        raise ValueError(f"{prefix}.{parameter.name} has no default")
    lower = max(parameter.lower, sys.float_info.min) if parameter.positive else parameter.lower
    unit = parameter.unit(units)
    return NodeParameter(
        f"{prefix}.{parameter.name}", float(parameter.default), parameter.doc,
        "" if unit == "1" else unit, lower, parameter.upper, settable=settable,
    )  # fmt: skip


class Settings:
    """The declared parameters of a node, with their present values.

    Args:
        node: whose parameters they are.
        declarations: all of them.

    Raises:
        NodeParameterError: a value given at the start can't be used.
    """

    def __init__(self, node: Node, declarations: Iterable[NodeParameter]) -> None:
        self._declarations = {declaration.name: declaration for declaration in declarations}
        self._listeners: tuple[Callable[[set[str]], None], ...] = ()
        self._values: dict[str, Any] = {}
        self._whole_tests: tuple[Callable[[Mapping[str, Any]], object], ...] = ()
        for declaration in self._declarations.values():
            self._values[declaration.name] = self._declared(node, declaration)
        self._tests: dict[str, Callable[[Any], object]] = {}
        self._refuse_unknown(node)
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._adopt)

    @staticmethod
    def _declared(node: Node, declaration: NodeParameter) -> Any:
        where = f"parameter '{declaration.name}' of {node.get_fully_qualified_name()}"
        wanted = declaration.type_name + (" (write a decimal point)" if isinstance(declaration.default, float) else "")
        try:
            value = node.declare_parameter(declaration.name, declaration.default, declaration.descriptor()).value
        except InvalidParameterTypeException:
            raise NodeParameterError(where, "has the wrong type", f"give a {wanted}: {declaration.doc}") from None
        except InvalidParameterValueException:
            limits = f"give a value in [{declaration.lower:g}, {declaration.upper:g}] {declaration.unit}".rstrip()
            raise NodeParameterError(where, "is out of range", f"{limits}: {declaration.doc}") from None
        refusal = declaration.refusal(value)
        if refusal is not None:
            raise NodeParameterError(where, refusal, declaration.doc)
        return value

    def _refuse_unknown(self, node: Node) -> None:
        """Refuse what was given under a name that the node doesn't have, which rclpy leaves aside in silence."""
        for name in node._parameter_overrides:  # rclpy has no public way to ask for them
            if name in self._declarations or name.startswith(_OF_RCLPY):
                continue
            close = difflib.get_close_matches(name, self._declarations, n=1)
            remedy = f"did you mean '{close[0]}'?" if close else "--help lists the node's parameters"
            raise NodeParameterError(f"parameter '{name}' of {node.get_fully_qualified_name()}", "is not known", remedy)

    def _check(self, changes: list[RosParameter]) -> SetParametersResult:
        for change in changes:
            declaration = self._declarations.get(change.name)
            refusal = declaration.refusal(change.value) if declaration is not None else None
            if refusal is None and change.name in self._tests:
                try:
                    self._tests[change.name](change.value)
                except InputError as error:
                    refusal = " ".join(str(error).split())
            if refusal is not None:
                return SetParametersResult(successful=False, reason=refusal)
        return self._check_together({**self._values, **{change.name: change.value for change in changes}})

    def _check_together(self, values: Mapping[str, Any]) -> SetParametersResult:
        try:
            for test in self._whole_tests:
                test(values)
        except InputError as error:
            return SetParametersResult(successful=False, reason=" ".join(str(error).split()))
        return SetParametersResult(successful=True)

    def _adopt(self, changes: list[RosParameter]) -> None:
        changed = {change.name for change in changes if change.name in self._declarations}
        self._values.update({change.name: change.value for change in changes if change.name in changed})
        for listener in self._listeners:
            listener(changed)

    def test_before(self, name: str, test: Callable[[Any], object]) -> None:
        """Let ``test`` look at each new value of ``name`` before it counts; where it raises InputError, it is refused."""
        self._tests[name] = test

    def when_changed(self, listener: Callable[[set[str]], None]) -> None:
        """Call ``listener`` with the names of the parameters that have been set."""
        self._listeners += (listener,)

    def __contains__(self, name: str) -> bool:
        """True when the node has the parameter ``name``."""
        return name in self._declarations

    @property
    def listeners(self) -> tuple[tuple[Any, ...], ...]:
        """Who is told of changes and asked about them; set it to what it was to forget those that came since."""
        return self._listeners, self._whole_tests

    @listeners.setter
    def listeners(self, kept: tuple[tuple[Any, ...], ...]) -> None:
        self._listeners, self._whole_tests = kept

    def values(self) -> Mapping[str, Any]:
        """All values by name."""
        return dict(self._values)

    def test_together(self, test: Callable[[Mapping[str, Any]], object]) -> None:
        """Let ``test`` look at all values, by name, before a change counts; where it raises InputError, it is refused."""
        self._whole_tests += (test,)

    def number(self, name: str) -> float:
        """Value of a parameter of type double."""
        return float(self._values[name])

    def integer(self, name: str) -> int:
        """Value of a parameter of type integer."""
        return int(self._values[name])

    def flag(self, name: str) -> bool:
        """Value of a parameter of type bool."""
        return bool(self._values[name])

    def text(self, name: str) -> str:
        """Value of a parameter of type string."""
        return str(self._values[name])

    def texts(self, name: str) -> list[str]:
        """Value of a parameter of type string array."""
        return [str(value) for value in self._values[name] or [] if value != ""]
