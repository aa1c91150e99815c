"""Which number of a message is meant: a topic may be given as ``NAME:SELECTION``.

A selection is the index of a value in the message's list (from 0), the joints in the order of the list's values
(``:shoulder,elbow``), or the dotted name of a field (``:wrench.force.z``, ``:output.effort``), with an index after it where the
field is a list (``:values.2``). Behind a topic of single numbers it names the joint that they are about. Topic names hold no
colon, and a shell leaves it alone.

Without a selection a number is taken only where there is nothing to choose: a message of one number, in a bag of one joint.
Which value belongs to which joint is known to the controller's configuration alone, so that nothing is assumed about it.
"""

from __future__ import annotations

import numpy as np

from ..record import Array
from .decode import Block
from .joints import joint_fields, joint_names

__all__ = ["SelectionError", "select", "split_topic"]

_EFFORTS = ("output.effort", "effort")  # of a joint, where a message has several signals that could be meant
_SHOWN = 12  # choices listed


class SelectionError(Exception):
    """No number, or no single one, fits; ``choices`` are selections that would do."""

    def __init__(self, problem: str, choices: list[str]) -> None:
        self.choices = choices[:_SHOWN]
        super().__init__(problem)


def split_topic(text: str) -> tuple[str, str]:
    """Name of a topic and the selection behind it; the selection is empty where there is none."""
    name, _, selection = text.partition(":")
    return name.strip(), selection.strip()


def select(block: Block, selection: str, joint: str, certain: bool) -> Array | None:
    """The number that is meant, of shape ``(n_rows,)``; None when these messages are about other joints only.

    Args:
        block: decoded messages.
        selection: see above; empty: the only one there is.
        joint: name of the joint.
        certain: True when a single value can only be about this joint.

    Raises:
        SelectionError: there is no such number, or nothing says which.
        UnequalError: lists of a message that do not fit its joints.
    """
    names = joint_names(block)
    if names is not None:
        return _of_joint(block, names, selection, joint)
    numbers = {key: values for key, values in block.numbers.items() if not key.startswith(("header.", "layout."))}
    scalars = [key for key, values in numbers.items() if values.ndim == 1]
    lists = [key for key, values in numbers.items() if values.ndim == 2]
    if not selection:
        if len(scalars) == 1 and not lists and certain:
            return _float(numbers[scalars[0]])
        if len(lists) == 1 and not scalars and numbers[lists[0]].shape[1] == 1 and certain:
            return _float(numbers[lists[0]][:, 0])
        raise SelectionError(_unclear(numbers, scalars, lists, joint), _choices(numbers, scalars, lists, joint))
    if selection in scalars:
        return _float(numbers[selection])
    if len(scalars) == 1 and not lists:
        if selection != joint:
            raise SelectionError(f"is of joint '{selection}', as was said, and not of joint '{joint}'", [joint])
        return _float(numbers[scalars[0]])
    field, index = _place(numbers, lists, selection, joint)
    return _float(numbers[field][:, index])


def _of_joint(block: Block, names: list[str], selection: str, joint: str) -> Array | None:
    if joint not in names:
        return None
    fields = joint_fields(block, names, joint)
    wanted = (selection,) if selection else _EFFORTS
    for key in wanted:
        if key in fields:
            return fields[key]
    raise SelectionError(f"has no {wanted[0]} of joint '{joint}'", sorted(fields))


def _place(numbers: dict[str, Array], lists: list[str], selection: str, joint: str) -> tuple[str, int]:
    """Field and index that a selection stands for."""
    choices = _choices(numbers, [key for key in numbers if key not in lists], lists, joint)
    field, _, last = selection.rpartition(".")
    order = [name.strip() for name in selection.split(",")]
    if selection in lists and numbers[selection].shape[1] == 1:
        return selection, 0
    if field in lists and last.isdecimal():
        index = int(last)
    elif len(lists) == 1 and (selection.isdecimal() or joint in order):
        field = lists[0]
        if not selection.isdecimal() and len(order) != numbers[field].shape[1]:
            raise SelectionError(f"has {numbers[field].shape[1]} values, not one for each of {selection}", choices)
        index = int(selection) if selection.isdecimal() else order.index(joint)
    elif len(lists) == 1 and len(order) == numbers[lists[0]].shape[1]:
        raise SelectionError(f"holds the joints {selection}, as was said, and not joint '{joint}'", choices)
    else:
        raise SelectionError(f"has no '{selection}'", choices)
    if index >= numbers[field].shape[1]:
        raise SelectionError(f"has {numbers[field].shape[1]} values, none with the index {index} (from 0)", choices)
    return field, index


def _unclear(numbers: dict[str, Array], scalars: list[str], lists: list[str], joint: str) -> str:
    if len(lists) + len(scalars) == 1:
        size = numbers[lists[0]].shape[1] if lists else 1
        if size == 1:
            return f"has one value in a message, and nothing says that it is that of joint '{joint}'"
        return f"has {size} values in a message, and nothing says which is that of joint '{joint}'"
    return "has several numbers in a message" if scalars or lists else "has no number in a message"


def _choices(numbers: dict[str, Array], scalars: list[str], lists: list[str], joint: str) -> list[str]:
    if len(scalars) == 1 and not lists:
        return [joint]
    if len(lists) == 1 and not scalars:
        size = numbers[lists[0]].shape[1]
        return [*(str(k) for k in range(min(size, _SHOWN - 1))), ",".join([joint, *(f"JOINT{k}" for k in range(2, size + 1))])]
    return [*scalars, *(f"{key}.{k}" for key in lists for k in range(numbers[key].shape[1]))]


def _float(values: Array) -> Array:
    return np.asarray(values, dtype=np.float64)
