from __future__ import annotations

import random
import struct

from fric.bagio.message_order import ReceiveOrder, StampOrder, TopicIntake, header_stamp

MS = 1_000_000


def stamped(stamp_ns: int, content: int = 0) -> bytes:
    """A little-endian message: encapsulation, seconds, nanoseconds, empty frame_id, one number."""
    return (
        b"\x00\x01\x00\x00"
        + struct.pack("<iII", stamp_ns // 10**9, stamp_ns % 10**9, 1)
        + b"\0\0\0\0"
        + struct.pack("<q", content)
    )


def topic(name: str, *, clock: bool = True, header: bool = True) -> TopicIntake:
    return TopicIntake(name, stamped=header, follows_clock=clock)


def test_stamp_is_read_in_either_byte_order() -> None:
    assert header_stamp(stamped(12_345_678_901)) == 12_345_678_901
    assert header_stamp(b"\x00\x00\x00\x00" + struct.pack(">iI", 12, 345) + b"rest") == 12_000_000_345
    assert header_stamp(b"\x00\x01\x00\x00" + struct.pack("<iI", -1, 5)) == 0


def test_reception_order_holds_back_what_is_not_complete() -> None:
    order = ReceiveOrder([topic("a", header=False), topic("b", header=False)])
    for received in (10, 30, 50):
        order.add(0, b"a", received)
    for received in (20, 40):
        order.add(1, b"b", received)
    assert [message[0] for message in order.release(40)] == [10, 20, 30]
    assert [message[:2] for message in order.release(None)] == [(40, 1), (50, 0)]
    assert order.release(None) == []


def test_lock_step_order_depends_on_nothing_but_stamps() -> None:
    def run(seed: int) -> list[tuple[int, int, bytes]]:
        """The same three topics, one of them running ahead by 8 samples, delivered in chance portions."""
        rng = random.Random(seed)
        topics = [topic("state"), topic("reference"), topic("command")]
        order = StampOrder(topics)
        queues = [[stamped(k * MS, k) for k in range(200 + ahead)] for ahead in (0, 8, 0)]
        sent = [0, 0, 0]
        written = []
        now = 0
        while any(sent[i] < len(queues[i]) for i in range(3)):
            now += MS
            for i, ahead in enumerate((0, 8, 0)):
                until = min(len(queues[i]), sent[2] + ahead + rng.randrange(1, 9))
                for payload in queues[i][sent[i] : until]:
                    order.add(i, payload, now)
                sent[i] = max(sent[i], until)
            written += order.release(now)
        return written + order.release(None)

    first, second = run(1), run(2)
    assert len(first) == 608
    assert first == second
    assert [message[0] for message in first] == sorted(message[0] for message in first)


def test_at_equal_stamps_the_order_of_discovery_does_not_matter() -> None:
    written = []
    for names in (("a", "b"), ("b", "a")):
        topics = [topic(name) for name in names]
        order = StampOrder(topics)
        for at in range(2):
            order.add(at, stamped(5), received=0)
        written.append([topics[at].name for _, at, _ in order.release(None)])
    assert written == [["a", "b"], ["a", "b"]]


def test_a_message_waits_for_the_topics_that_lag_but_not_for_silent_ones() -> None:
    order = StampOrder([topic("a state"), topic("b command"), topic("c estimate")])
    order.add(2, stamped(0), received=0)
    order.add(0, stamped(0), received=1000 * MS)
    order.add(0, stamped(MS), received=1000 * MS)
    order.add(1, stamped(0), received=1000 * MS)
    # A second is less than the middleware may take to send again what was lost.
    assert [(time, at) for time, at, _ in order.release(1001 * MS)] == [(0, 0), (0, 1), (0, 2)]
    order.add(1, stamped(MS), received=1002 * MS)
    assert order.release(5000 * MS) == []
    # By now the estimate holds up nobody.
    order.add(0, stamped(2 * MS), received=7400 * MS)
    order.add(1, stamped(2 * MS), received=7400 * MS)
    assert [(time, at) for time, at, _ in order.release(7401 * MS)] == [(MS, 0), (MS, 1), (2 * MS, 0), (2 * MS, 1)]


def test_what_the_middleware_sends_again_after_seconds_is_written_in_its_place() -> None:
    order = StampOrder([topic("state"), topic("reference")])
    written = []
    for k in range(100):
        order.add(1, stamped(k * MS), received=k * MS)
        if k < 40:
            order.add(0, stamped(k * MS), received=k * MS)
    for now in range(100, 3200, 50):
        written += order.release(now * MS)
    for k in range(40, 100):
        order.add(0, stamped(k * MS), received=3200 * MS)
    written += order.release(3201 * MS)
    assert [(time // MS, at) for time, at, _ in written] == [(k, at) for k in range(100) for at in (1, 0)]


def test_retransmissions_are_written_once() -> None:
    state = topic("state")
    order = StampOrder([state])
    for k in (0, 1, 2, 2, 2, 1, 3):
        order.add(0, stamped(k * MS, k), received=0)
    assert [time // MS for time, _, _ in order.release(None)] == [0, 1, 2, 3]
    assert state.repeated == 3
    # Another content with the same stamp is no retransmission.
    order.add(0, stamped(3 * MS, 99), received=0)
    assert len(order.release(None)) == 1


def test_in_reception_order_equal_messages_without_a_stamp_are_kept() -> None:
    order = ReceiveOrder([topic("state"), topic("force", header=False)])
    for received in (1, 2):
        order.add(0, stamped(0), received)
        order.add(0, stamped(5 * MS), received)
        order.add(1, b"\x00\x01\x00\x00same", received)
    kept = [payload for _, _, payload in order.release(None)]
    assert kept.count(stamped(0)) == 2
    assert kept.count(stamped(5 * MS)) == 1
    assert kept.count(b"\x00\x01\x00\x00same") == 2


def test_log_time_goes_on_when_the_stamps_start_again() -> None:
    restarted: list[str] = []
    order = StampOrder([topic("state"), topic("command")], restarted.append)
    for run in range(2):
        for k in range(100):
            order.add(0, stamped(k * MS, 1000 * run + k), received=0)
            order.add(1, stamped(k * MS, 1000 * run + k), received=0)
    times = [time for time, _, _ in order.release(None)]
    assert times == sorted(times)
    assert len(set(times)) == 200
    assert restarted == ["state", "command"]


def test_what_has_no_stamp_of_this_clock_takes_the_newest() -> None:
    wall = 1_700_000_000_000_000_000
    order = StampOrder([topic("a"), topic("diagnostics", clock=False), topic("force", header=False)])
    order.add(0, stamped(7 * MS), received=wall)
    order.add(1, stamped(wall), received=wall)
    order.add(2, b"\x00\x01\x00\x00........", received=wall)
    assert [(time, at) for time, at, _ in order.release(None)] == [(7 * MS, 0), (7 * MS, 1), (7 * MS, 2)]


def test_without_any_stamp_nothing_is_held_back() -> None:
    order = StampOrder([topic("force", header=False)])
    order.add(0, b"\x00\x01\x00\x00........", received=5)
    assert len(order.release(6)) == 1


def test_losses_are_the_gaps_in_the_publishers_numbers() -> None:
    state = topic("state")
    for number in (4, 5, 9, 10):  # joined at 4: what came before was never for us
        state.count(number, one_publisher=True)
    assert (state.received, state.lost) == (4, 3)
    state.count(1, one_publisher=True)  # a publisher that was started again
    state.count(2, one_publisher=True)
    assert state.lost == 3
    state.count(7, one_publisher=False)
    state.count(None, one_publisher=True)
    assert (state.received, state.lost) == (8, 3)


def test_the_first_message_of_one_topic_waits_for_that_of_another() -> None:
    order = StampOrder([topic("a"), topic("b"), topic("never")])
    order.add(1, stamped(0), 1000 * MS)
    assert order.release(1005 * MS) == []
    order.add(0, stamped(0), 1006 * MS)
    assert order.release(1010 * MS) == []  # the third may still be on its way
    order.add(1, stamped(MS), 7990 * MS)
    order.add(0, stamped(MS), 7995 * MS)
    assert order.release(7999 * MS) == []
    assert [message[1] for message in order.release(8001 * MS)] == [0, 1, 0, 1]
