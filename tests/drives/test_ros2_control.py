"""The mapping to and from ros2_control: joint order, gear ratio, what is missing."""

from __future__ import annotations

import math

import pytest
from fric.drives import DRIVES, DriveError
from fric.drives.drive import checked_options
from fric.drives.ros2_control import JointMap

JOINTS = JointMap(("shoulder", "elbow", "wrist"), "elbow", -50.0)


def test_the_order_of_a_joint_state_does_not_matter() -> None:
    reading = JOINTS.reading(7, ["wrist", "elbow"], [1.0, 100.0], [0.0, 5.0], [9.0, 0.2])
    assert reading[:4] == pytest.approx((7, -2.0, -0.1, -10.0))
    assert math.isnan(reading.temperature)


def test_power_is_the_same_on_both_sides_of_the_gear() -> None:
    reading = JOINTS.reading(0, ["elbow"], [0.0], [3.0], [0.4])
    assert reading.velocity * reading.effort == pytest.approx(3.0 * 0.4)
    point = JOINTS.point(0.0, reading.velocity, reading.effort)
    assert point.velocities[1] * point.effort[1] == pytest.approx(3.0 * 0.4)


def test_velocity_and_effort_may_be_missing() -> None:
    reading = JOINTS.reading(0, ["elbow"], [1.0], [], [])
    assert math.isnan(reading.velocity)
    assert math.isnan(reading.effort)


@pytest.mark.parametrize(("names", "positions"), [(["wrist"], [1.0]), ([], []), (["elbow"], [])])
def test_a_state_without_our_joint_or_its_position_is_refused(names: list[str], positions: list[float]) -> None:
    with pytest.raises(DriveError, match="elbow"):
        JOINTS.reading(0, names, positions, [], [])


def test_efforts_are_in_the_controller_s_order() -> None:
    assert JOINTS.efforts(10.0) == [0.0, -0.2, 0.0]
    assert JOINTS.efforts(10.0, [1.0, 2.0, 3.0]) == [1.0, -0.2, 3.0]


def test_a_trajectory_point_goes_back_where_the_reading_came_from() -> None:
    point = JOINTS.point(-2.0, -0.1, 10.0, others=[0.5, 0.0, 0.7])
    assert point.positions == [0.5, 100.0, 0.7]
    back = JOINTS.reading(0, JOINTS.joints, *point)
    assert back[1:4] == pytest.approx((-2.0, -0.1, 10.0))


def test_a_dynamic_joint_state_is_read_by_the_names_of_its_interfaces() -> None:
    interfaces = [(["position"], [9.0]), (["effort", "temperature", "position"], [0.2, 40.0, 100.0])]
    reading = JOINTS.dynamic_reading(3, ["wrist", "elbow"], interfaces)
    assert reading.position == -2.0
    assert reading.effort == pytest.approx(-10.0)
    assert math.isnan(reading.velocity)
    with pytest.raises(DriveError, match="no position"):
        JOINTS.dynamic_reading(3, ["elbow"], [(["effort"], [1.0])])
    with pytest.raises(DriveError, match="no joint 'elbow' among wrist"):
        JOINTS.dynamic_reading(3, ["wrist"], [(["position"], [1.0])])


@pytest.mark.parametrize(
    ("joints", "ratio", "named"),
    [(("a",), 1.0, "no joint"), (("b", "b"), 1.0, "twice"), (("b",), 0.0, "ratio"), (("b",), math.inf, "ratio")],
)
def test_a_map_that_makes_no_sense_is_refused(joints: tuple[str, ...], ratio: float, named: str) -> None:
    with pytest.raises(DriveError, match=named):
        JointMap(joints, "b", ratio)


class Topics:
    """Topics in memory."""

    def __init__(self) -> None:
        self.sent: list[list[float]] = []
        self.state: tuple[int, dict[str, tuple[float, float, float]]] | None = None

    def send(self, topic: str, values: list[float]) -> None:
        assert topic == "effort_controller/commands"
        self.sent.append(values)

    def newest(self) -> tuple[int, dict[str, tuple[float, float, float]]] | None:
        return self.state


def test_a_drive_sends_reads_each_state_once_and_says_when_none_comes() -> None:
    now, topics = 10**18, Topics()
    kind = DRIVES["ros2_control"]
    options = checked_options(kind, {"joint": "elbow", "joints": "wrist, elbow", "ratio": 2.0})
    drive = kind.make(options, lambda: now, topics)
    drive.open()
    assert drive.exchange(6.0) is None
    topics.state = (now, {"elbow": (4.0, 2.0, 3.0)})
    reading = drive.exchange(6.0)
    assert reading is not None
    assert reading[:4] == (now, 2.0, 1.0, 6.0)
    assert drive.exchange(6.0) is None
    now += 60_000_000
    with pytest.raises(DriveError, match=r"no joint state for 0\.06 s"):
        drive.exchange(6.0)
    drive.close()
    assert topics.sent == [[0.0, 3.0]] * 4 + [[0.0, 0.0]]
    drive.open()
    with pytest.raises(DriveError, match="finite"):
        drive.exchange(math.nan)
