"""Foreign and own recordings, read into records; all bags here are written with plain rosbags."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fric.bagio import BagError, Topics, bag_info, iterate_raw, read_record, read_series
from fric.record import Units

START = 1_700_000_000_000_000_000
MS = 1_000_000
JS, F64 = "sensor_msgs/msg/JointState", "std_msgs/msg/Float64"
FORCE, REF = "fric_interfaces/msg/StampedForce", "fric_interfaces/msg/Reference"
STORAGES = [("mcap", "none"), ("mcap", "storage"), ("mcap", "message"), ("mcap", "file")]
STORAGES += [("sqlite3", "none"), ("sqlite3", "message"), ("sqlite3", "file")]


@pytest.mark.parametrize(("storage", "compression"), STORAGES)
def test_foreign_bag_in_every_storage(write_bag: Any, joint_rows: Any, storage: str, compression: str) -> None:
    record = read_record(write_bag(joint_rows(), storage=storage, compression=compression))
    np.testing.assert_allclose(record.time, np.arange(100) * 1e-3, atol=1e-12)
    np.testing.assert_array_equal(record.position, np.arange(100) * 1e-3)
    np.testing.assert_array_equal(record.effort, np.arange(100) * 2.0)
    assert (record.joint, record.effort_hold, record.units) == ("axis", "unknown", Units("m", "N"))
    assert record.velocity is None
    assert record.reference is None
    assert record.valid is None
    assert record.notes == ("the recording does not state its units: m and N assumed",)


@pytest.mark.parametrize(("storage", "compression"), [("mcap", "storage"), ("sqlite3", "none"), ("sqlite3", "message")])
def test_lone_storage_file(write_bag: Any, joint_rows: Any, storage: str, compression: str) -> None:
    folder = write_bag(joint_rows(), storage=storage, compression=compression)
    (file,) = [path for path in folder.iterdir() if path.suffix in {".mcap", ".db3"}]
    assert read_record(file).effort[-1] == 198.0


def test_folder_without_metadata_says_so(write_bag: Any, joint_rows: Any) -> None:
    folder = write_bag(joint_rows())
    (folder / "metadata.yaml").unlink()
    record = read_record(folder)
    assert record.n_samples == 100
    assert "metadata.yaml is missing" in record.notes[0]


def test_several_joints_need_a_choice(write_bag: Any, ros: Any) -> None:
    rows = [
        ("/joint_states", JS, START + k * MS, ros.joint_state(START + k * MS, ["a", "b"], [k, 10 + k], [1, 2], [3 * k, -k]))
        for k in range(20)
    ]
    bag = write_bag(rows)
    with pytest.raises(BagError, match=r"several joints: a, b; choose one with --joint NAME"):
        read_record(bag)
    with pytest.raises(BagError, match=r"no joint 'c'; joints there: a, b"):
        read_record(bag, joint="c")
    record = read_record(bag, joint="b")
    np.testing.assert_array_equal(record.position, 10.0 + np.arange(20))
    np.testing.assert_array_equal(record.effort, -1.0 * np.arange(20))
    np.testing.assert_array_equal(record.velocity, np.full(20, 2.0))  # type: ignore[arg-type]


def test_two_publishers_on_one_topic(write_bag: Any, ros: Any) -> None:
    rows = []
    for k in range(40):
        stamp = START + k * MS
        rows.append(("/joint_states", JS, stamp, ros.joint_state(stamp, ["arm"], [k], [], [k])))
        rows.append(("/joint_states", JS, stamp + 1, ros.joint_state(stamp, ["leg"], [-k], [], [7.0])))
    record = read_record(write_bag(rows), joint="leg")
    assert record.n_samples == 40
    np.testing.assert_array_equal(record.position, -1.0 * np.arange(40))


def test_messages_out_of_order_in_the_file(write_bag: Any, joint_rows: Any) -> None:
    rows = joint_rows()
    rows[10], rows[60] = rows[60], rows[10]
    np.testing.assert_array_equal(read_record(write_bag(rows)).position, np.arange(100) * 1e-3)
    # Read record by record, they come in the order of the file.
    folder = write_bag(rows, name="lone", storage="sqlite3")
    np.testing.assert_array_equal(read_record(folder / "lone.db3").position, np.arange(100) * 1e-3)


def test_zero_stamps_fall_back_on_reception(write_bag: Any, joint_rows: Any) -> None:
    record = read_record(write_bag(joint_rows(stamps=[0] * 100)))
    np.testing.assert_allclose(np.diff(record.time), 1e-3, atol=1e-12)
    assert "all header stamps are zero: time of reception used" in record.notes


def test_time_of_reception_on_request(write_bag: Any, joint_rows: Any) -> None:
    stamps = [START + k * 2 * MS for k in range(100)]
    assert read_record(write_bag(joint_rows(stamps=stamps))).sample_time == pytest.approx(2e-3)
    assert read_record(write_bag(joint_rows(stamps=stamps), name="b"), time="log").sample_time == pytest.approx(1e-3)


def test_topic_under_a_namespace(write_bag: Any, joint_rows: Any) -> None:
    bag = write_bag(joint_rows(topic="/left/joint_states"))
    assert any("/left/joint_states was read in its place" in note for note in read_record(bag).notes)
    both = write_bag(joint_rows(topic="/left/joint_states") + joint_rows(topic="/right/joint_states"), name="both")
    with pytest.raises(BagError, match=r"several that end like it: /left/joint_states, /right/joint_states"):
        read_record(both)
    assert read_record(both, topics=Topics(joint_states="/right/joint_states")).n_samples == 100


def test_topics_of_one_axis_stay_together(write_bag: Any, ros: Any, joint_rows: Any) -> None:
    rows = []
    for k, axis in enumerate(("left", "right")):
        rows += joint_rows(effort=None, topic=f"/{axis}/joint_states")
        rows += [(f"/{axis}/force_command", F64, START, ros.float64(1.0 + k))]
    bag = write_bag(rows)
    record = read_record(bag, topics=Topics(joint_states="/right/joint_states", force_command="/right/force_command"))
    assert set(record.effort) == {2.0}
    with pytest.raises(BagError, match="several that end like it: /left/force_command, /right/force_command"):
        read_record(bag, topics=Topics(joint_states="/right/joint_states"))
    alone = write_bag([row for row in rows if not row[0].startswith("/left/joint")], name="alone")
    assert set(read_record(alone).effort) == {2.0}


def commanded(ros: Any, joint_rows: Any, stamped: bool, shift_ns: int = 0) -> Any:
    """Joint states without effort each ms, commands each 4 ms from 8 ms on: 0, 1, 2 ... N."""
    rows = joint_rows(effort=None, stamps=[START + shift_ns + k * MS for k in range(100)])
    for j in range(23):
        log = START + (8 + 4 * j) * MS
        data = ros.force(log + shift_ns, float(j)) if stamped else ros.float64(float(j))
        rows.append(("/force_command", FORCE if stamped else F64, log, data))
    return rows


@pytest.mark.parametrize("stamped", [False, True])
@pytest.mark.parametrize("shift_ns", [0, -START])
def test_effort_from_held_commands(write_bag: Any, ros: Any, joint_rows: Any, stamped: bool, shift_ns: int) -> None:
    # With the shift the stamps are those of a simulated clock, so only equal clocks may be compared.
    record = read_record(write_bag(commanded(ros, joint_rows, stamped, shift_ns)))
    np.testing.assert_array_equal(record.position, np.arange(8, 100) * 1e-3)
    np.testing.assert_array_equal(record.effort, np.repeat(np.arange(23.0), 4))
    assert record.effort_hold == "following"
    notes = " | ".join(record.notes)
    assert "has no effort: taken from /force_command" in notes
    assert "8 samples before the first force command left out" in notes


@pytest.mark.parametrize("time", ["stamp", "log"])
def test_stamped_commands_beside_unstamped_joint_states(write_bag: Any, ros: Any, joint_rows: Any, time: Any) -> None:
    rows = joint_rows(effort=None, stamps=[0] * 100)
    for j in range(25):
        # On another clock than that of the recorder, so that its stamps say nothing here.
        rows.append(("/force_command", FORCE, START + 4 * j * MS, ros.force(5_000_000_000 + j, float(j))))
    record = read_record(write_bag(rows), time=time)
    np.testing.assert_array_equal(record.effort, np.repeat(np.arange(25.0), 4))


def test_commands_that_stop_mark_the_rest(write_bag: Any, ros: Any, joint_rows: Any) -> None:
    rows = joint_rows(200, effort=None)
    rows += [("/force_command", F64, START + k * MS, ros.float64(1.0)) for k in range(101)]
    record = read_record(write_bag(rows))
    # Held for the 50 ms that count as a gap at least, then unknown.
    assert record.valid is not None
    np.testing.assert_array_equal(record.valid, np.arange(200) <= 150)
    assert any("last 49 samples marked" in note for note in record.notes)


def test_effort_choice(write_bag: Any, ros: Any, joint_rows: Any) -> None:
    rows = joint_rows() + [("/force_command", F64, START + k * MS, ros.float64(-1.0)) for k in range(100)]
    bag = write_bag(rows)
    assert read_record(bag).effort[50] == 100.0
    assert read_record(bag, effort="joint_states").effort[50] == 100.0
    assert read_record(bag, effort="command").effort[50] == -1.0


def test_effort_zero_throughout_gives_way_to_commands(write_bag: Any, ros: Any, joint_rows: Any) -> None:
    rows = joint_rows(effort=lambda _: 0.0)
    alone = read_record(write_bag(rows, name="alone"))
    assert "effort is zero throughout" in alone.notes
    rows += [("/force_command", F64, START + k * MS, ros.float64(3.0)) for k in range(100)]
    record = read_record(write_bag(rows))
    assert set(record.effort) == {3.0}
    assert any("zero throughout in /joint_states: taken from /force_command" in note for note in record.notes)


def test_reference_is_the_hermite_cubic(write_bag: Any, ros: Any, joint_rows: Any) -> None:
    def cubic(t: float) -> float:
        return 2.0 * t**3 - 0.3 * t**2 + 0.1 * t + 5.0

    rows = joint_rows()
    for j in range(12):
        t = 9e-3 * j
        slope = 6.0 * t**2 - 0.6 * t + 0.1
        stamp = START + round(t * 1e9)
        rows.append(("/reference", REF, stamp, ros.reference(stamp, cubic(t), slope)))
    record = read_record(write_bag(rows))
    assert record.reference is not None
    # A cubic goes through its own Hermite interpolation unchanged; straight lines would miss it by 6e-6.
    np.testing.assert_allclose(record.reference, [cubic(k * 1e-3) for k in range(100)], atol=1e-12)


def test_reference_outside_its_range_and_in_gaps_stands(write_bag: Any, ros: Any, joint_rows: Any) -> None:
    rows = joint_rows(600)
    for k in [*range(100, 200), *range(400, 500)]:
        stamp = START + k * MS
        rows.append(("/reference", REF, stamp, ros.reference(stamp, float(k), 1000.0)))
    reference = read_record(write_bag(rows)).reference
    assert reference is not None
    expected = np.concatenate(
        [np.full(100, 100.0), np.arange(100, 200), np.full(200, 199.0), np.arange(400, 500), np.full(100, 499.0)]
    )
    np.testing.assert_allclose(reference, expected, atol=1e-9)


def test_metadata_of_own_bags(write_bag: Any, ros: Any, joint_rows: Any) -> None:
    custom = {
        "fric.effort_hold": "preceding",
        "fric.position_unit": "rad",
        "fric.force_unit": "N m",
        "fric.joint": "b",
        "fric.extra": "pressure",
    }
    rows = joint_rows(names=("a", "b"))
    rows += [("/pressure", F64, START + k * 10 * MS, ros.float64(10.0 * k)) for k in range(11)]
    bag = write_bag(rows, custom=custom)
    record = read_record(bag)
    assert (record.joint, record.effort_hold, record.units) == ("b", "preceding", Units("rad", "N m"))
    np.testing.assert_allclose(record.extra["pressure"], np.arange(100.0), atol=1e-9)
    assert record.notes == ()
    assert read_record(bag, units=Units("m", "A")).units == Units("m", "A")


def test_part_of_a_recording(write_bag: Any, joint_rows: Any) -> None:
    record = read_record(write_bag(joint_rows()), start=0.02, end=0.05)
    np.testing.assert_allclose(record.position, np.arange(20, 51) * 1e-3, atol=1e-12)


def test_velocity_that_is_not_finite_is_left_out(write_bag: Any, ros: Any) -> None:
    rows = [
        ("/joint_states", JS, START + k * MS, ros.joint_state(START + k * MS, ["a"], [k], [np.nan], [k])) for k in range(20)
    ]
    record = read_record(write_bag(rows))
    assert record.velocity is None
    assert any("velocity left out" in note for note in record.notes)


def test_series_of_every_type(write_bag: Any, ros: Any, joint_rows: Any) -> None:
    rows = joint_rows()
    rows += [("/f", F64, START + k, ros.float64(k)) for k in range(5)]
    rows += [("/s", FORCE, START + k, ros.force(k * MS, 2.0 * k, "b" if k % 2 else "a")) for k in range(6)]
    rows += [("/r", REF, START + k, ros.reference(k * MS, k, 10 * k, 100 * k)) for k in range(5)]
    bag = write_bag(rows)
    plain = read_series(bag, "/f")
    assert plain.stamp_ns is None
    np.testing.assert_array_equal(plain.fields["data"], np.arange(5))
    np.testing.assert_array_equal(plain.log_ns, START + np.arange(5))
    force = read_series(bag, "/s")
    np.testing.assert_array_equal(force.fields["force"], 2.0 * np.arange(6))
    np.testing.assert_array_equal(force.stamp_ns, np.arange(6) * MS)  # type: ignore[arg-type]
    np.testing.assert_array_equal(read_series(bag, "/s", joint="b").fields["force"], [2.0, 6.0, 10.0])
    reference = read_series(bag, "/r")
    np.testing.assert_array_equal(reference.fields["acceleration"], 100.0 * np.arange(5))
    states = read_series(bag, "/joint_states")
    assert states.joint == "axis"
    assert set(states.fields) == {"position", "effort"}


def test_raw_messages_come_in_order_and_unchanged(write_bag: Any, ros: Any, joint_rows: Any) -> None:
    rows = joint_rows(30) + [("/force_command", F64, START + k * MS + 5, ros.float64(k)) for k in range(30)]
    bag = write_bag(rows)
    assert [tuple(raw) for raw in iterate_raw(bag)] == sorted(rows, key=lambda row: row[2])
    assert [raw.topic for raw in iterate_raw(bag, ["/force_command"])] == ["/force_command"] * 30
    with pytest.raises(BagError, match=r"no topic /nothing in the bag; it holds: /force_command, /joint_states"):
        next(iterate_raw(bag, ["/nothing"]))


def test_info(write_bag: Any, joint_rows: Any) -> None:
    info = bag_info(write_bag(joint_rows(), storage="sqlite3", custom={"who": "me"}))
    assert (info.storage, info.custom, info.notes) == ("sqlite3", {"who": "me"}, ())
    assert [(topic.name, topic.msgtype, topic.n_messages) for topic in info.topics] == [("/joint_states", JS, 100)]
