"""Messages that hold several joints: which joints, and the signals of one of them.

Read by what a message holds, not by the name of its type, so that versions of a type are read alike:

* lists beside a list ``name`` (``sensor_msgs/JointState``): the signals are ``position``, ``velocity``, ``effort``;
* ``interface_values`` beside ``joint_names`` or ``interface_groups`` (``control_msgs/DynamicJointState`` and
  ``DynamicInterfaceGroupValues``): one list of interfaces with their values for each joint, the signals are the interfaces;
* trajectory points beside ``joint_names`` (``control_msgs/JointTrajectoryControllerState``): the signals are
  ``reference.position``, ``output.effort`` and so on; what was measured (``feedback``, formerly ``actual``) is also called
  ``position``, ``velocity`` and ``effort``.
"""

from __future__ import annotations

import numpy as np

from ..record import Array
from .decode import Block

__all__ = ["UnequalError", "joint_fields", "joint_names"]

_POINT = {"positions": "position", "velocities": "velocity", "accelerations": "acceleration", "effort": "effort"}
_MEASURED = ("feedback", "actual")


class UnequalError(Exception):
    """A list that does not hold one value for each joint."""

    def __init__(self, name: str, n_values: int, n_joints: int) -> None:
        super().__init__(f"{name} has {n_values} values for {n_joints} joints")


def joint_names(block: Block) -> list[str] | None:
    """Joints of these messages, numbered when they have no names; None when they are not of joints."""
    for key in ("name", "joint_names", "interface_groups"):
        names = block.strings.get(key)
        if isinstance(names, list):
            if key == "name" and not names and "position" in block.numbers and block.numbers["position"].ndim == 2:
                return [str(index) for index in range(block.numbers["position"].shape[1])]
            return [str(name) for name in names]
    return None


def joint_fields(block: Block, names: list[str], joint: str) -> dict[str, Array]:
    """Signals of one of the joints by name, each of shape ``(n_rows,)``; a signal that the messages do not have is left out.

    Raises:
        UnequalError: a list is neither empty nor of one value for each joint.
    """
    at = names.index(joint)
    if any(key.startswith("interface_values.") for key in (*block.strings, *block.numbers)):
        return _interfaces(block, at)
    fields: dict[str, Array] = {}
    for key, values in block.numbers.items():
        head, _, last = key.rpartition(".")
        if values.ndim != 2 or head.startswith("multi_dof"):
            continue
        if not head and last in {"position", "velocity", "effort"}:
            name = last
        elif head and "." not in head and last in _POINT:
            name = f"{head}.{_POINT[last]}"
        else:
            continue
        if values.shape[1] == len(names):
            fields[name] = np.asarray(values[:, at], dtype=np.float64)
        elif values.shape[1]:
            raise UnequalError(key, values.shape[1], len(names))
    for point in _MEASURED:
        measured = {name: fields[f"{point}.{name}"] for name in _POINT.values() if f"{point}.{name}" in fields}
        if measured:
            return {**fields, **measured}
    return fields


def _interfaces(block: Block, at: int) -> dict[str, Array]:
    names = block.strings.get(f"interface_values.{at}.interface_names")
    values = block.numbers.get(f"interface_values.{at}.values")
    if not isinstance(names, list) or values is None or values.ndim != 2:
        return {}
    if values.shape[1] != len(names):
        raise UnequalError("interface_values", values.shape[1], len(names))
    # Interfaces of a group may be named with the group before them: ``arm/position``.
    return {str(name).rpartition("/")[2]: np.asarray(values[:, k], dtype=np.float64) for k, name in enumerate(names)}
