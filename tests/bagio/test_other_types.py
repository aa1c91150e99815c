"""Commands as lists, and the message types of ros2_control, read by the definition in the bag or by a known one."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fric.bagio import BagError, Topics, read_record
from fric.bagio.read import joint_list
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

START = 1_700_000_000_000_000_000
MS = 1_000_000
JS, ARRAY, WRENCH = "sensor_msgs/msg/JointState", "std_msgs/msg/Float64MultiArray", "geometry_msgs/msg/WrenchStamped"
DYNAMIC, STATE = "control_msgs/msg/DynamicJointState", "control_msgs/msg/JointTrajectoryControllerState"
POINT = "trajectory_msgs/msg/JointTrajectoryPoint"
N = 100


class Control:
    """Messages of ros2_control, by definitions written out here."""

    def __init__(self) -> None:
        self.store = get_typestore(Stores.ROS2_JAZZY)
        head = "std_msgs/Header header\nstring[] joint_names\n"
        self.register("control_msgs/msg/InterfaceValue", "string[] interface_names\nfloat64[] values\n")
        self.register(DYNAMIC, head + "control_msgs/InterfaceValue[] interface_values\n")
        points = "".join(
            f"trajectory_msgs/JointTrajectoryPoint {name}\n" for name in ("reference", "feedback", "error", "output")
        )
        multi = points.replace("JointTrajectoryPoint ", "MultiDOFJointTrajectoryPoint multi_dof_")
        self.register(STATE, f"{head}{points}string[] multi_dof_joint_names\n{multi}float64 speed_scaling_factor\n")

    def register(self, name: str, text: str) -> None:
        self.store.register(get_types_from_msg(text, name))

    def header(self, now: int) -> Any:
        time = self.store.types["builtin_interfaces/msg/Time"](sec=now // 10**9, nanosec=now % 10**9)
        return self.store.types["std_msgs/msg/Header"](stamp=time, frame_id="")

    def pack(self, msgtype: str, **fields: Any) -> bytes:
        return bytes(self.store.serialize_cdr(self.store.types[msgtype](**fields), msgtype))

    def array(self, values: list[float]) -> bytes:
        layout = self.store.types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
        return self.pack(ARRAY, layout=layout, data=np.array(values))

    def joint_state(self, now: int, names: list[str], position: list[float], effort: list[float]) -> bytes:
        numbers = {"position": position, "velocity": [], "effort": effort}
        arrays = {name: np.array(values, dtype=np.float64) for name, values in numbers.items()}
        return self.pack(JS, header=self.header(now), name=names, **arrays)

    def dynamic(self, now: int, joints: dict[str, dict[str, float]]) -> bytes:
        kind = self.store.types["control_msgs/msg/InterfaceValue"]
        values = [kind(interface_names=list(each), values=np.array(list(each.values()))) for each in joints.values()]
        return self.pack(DYNAMIC, header=self.header(now), joint_names=list(joints), interface_values=values)

    def state(self, now: int, names: list[str], measured: list[float], wanted: list[float], output: list[float]) -> bytes:
        def point(positions: list[float], effort: list[float]) -> Any:
            zero = self.store.types["builtin_interfaces/msg/Duration"](sec=0, nanosec=0)
            empty = np.zeros(0)
            return self.store.types[POINT](
                positions=np.array(positions),
                velocities=empty,
                accelerations=empty,
                effort=np.array(effort),
                time_from_start=zero,
            )

        zero = self.store.types["builtin_interfaces/msg/Duration"](sec=0, nanosec=0)
        multi = self.store.types["trajectory_msgs/msg/MultiDOFJointTrajectoryPoint"](
            transforms=[], velocities=[], accelerations=[], time_from_start=zero
        )
        return self.pack(
            STATE,
            header=self.header(now),
            joint_names=names,
            reference=point(wanted, []),
            feedback=point(measured, []),
            error=point([], []),
            output=point([], output),
            multi_dof_joint_names=[],
            multi_dof_reference=multi,
            multi_dof_feedback=multi,
            multi_dof_error=multi,
            multi_dof_output=multi,
            speed_scaling_factor=1.0,
        )

    def wrench(self, now: int, z: float) -> bytes:
        vector = self.store.types["geometry_msgs/msg/Vector3"]
        wrench = self.store.types["geometry_msgs/msg/Wrench"](
            force=vector(x=1.0, y=2.0, z=z), torque=vector(x=0.0, y=0.0, z=0.5)
        )
        return self.pack(WRENCH, header=self.header(now), wrench=wrench)


CONTROL = Control()


def write(path: Path, rows: list[tuple[str, str, int, bytes]], storage: str = "mcap") -> Path:
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        known: dict[str, Any] = {}
        for topic, msgtype, now, data in sorted(rows, key=lambda row: row[2]):
            if topic not in known:
                known[topic] = writer.add_connection(topic, msgtype, typestore=CONTROL.store)
            writer.write(known[topic], now, data)
    return path


def times() -> list[int]:
    return [START + k * MS for k in range(N)]


def states(names: list[str], effort: float | None = None) -> list[tuple[str, str, int, bytes]]:
    def efforts() -> list[float]:
        return [] if effort is None else [effort] * len(names)

    return [
        ("/joint_states", JS, now, CONTROL.joint_state(now, names, [k * 1e-3] * len(names), efforts()))
        for k, now in enumerate(times())
    ]


def commands(topic: str, width: int) -> list[tuple[str, str, int, bytes]]:
    """Value number i of message number k is 10 i + k."""
    return [(topic, ARRAY, now, CONTROL.array([10.0 * i + k for i in range(width)])) for k, now in enumerate(times())]


RAMP = np.arange(float(N))


# Commands as lists of numbers


def test_a_single_effort_command_of_a_single_joint_is_taken(tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", states(["axis"]) + commands("/effort_controller/commands", 1))
    record = read_record(bag)
    np.testing.assert_array_equal(record.effort, RAMP)
    assert record.effort_hold == "following"
    assert any("taken from /effort_controller/commands" in note and "no topic /force_command" in note for note in record.notes)
    named = read_record(bag, topics=Topics(force_command="/effort_controller/commands"))
    np.testing.assert_array_equal(named.effort, RAMP)


@pytest.mark.parametrize("effort", [0.0, np.nan])
def test_it_is_taken_where_the_effort_is_zero_or_nan(tmp_path: Path, effort: float) -> None:
    bag = write(tmp_path / "bag", states(["axis"], effort) + commands("/effort_controller/commands", 1))
    np.testing.assert_array_equal(read_record(bag).effort, RAMP)


@pytest.mark.parametrize("topic", ["/forward_command_controller/commands", "/gripper/command"])
def test_a_command_of_unknown_quantity_is_named_and_not_taken(tmp_path: Path, topic: str) -> None:
    bag = write(tmp_path / "bag", states(["axis"]) + commands(topic, 1))
    with pytest.raises(BagError) as caught:
        read_record(bag)
    assert caught.value.remedy == f"if it does, say so: --topic force_command={topic}"
    np.testing.assert_array_equal(read_record(bag, topics=Topics(force_command=topic)).effort, RAMP)


@pytest.mark.parametrize("topic", ["/position_controller/commands", "/forward_velocity_controller/commands"])
def test_a_command_of_another_quantity_is_no_force(tmp_path: Path, topic: str) -> None:
    bag = write(tmp_path / "bag", states(["axis"]) + commands(topic, 1))
    with pytest.raises(BagError, match=r"none for joint 'axis' and there is no topic /force_command"):
        read_record(bag)


def test_several_values_need_an_order(tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", states(["a", "b"]) + commands("/effort_controller/commands", 2))
    topic = "/effort_controller/commands"
    for topics in (Topics(), Topics(force_command=topic)):
        with pytest.raises(BagError, match="has 2 values in a message, and nothing says which is that of joint 'b'") as caught:
            read_record(bag, joint="b", topics=topics)
        assert f"{topic}:0, {topic}:1, {topic}:b,JOINT2" in caught.value.remedy
        assert "\n" not in str(caught.value)
    for selection in ("1", "a,b", "data.1", " a , b "):
        record = read_record(bag, joint="b", topics=Topics(force_command=f"{topic}:{selection}"))
        np.testing.assert_array_equal(record.effort, 10.0 + RAMP)


@pytest.mark.parametrize(
    ("selection", "problem"),
    [
        ("2", "has 2 values, none with the index 2"),
        ("a,b,c", "has 2 values, not one for each of a,b,c"),
        ("x,y", "holds the joints x,y, as was said, and not joint 'b'"),
        ("torque", "has no 'torque'"),
    ],
)
def test_a_wrong_order_is_refused(tmp_path: Path, selection: str, problem: str) -> None:
    bag = write(tmp_path / "bag", states(["a", "b"]) + commands("/effort_controller/commands", 2))
    with pytest.raises(BagError, match=problem):
        read_record(bag, joint="b", topics=Topics(force_command=f"/effort_controller/commands:{selection}"))


def test_one_value_for_one_of_several_joints_has_to_be_named(tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", states(["a", "b"]) + commands("/effort_controller/commands", 1))
    topic = "/effort_controller/commands"
    for topics in (Topics(), Topics(force_command=topic)):
        with pytest.raises(
            BagError, match="has one value in a message, and nothing says that it is that of joint 'a'"
        ) as caught:
            read_record(bag, joint="a", topics=topics)
        assert f"{topic}:0, {topic}:a" in caught.value.remedy
    for selection in ("0", "a"):
        record = read_record(bag, joint="a", topics=Topics(force_command=f"{topic}:{selection}"))
        np.testing.assert_array_equal(record.effort, RAMP)
    with pytest.raises(BagError, match="holds the joints a, as was said, and not joint 'b'"):
        read_record(bag, joint="b", topics=Topics(force_command=f"{topic}:a"))


def test_several_controllers_are_listed(tmp_path: Path) -> None:
    rows = states(["axis"]) + commands("/left_effort/commands", 1) + commands("/right_effort/commands", 1)
    with pytest.raises(BagError, match="may be on one of /left_effort/commands, /right_effort/commands; name its topic"):
        read_record(write(tmp_path / "bag", rows))


def test_a_topic_that_was_named_has_to_be_there(tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", states(["axis"], 1.0))
    with pytest.raises(BagError, match="no topic /typo in the bag"):
        read_record(bag, topics=Topics(temperature="/typo"))


# Effort that is not there


def test_nan_effort_without_a_command_names_a_remedy_that_works(tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", states(["axis"], np.nan))
    for repair in (False, True):
        with pytest.raises(BagError, match=r"not finite .* at 100 of 100 samples .* no topic /force_command") as caught:
            read_record(bag, repair=repair)
        assert "--repair" not in str(caught.value)
    with_command = write(tmp_path / "more", states(["axis"], np.nan) + commands("/somewhere/else", 1))
    record = read_record(with_command, topics=Topics(force_command="/somewhere/else"))
    np.testing.assert_array_equal(record.effort, RAMP)
    assert any("not finite" in note and "taken from /somewhere/else" in note for note in record.notes)


def test_some_nan_in_the_effort_is_a_fault_of_the_recording(tmp_path: Path) -> None:
    rows = states(["axis"], np.nan)
    good = [
        (topic, kind, now, CONTROL.joint_state(now, ["axis"], [k * 1e-3], [float(k)]))
        for k, (topic, kind, now, _) in enumerate(rows)
    ]
    bag = write(tmp_path / "bag", rows[:20] + good[20:] + commands("/force_command", 1))
    with pytest.raises(BagError, match=r"effort is not finite .* at 20 of 100 samples"):
        read_record(bag)


def test_position_that_is_never_finite(tmp_path: Path) -> None:
    rows = [("/joint_states", JS, now, CONTROL.joint_state(now, ["axis"], [np.nan], [1.0])) for now in times()]
    bag = write(tmp_path / "bag", rows)
    for repair in (False, True):
        with pytest.raises(BagError, match=r"position of joint 'axis' is not finite .* at any of 100 samples; choose another"):
            read_record(bag, repair=repair)


# Types of ros2_control


def dynamic_rows() -> list[tuple[str, str, int, bytes]]:
    return [
        (
            "/dynamic_joint_states",
            DYNAMIC,
            now,
            CONTROL.dynamic(
                now, {"a": {"position": k * 1e-3, "effort": 2.0 * k}, "b": {"temperature": 20.0, "position": -1.0}}
            ),
        )
        for k, now in enumerate(times())
    ]


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_dynamic_joint_states(tmp_path: Path, storage: str) -> None:
    bag = write(tmp_path / "bag", dynamic_rows(), storage)
    record = read_record(bag, joint="a")
    np.testing.assert_array_equal(record.position, RAMP * 1e-3)
    np.testing.assert_array_equal(record.effort, 2.0 * RAMP)
    assert any("/dynamic_joint_states" in note and "read in its place" in note for note in record.notes)
    with pytest.raises(BagError, match="none for joint 'b'"):
        read_record(bag, joint="b")
    assert joint_list(bag) == ["a", "b"]


def test_dynamic_joint_states_of_a_bag_without_definitions(tmp_path: Path) -> None:
    folder = write(tmp_path / "bag", dynamic_rows(), "sqlite3")
    lone = tmp_path / "lone.db3"
    shutil.copy(folder / "bag.db3", lone)
    connection = sqlite3.connect(lone)
    connection.execute("DELETE FROM message_definitions")
    connection.commit()
    connection.close()
    np.testing.assert_array_equal(read_record(lone, joint="a").effort, 2.0 * RAMP)


@pytest.mark.parametrize("defined", [True, False])
def test_state_of_a_trajectory_controller(tmp_path: Path, defined: bool) -> None:
    rows = [
        (
            "/arm_controller/controller_state",
            STATE,
            now,
            CONTROL.state(now, ["a", "b"], [1.0, k * 1e-3], [0.0, k * 2e-3], [5.0, 3.0 * k]),
        )
        for k, now in enumerate(times())
    ]
    bag = write(tmp_path / "bag", rows, "sqlite3")
    if not defined:
        bag = bag / "bag.db3"
        connection = sqlite3.connect(bag)
        connection.execute("DELETE FROM message_definitions")
        connection.commit()
        connection.close()
    record = read_record(bag, joint="b")
    np.testing.assert_array_equal(record.position, RAMP * 1e-3)
    assert record.reference is not None
    np.testing.assert_array_equal(record.reference, RAMP * 2e-3)
    np.testing.assert_array_equal(record.effort, 3.0 * RAMP)  # what the controller gives out, held until the next
    assert record.effort_hold == "following"
    both = write(tmp_path / "both", rows + states(["a", "b"], 0.0))
    other = read_record(both, joint="b", topics=Topics(force_command="/arm_controller/controller_state"))
    np.testing.assert_array_equal(other.effort, 3.0 * RAMP)
    given = Topics(effort="/arm_controller/controller_state:output.effort", reference="/arm_controller/controller_state")
    measured = read_record(both, joint="b", topics=given)
    np.testing.assert_allclose(measured.effort, 3.0 * RAMP)
    assert measured.reference is not None


def test_a_force_sensor_by_its_axis(tmp_path: Path) -> None:
    # Read half as often as the joint, and half a sample later: between its messages on the straight line.
    rows = states(["axis"], 9.0)
    for k in range(0, N, 2):
        at = START + k * MS + MS // 2
        rows.append(("/ft/wrench", WRENCH, at, CONTROL.wrench(at, k + 0.5)))
    bag = write(tmp_path / "bag", rows)
    record = read_record(bag, topics=Topics(effort="/ft/wrench:wrench.force.z", normal_load="/ft/wrench:wrench.force.y"))
    good = record.mask
    np.testing.assert_allclose(record.effort[good], RAMP[good], atol=1e-9)
    assert 95 <= int(good.sum()) < N
    assert record.effort_hold == "linear"
    np.testing.assert_array_equal(record.extra["normal_load"], np.full(N, 2.0))
    with pytest.raises(BagError, match="has several numbers in a message") as caught:
        read_record(bag, topics=Topics(effort="/ft/wrench"))
    assert "/ft/wrench:wrench.force.z" in caught.value.remedy
