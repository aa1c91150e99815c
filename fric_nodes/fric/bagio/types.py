"""Message types that recordings use, without ROS: the Jazzy types that rosbags ships and fric's own two stamped types.

The two definitions below repeat ``fric_interfaces/msg`` (a test compares them), because a bag must be writable and readable
where no ROS interface package is installed. Any other type is taken from the bag that is read, or, for writing, from the
``.msg`` files of the installed interface packages.
"""

from __future__ import annotations

import os
import sys
from functools import lru_cache
from pathlib import Path

from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat
from rosbags.interfaces.typing import Typesdict
from rosbags.typesys import Stores, TypesysError, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from .errors import WriteError

__all__ = [
    "ARRAYS",
    "DEFINITIONS",
    "FLOAT32",
    "FLOAT64",
    "JOINT_STATE",
    "JOINT_TYPES",
    "NUMBERS",
    "REFERENCE",
    "STAMPED_FORCE",
    "TRAJECTORY_STATE",
    "definition",
    "type_fields",
    "type_versions",
    "typestore",
]

JOINT_STATE = "sensor_msgs/msg/JointState"
FLOAT64 = "std_msgs/msg/Float64"
FLOAT32 = "std_msgs/msg/Float32"
NUMBERS = (FLOAT64, FLOAT32)
ARRAYS = ("std_msgs/msg/Float64MultiArray", "std_msgs/msg/Float32MultiArray")
TRAJECTORY_STATE = "control_msgs/msg/JointTrajectoryControllerState"
# Types from which position, velocity and effort of several joints can be read, the usual one first.
JOINT_TYPES = (
    JOINT_STATE,
    "control_msgs/msg/DynamicJointState",
    "control_msgs/msg/DynamicInterfaceGroupValues",
    TRAJECTORY_STATE,
)
STAMPED_FORCE = "fric_interfaces/msg/StampedForce"
REFERENCE = "fric_interfaces/msg/Reference"

DEFINITIONS: dict[str, str] = {
    STAMPED_FORCE: "std_msgs/Header header\nfloat64 force\n",
    REFERENCE: "std_msgs/Header header\nfloat64 position\nfloat64 velocity\nfloat64 acceleration\n",
}

_SEPARATOR = "=" * 80 + "\n"
_HEAD = "std_msgs/Header header\n"
_VALUE = _SEPARATOR + "MSG: control_msgs/InterfaceValue\nstring[] interface_names\nfloat64[] values\n"


def _trajectory_state(points: str, multi: str, further: str = "") -> str:
    """A definition of the state of a trajectory controller, which has one point for each word of ``points``."""
    single = "".join(f"trajectory_msgs/JointTrajectoryPoint {name}\n" for name in points.split())
    several = "".join(f"trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_{name}\n" for name in multi.split())
    return f"{_HEAD}string[] joint_names\n{single}{'string[] multi_dof_joint_names' if multi else ''}\n{several}{further}"


# Types of control_msgs for bags that do not define their types (SQLite3 up to Humble). Where a type has changed with the
# distribution all its versions are here, the newest first; that which fits the messages to the last byte is taken.
_NOW, _OLD = "reference feedback error output", "desired actual"
_CONTROL: dict[str, tuple[str, ...]] = {
    "control_msgs/msg/DynamicJointState": (f"{_HEAD}string[] joint_names\nInterfaceValue[] interface_values\n{_VALUE}",),
    "control_msgs/msg/DynamicInterfaceGroupValues": (
        f"{_HEAD}string[] interface_groups\nInterfaceValue[] interface_values\n{_VALUE}",
    ),
    TRAJECTORY_STATE: (
        _trajectory_state(_NOW, _NOW, "float64 speed_scaling_factor\n"),
        _trajectory_state(_NOW, _NOW),
        _trajectory_state(f"{_NOW} {_OLD}", f"{_NOW} {_OLD}"),
        _trajectory_state(f"{_OLD} error", ""),
    ),
}
_LONGEST_DEFINITION = 1 << 20  # characters; the longest of ROS 2 has some thousands, and a parser takes time for each


