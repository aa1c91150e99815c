"""Bulk decoding against the decoder of rosbags, message by message."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest
from fric.bagio.decode import Block, DecodeError, decode
from fric.bagio.encode import float64_messages, joint_state_messages, reference_messages, stamped_force_messages

JOINT_STATE = "sensor_msgs/msg/JointState"


def by_row(blocks: list[Block], name: str) -> dict[int, Any]:
    return {int(row): block.numbers[name][index] for block in blocks for index, row in enumerate(block.rows)}


def assert_equals_rosbags(ros: Any, messages: list[bytes]) -> list[Block]:
    blocks = decode(messages, JOINT_STATE, ros.store.fielddefs)
    rows = sorted(int(row) for block in blocks for row in block.rows)
    assert rows == list(range(len(messages)))
    names = {int(row): block.strings["name"] for block in blocks for row in block.rows}
    for field in ("position", "velocity", "effort"):
        values = by_row(blocks, field)
        for row, raw in enumerate(messages):
            expected: Any = ros.store.deserialize_cdr(raw, JOINT_STATE)
            np.testing.assert_array_equal(values[row], getattr(expected, field))
            assert names[row] == expected.name
    seconds, nanoseconds = by_row(blocks, "header.stamp.sec"), by_row(blocks, "header.stamp.nanosec")
    for row, raw in enumerate(messages):
        message: Any = ros.store.deserialize_cdr(raw, JOINT_STATE)
        assert (seconds[row], nanoseconds[row]) == (message.header.stamp.sec, message.header.stamp.nanosec)
    return blocks


def test_one_layout_for_equal_messages(ros: Any) -> None:
    messages = [ros.joint_state(k * 7_000_001, ["a", "bcd"], [k, -k], [0.5, k], [k * k, 3.0]) for k in range(50)]
    assert len(assert_equals_rosbags(ros, messages)) == 1


def test_random_names_lengths_and_byte_orders(ros: Any) -> None:
    draw = random.Random(7)
    messages = []
    for k in range(200):
        count = draw.randint(0, 3)
        names = ["j" * draw.randint(0, 5) for _ in range(count)]
        velocity = [draw.gauss(0, 1) for _ in names] if draw.random() < 0.5 else []
        numbers = [draw.gauss(0, 1) for _ in names]
        frame = "f" * draw.randint(0, 4)
        little = draw.random() < 0.5
        messages.append(ros.joint_state(k, names, numbers, velocity, numbers, frame_id=frame, little_endian=little))
    assert_equals_rosbags(ros, messages)


def test_equal_length_but_other_joints(ros: Any) -> None:
    messages = [ros.joint_state(k, ["left" if k % 2 else "rite"], [k], [], [k]) for k in range(20)]
    blocks = assert_equals_rosbags(ros, messages)
    assert sorted(block.strings["name"][0] for block in blocks) == ["left", "rite"]


def test_list_lengths_that_keep_the_total_length(ros: Any) -> None:
    # Position and velocity swapped in number: equal bytes in all, other offsets.
    messages = [ros.joint_state(k, ["a"], [1.5] * (1 + k % 2), [2.5] * (2 - k % 2), []) for k in range(10)]
    assert len({len(raw) for raw in messages}) == 1
    assert len(assert_equals_rosbags(ros, messages)) == 2


def test_strings_that_change_every_message(ros: Any) -> None:
    messages = [ros.joint_state(k, ["axis"], [k], [], [k], frame_id=f"{k:05d}") for k in range(300)]
    assert_equals_rosbags(ros, messages)


@pytest.mark.parametrize(
    ("raw", "problem"),
    [
        (b"", "not plain CDR"),
        (b"\x00\x07\x00\x00" + b"\0" * 40, "not plain CDR"),
        (b"\x00\x01\x00\x00\x01\x00\x00\x00", "it ends after 8 bytes"),
        (b"\x00\x01\x00\x00" + b"\0" * 8 + b"\xff\xff\xff\xff", "it ends after 16 bytes"),
    ],
)
def test_broken_message_is_named(ros: Any, raw: bytes, problem: str) -> None:
    good = ros.joint_state(1, ["a"], [1.0])
    with pytest.raises(DecodeError, match=problem) as caught:
        decode([good, raw], JOINT_STATE, ros.store.fielddefs)
    assert caught.value.row == 1


def test_encoders_write_what_rosbags_writes(ros: Any) -> None:
    stamps = np.array([1_000_000_001, 2_999_999_999], dtype=np.int64)
    a, b, c = np.array([1.0, 2.0]), np.array([-1.0, 0.25]), np.array([1e-9, 1e9])
    for k, stamp in enumerate(stamps.tolist()):
        assert joint_state_messages(stamps, "ab", a, b, c)[k] == ros.joint_state(stamp, ["ab"], [a[k]], [b[k]], [c[k]])
        assert joint_state_messages(stamps, "abc", a, None, c)[k] == ros.joint_state(stamp, ["abc"], [a[k]], [], [c[k]])
        assert float64_messages(a)[k] == ros.float64(a[k])
        assert stamped_force_messages(stamps, "axis", b)[k] == ros.force(stamp, b[k], "axis")
        reference: Any = ros.store.deserialize_cdr(reference_messages(stamps, "", a, b, c)[k], "fric_interfaces/msg/Reference")
        assert (reference.position, reference.velocity, reference.acceleration) == (a[k], b[k], c[k])
