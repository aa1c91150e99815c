"""Groups of options: a frozen dataclass whose fields are options of a command, declared once for all verbs that take them.

A parameter of a command that is annotated with :class:`Group` is expanded into its fields, and the command gets the dataclass
back with what was given::

    @grouped
    def doctor(recordings: ..., reading: Annotated[Reading, Group("Recordings")] = Reading()) -> None: ...

A field declares its option by ``Annotated[type, typer.Option(...)]``, or by ``Annotated[type, Setting(...)]`` where the library
declares it. A field of a tuple becomes an option that may be repeated. Defaults are those of the parameter's own default, else
those of the fields.
"""

from __future__ import annotations

import copy
import functools
import inspect
from collections.abc import Callable
from dataclasses import MISSING, Field, dataclass, fields
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import typer
from fric.method_settings import Setting, declarations, parsed
from typer.models import OptionInfo

__all__ = ["Group", "grouped"]


@dataclass(frozen=True)
class Group:
    """Marks a parameter as a group of options.

    Attributes:
        panel: heading under which the help lists them.
    """

    panel: str


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """The command with its groups expanded, as typer takes it.

    Raises:
        TypeError: two options have one name, or a field is no option.
    """
    hints = get_type_hints(command, include_extras=True)
    expanded: dict[str, inspect.Parameter] = {}
    groups: dict[str, type[Any]] = {}
    for parameter in inspect.signature(command).parameters.values():
        hint = hints[parameter.name]
        marks = [each for each in get_args(hint)[1:] if isinstance(each, Group)] if get_origin(hint) is Annotated else []
        if marks:
            groups[parameter.name] = get_args(hint)[0]
            new = _options_of(groups[parameter.name], marks[0], parameter.default)
        else:
            new = [parameter.replace(annotation=hint, kind=inspect.Parameter.KEYWORD_ONLY)]
        for each in new:
            if each.name in expanded:
                raise TypeError(f"{command.__name__}: '{each.name}' is declared twice")
            expanded[each.name] = each

    @functools.wraps(command)
    def run(**given: Any) -> None:
        built = {
            name: _built(kind, {each.name: given.pop(each.name) for each in fields(kind)}) for name, kind in groups.items()
        }
        command(**given, **built)

    run.__signature__ = inspect.Signature(list(expanded.values()))  # type: ignore[attr-defined]
    run.__annotations__ = {name: each.annotation for name, each in expanded.items()}
    return run


def _options_of(kind: type[Any], group: Group, default: Any) -> list[inspect.Parameter]:
    hints = get_type_hints(kind, include_extras=True)
    return [_option_of(kind, each, hints[each.name], group, default) for each in fields(kind)]


def _option_of(kind: type[Any], each: Field[Any], hint: Any, group: Group, default: Any) -> inspect.Parameter:
    held, *marks = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    option = next((mark for mark in marks if isinstance(mark, (OptionInfo, Setting))), None)
    if option is None:
        raise TypeError(f"{kind.__name__}.{each.name} is no option: annotate it with typer.Option or Setting")
    value: Any = each.default if default is inspect.Parameter.empty else getattr(default, each.name)
    if get_origin(held) is tuple:
        held, value = list[str] | None, list(value) or None
    if isinstance(option, Setting):
        declared = declarations(kind)[each.name][1]
        option = typer.Option(declared.option, help=declared.help, show_default=value not in (None, "", 0, 0.0))
    option = copy.copy(option)
    option.rich_help_panel = option.rich_help_panel or group.panel
    return inspect.Parameter(
        each.name,
        inspect.Parameter.KEYWORD_ONLY,
        annotation=Annotated[held, option],
        default=inspect.Parameter.empty if value is MISSING else value,
    )


def _built(kind: type[Any], given: dict[str, Any]) -> Any:
    """The group from what was given: settings are read as the library declares them, lists become tuples."""
    hints = get_type_hints(kind, include_extras=True)
    for name, value in given.items():
        marks = get_args(hints[name])[1:]
        if any(isinstance(mark, Setting) for mark in marks):
            given[name] = parsed(name, value, kind)
        elif get_origin(get_args(hints[name])[0]) is tuple:
            given[name] = tuple(value or ())
    return kind(**given)
