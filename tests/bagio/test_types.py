"""The message types that bagio knows without ROS are those of the interface package."""

from __future__ import annotations

from pathlib import Path

import pytest
from fric.bagio import WriteError
from fric.bagio.types import DEFINITIONS, definition, type_fields
from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat
from rosbags.typesys import get_types_from_msg

MESSAGES = Path(__file__).parents[2] / "fric_interfaces" / "msg"


@pytest.mark.parametrize("msgtype", sorted(DEFINITIONS))
def test_definition_equals_msg_file(msgtype: str) -> None:
    file = MESSAGES / f"{msgtype.rsplit('/', 1)[-1]}.msg"
    in_package = get_types_from_msg(file.read_text(encoding="utf-8"), msgtype)
    here = get_types_from_msg(DEFINITIONS[msgtype], msgtype)
    assert here == in_package


def test_definition_carries_nested_types_and_ros_hash() -> None:
    text, digest = definition("sensor_msgs/msg/JointState")
    assert "MSG: builtin_interfaces/Time" in text
    # The hash that ROS 2 Jazzy itself gives this type.
    assert digest == "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"


def test_definition_is_found_in_an_installed_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "share" / "some_msgs" / "msg"
    folder.mkdir(parents=True)
    (folder / "Inner.msg").write_text("float64 value  # [N]\n")
    (folder / "Outer.msg").write_text("std_msgs/Header header\nInner[] parts\n")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    text, _ = definition("some_msgs/msg/Outer")
    assert "some_msgs/Inner[] parts" in text
    assert "MSG: some_msgs/Inner\nfloat64 value" in text


def test_unknown_type_is_refused_with_remedy() -> None:
    with pytest.raises(WriteError, match="nowhere_msgs/msg/None: definition of this message type is not known; install"):
        definition("nowhere_msgs/msg/None")


def test_definition_in_the_bag_counts() -> None:
    written = MessageDefinition(MessageDefinitionFormat.MSG, "float32 data\n")
    fields = type_fields("std_msgs/msg/Float64", written)["std_msgs/msg/Float64"][1]
    assert [name for name, _ in fields] == ["data"]
    assert "float32" in str(fields[0])
