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
    "DEFINITIONS",
    "FLOAT64",
    "JOINT_STATE",
    "REFERENCE",
    "STAMPED_FORCE",
    "definition",
    "type_fields",
    "typestore",
]

JOINT_STATE = "sensor_msgs/msg/JointState"
FLOAT64 = "std_msgs/msg/Float64"
STAMPED_FORCE = "fric_interfaces/msg/StampedForce"
REFERENCE = "fric_interfaces/msg/Reference"

DEFINITIONS: dict[str, str] = {
    STAMPED_FORCE: "std_msgs/Header header\nfloat64 force\n",
    REFERENCE: "std_msgs/Header header\nfloat64 position\nfloat64 velocity\nfloat64 acceleration\n",
}


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


def type_fields(msgtype: str, written: MessageDefinition | None = None) -> Typesdict:
    """Fields of a message type and of all types it may refer to.

    The definition stored in the bag counts, since the type may have changed since the bag was recorded; without one the types
    known here do.

    Raises:
        KeyError: the type is unknown and the bag does not define it.
    """
    known = typestore().fielddefs
    if written is not None and written.data.strip():
        parse = get_types_from_idl if written.format == MessageDefinitionFormat.IDL else get_types_from_msg
        try:
            types = parse(written.data) if parse is get_types_from_idl else get_types_from_msg(written.data, msgtype)
        except TypesysError:
            types = {}  # a definition that does not parse is no better than none
        if msgtype in types:
            return {**known, **types}
    if msgtype not in known:
        raise KeyError(msgtype)
    return known