@lru_cache(maxsize=1)
def typestore() -> Typestore:
    """The Jazzy message types together with fric's own stamped types."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, text in DEFINITIONS.items():
        store.register(get_types_from_msg(text, name))
    return store


def _interface_file(msgtype: str) -> Path | None:
    """The ``.msg`` file of an installed interface package, looked for where ROS 2 installs them."""
    package, _, name = msgtype.partition("/msg/")
    prefixes = [Path(entry) for entry in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if entry]
    for prefix in [*prefixes, Path(sys.prefix)]:
        candidate = prefix / "share" / package / "msg" / f"{name}.msg"
        if name and candidate.is_file():
            return candidate
    return None


def _nested(types: Typesdict) -> set[str]:
    """Names of the message types that fields of ``types`` refer to."""
    found: set[str] = set()

    def visit(description: object) -> None:
        if isinstance(description, tuple):
            for part in description:
                visit(part)
        elif isinstance(description, str) and "/msg/" in description:
            found.add(description)

    for _, fields in types.values():
        for _, description in fields:
            visit(description)
    return found


def _collect(msgtype: str, into: Typesdict) -> None:
    """Add ``msgtype`` and everything it refers to, that the store does not know yet, to ``into``."""
    if msgtype in typestore().fielddefs or msgtype in into:
        return
    path = _interface_file(msgtype)
    if path is None:
        raise WriteError(
            msgtype,
            "definition of this message type is not known",
            "install the interface package that defines it, or record other topics",
        )
    types = get_types_from_msg(path.read_text(encoding="utf-8"), msgtype)
    into.update(types)
    for name in _nested(types):
        _collect(name, into)


def definition(msgtype: str) -> tuple[str, str]:
    """Text of a message definition with everything it refers to, and its RIHS01 hash.

    Args:
        msgtype: such as ``std_msgs/msg/Float64``.

    Raises:
        WriteError: the type is neither a Jazzy type, nor one of fric's, nor installed as a ``.msg`` file.
    """
    store = typestore()
    if msgtype not in store.fielddefs:
        missing: Typesdict = {}
        _collect(msgtype, missing)
        store.register(missing)
    text, _ = store.generate_msgdef(msgtype, ros_version=2)
    return text, store.hash_rihs01(msgtype)


@lru_cache(maxsize=2)
def _known(ros1: bool) -> Typesdict:
    """Types that need no definition in the bag; those of ROS 1 differ in the header, which is numbered."""
    return {**typestore().fielddefs, **get_typestore(Stores.ROS1_NOETIC).fielddefs} if ros1 else typestore().fielddefs


# What the library's parser lets through when a text is no definition.
_PARSER_ERRORS = (TypesysError, ValueError, LookupError, TypeError, AttributeError, AssertionError, RuntimeError)


@lru_cache(maxsize=256)
def _written(msgtype: str, text: str, idl: bool) -> Typesdict:
    """Types that a definition holds; none when it does not parse, which is no better than no definition."""
    if len(text) > _LONGEST_DEFINITION:
        return {}
    try:
        return get_types_from_idl(text) if idl else get_types_from_msg(text, msgtype)
    except _PARSER_ERRORS:
        return {}


def type_versions(msgtype: str, written: MessageDefinition | None = None, encoding: str = "cdr") -> list[Typesdict]:
    """Fields of a message type and of all types it may refer to; several where the type has changed and the bag does not say.

    The definition stored in the bag counts, since the type may have changed since the bag was recorded; without one the types
    known here do.

    Args:
        msgtype: such as ``sensor_msgs/msg/JointState``.
        written: definition stored in the bag.
        encoding: of the messages, ``cdr`` or ``ros1``.

    Raises:
        KeyError: the type is unknown and the bag does not define it.
    """
    known = _known(encoding == "ros1")
    if written is not None and written.data.strip():
        types = _written(msgtype, written.data, written.format == MessageDefinitionFormat.IDL)
        if msgtype in types:
            return [{**known, **types}]
    if msgtype in known:
        return [known]
    if msgtype in _CONTROL:
        return [{**known, **_written(msgtype, text, False)} for text in _CONTROL[msgtype]]
    raise KeyError(msgtype)


def type_fields(msgtype: str, written: MessageDefinition | None = None) -> Typesdict:
    """Fields of a message type and of all types it may refer to, see :func:`type_versions`.

    Raises:
        KeyError: the type is unknown and the bag does not define it.
    """
    return type_versions(msgtype, written)[0]
