from __future__ import annotations

import struct
import threading
import time

import pytest
from fric.bagio import Raw
from fric.bagio.playback import Due, Pace, schedule

SECOND = 1_000_000_000
STAMPED = "sensor_msgs/msg/JointState"


def plain(seconds: float) -> Raw:
    return Raw("/force", "std_msgs/msg/Float64", round(seconds * SECOND), b"\x00\x01\x00\x00" + bytes(8))


def stamped(stamp: float, log: float = 0.0) -> Raw:
    whole = int(stamp)
    data = b"\x00\x01\x00\x00" + struct.pack("<iI", whole, round((stamp - whole) * SECOND)) + bytes(8)
    return Raw("/state", STAMPED, round(log * SECOND), data)


def seconds(due: list[Due]) -> list[float]:
    return [item.time_ns / SECOND for item in due]


def test_time_of_reception_and_a_part_of_the_recording() -> None:
    messages = [plain(100 + k) for k in range(10)]
    assert seconds(list(schedule(messages))) == [100 + k for k in range(10)]
    assert seconds(list(schedule(messages, start=2.0, end=4.0))) == [102, 103, 104]


def test_own_stamps_and_what_has_none() -> None:
    messages = [plain(900), stamped(5.0, 901), plain(902), stamped(5.5, 903), stamped(5.4, 904), stamped(6.0, 905)]
    due = list(schedule(messages, stamped={STAMPED}))
    assert [item.message for item in due] == messages
    # The first has to wait for a stamp, the one that goes back follows at once.
    assert seconds(due) == [5.0, 5.0, 5.0, 5.5, 5.5, 6.0]


def test_ticks_of_the_clock_fill_gaps_and_come_first() -> None:
    due = list(schedule([plain(1.0), plain(1.05)], tick=0.02))
    assert [(item.time_ns / SECOND, item.message is None) for item in due] == [
        (1.0, True),
        (1.0, False),
        (1.02, True),
        (1.04, True),
        (1.05, False),
    ]


def test_deadlines_are_absolute_and_scaled_by_the_rate() -> None:
    pace = Pace(2.0, threading.Event())
    begin = time.monotonic()
    arrived = []
    for k in range(20):
        assert pace.wait(7 * SECOND + k * SECOND // 50)
        arrived.append(time.monotonic() - begin)
        if k == 5:
            time.sleep(0.03)  # a slow message must not delay those after it
    assert arrived[-1] == pytest.approx(19 / 50 / 2, abs=0.02)
    assert all(at >= k / 100 - 1e-4 for k, at in enumerate(arrived))
    assert 0.015 < pace.worst_delay < 0.1


def test_a_wait_ends_when_told_to_stop() -> None:
    stop = threading.Event()
    pace = Pace(1.0, stop)
    assert pace.wait(0)
    threading.Timer(0.05, stop.set).start()
    begin = time.monotonic()
    assert not pace.wait(60 * SECOND)
    assert time.monotonic() - begin < 5.0
