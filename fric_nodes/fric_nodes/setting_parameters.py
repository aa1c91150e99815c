"""The settings that a method declares, as ROS parameters.

ROS parameters always have a value, so that "not given" needs one: the number 0 where the setting must be larger, one less than
its smallest value where 0 is allowed, and an empty text where it has no smallest value.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any

from fric.identification.online import EstimatorKind, OnlineOptions
from fric.method_settings import Options, Setting, declarations, parsed, value_type

from .parameters import NodeParameter, NodeParameterError, Settings

__all__ = ["estimator_options", "estimator_parameters", "of_setting", "setting_in"]


def of_setting(name: str, kind: type[Options], prefix: str = "") -> NodeParameter:
    """The ROS parameter ``prefix + name`` for a setting of the options ``kind``."""
    hint, setting = declarations(kind)[name]
    type_, optional = value_type(hint)
    default: Any = _default(name, kind)
    lower, doc = setting.lower, setting.doc[0].lower() + setting.doc[1:]
    if setting.positive:
        lower = max(lower, sys.float_info.min)
    if type_ is tuple:
        form = f"; written {setting.form}" if setting.read is not None else ""
        return NodeParameter(prefix + name, [str(each) for each in default] or [""], f"{doc}{form}")
    if optional:
        unset = _unset(type_, setting)
        lower = min(lower, unset) if isinstance(unset, (int, float)) else lower
        default = unset if default is None else str(default) if unset == "" else default
        doc = f"{doc}; {f'{unset:g}' if unset != '' else 'empty'}: {setting.unset or 'not set'}"
    numeric = isinstance(default, (int, float)) and not isinstance(default, bool)
    return NodeParameter(
        prefix + name, type_(default) if numeric else default, doc, setting.unit, lower if numeric else -math.inf,
        choices=setting.choices,
    )  # fmt: skip


def _default(name: str, kind: type[Options]) -> object:
    """What holds when a setting is not given."""
    return next(each.default for each in fields(kind) if each.name == name)


def _unset(type_: type, setting: Setting) -> int | float | str:
    """The value of the ROS parameter that stands for None."""
    if type_ not in (int, float) or (setting.lower == -math.inf and not setting.positive):
        return ""
    below = 0 if setting.positive or setting.lower > 0 else setting.lower - 1
    return int(below) if type_ is int else float(below)


def setting_in(settings: Settings, name: str, kind: type[Options], prefix: str = "") -> Any:
    """The value of a setting, from its ROS parameter.

    Raises:
        InputError: it can't be used.
    """
    hint, setting = declarations(kind)[name]
    type_, optional = value_type(hint)
    value = settings.texts(prefix + name) if type_ is tuple else settings.values()[prefix + name]
    if optional and value == _unset(type_, setting):
        return None
    return parsed(name, value, kind, f"parameter '{prefix}{name}'")


def _held(kinds: Iterable[EstimatorKind]) -> dict[str, tuple[str, type[Options], tuple[str, ...]]]:
    """Field, type of options and users of each setting, by the name of its parameter."""
    kinds = list(kinds)
    common = [name for name in declarations(OnlineOptions) if any(name in kind.uses for kind in kinds)]
    found: dict[str, tuple[str, type[Options], tuple[str, ...]]] = {
        name: (name, OnlineOptions, tuple(kind.id for kind in kinds if name in kind.uses)) for name in common
    }
    for kind in kinds:
        found |= {f"{kind.id}.{name}": (name, kind.settings, (kind.id,)) for name in kind.own}
    return found


def estimator_parameters(kinds: Mapping[str, EstimatorKind]) -> tuple[NodeParameter, ...]:
    """The parameters of all estimators: common settings by their name, an estimator's own ones as ``ESTIMATOR.NAME``."""
    held = _held(kinds.values())
    return tuple(of_setting(field, kind, parameter.removesuffix(field)) for parameter, (field, kind, _) in held.items())


def estimator_options(settings: Settings, kinds: Mapping[str, EstimatorKind], chosen: str) -> OnlineOptions:
    """The options of the estimator ``chosen``.

    Raises:
        InputError: a value can't be used, or was given for a setting that this estimator doesn't use.
    """
    given = {}
    for parameter, (field, kind, users) in _held(kinds.values()).items():
        value = setting_in(settings, field, kind, parameter.removesuffix(field))
        if chosen in users:
            given[field] = value
        elif value != _default(field, kind):
            said = f"is not used by the estimator {chosen}"
            raise NodeParameterError(f"parameter '{parameter}'", said, f"leave it out, or use {', '.join(users)}")
    return kinds[chosen].settings(**given)
