from __future__ import annotations

import re
import signal
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fric.bagio import BagWriter, iterate_raw, write_record
from fric.bagio.errors import BagError
from fric.record import Record
from fric_nodes.bag_publishers import NoSubscribersError
from fric_nodes.nodes.player import PlayerNode
from rclpy.executors import MultiThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """One second of an axis at 500 Hz, with its reference."""
    time_ = np.arange(500) / 500
    record = Record(time_, np.sin(time_), np.cos(time_), reference=np.sin(time_))
    return write_record(record, tmp_path / "source")


def player(graph: Any, bag: Path, **parameters: object) -> PlayerNode:
    given = [Parameter(name, value=value) for name, value in {"bag": str(bag), **parameters}.items()]
    node = PlayerNode(context=graph.context(), parameter_overrides=given)
    graph.owns(node)
    return node


def contents(bag: Path, topics: list[str]) -> dict[str, list[bytes]]:
    return {topic: [raw.data for raw in iterate_raw(bag, [topic])] for topic in topics}


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_what_is_played_is_what_was_recorded(graph: Any, bag: Path, tmp_path: Path, storage: str) -> None:
    copy = tmp_path / "copy"
    recorder = graph.start_node("recorder", bag=copy, storage=storage, topics="[joint_states,reference]")
    player = graph.start_node("player", bag=bag, wait_for_subscribers=2)
    status, out, error = graph.finish(player)
    assert (status, out) == (0, "")
    assert "100 % (1000 of 1000 messages)" in error
    assert graph.finish(recorder, signal.SIGINT)[0] == 0
    topics = ["/joint_states", "/reference"]
    assert contents(copy, topics) == contents(bag, topics)


def test_a_subscriber_gets_the_messages_in_order_and_in_time(graph: Any, bag: Path) -> None:
    listener = graph.node("listener")
    heard: list[tuple[float, float]] = []
    listener.create_subscription(
        JointState, "joint_states", lambda message: heard.append((time.monotonic(), message.position[0])), QoSProfile(depth=500)
    )
    graph.spin(listener, kind=MultiThreadedExecutor)
    node = player(graph, bag, rate=0.5, topics=["/joint_states"], wait_for_subscribers=1)
    assert node.play()
    graph.until(lambda: len(heard) == 500, "all messages")
    assert [position for _, position in heard] == pytest.approx(np.sin(np.arange(500) / 500).tolist())
    # Never early; how late depends on what else the machine does (test_playback holds the deadlines to account).
    assert 499 / 500 / 0.5 - 0.3 < heard[-1][0] - heard[0][0] < 10.0


def test_a_part_without_a_pace_under_another_name(graph: Any, bag: Path) -> None:
    listener = graph.node("listener")
    heard: list[float] = []
    listener.create_subscription(JointState, "/left/joint_states", lambda m: heard.append(m.position[0]), QoSProfile(depth=500))
    graph.spin(listener)
    given = {"bag": str(bag), "rate": 0.0, "start": 0.2, "end": 0.4, "wait_for_subscribers": 1}
    node = PlayerNode(
        context=graph.context("-r", "/joint_states:=/left/joint_states"),
        parameter_overrides=[Parameter(name, value=value) for name, value in given.items()],
    )
    graph.owns(node)
    assert node.play()
    expected = [np.sin(k / 500) for k in range(100, 201)]
    graph.until(lambda: len(heard) == len(expected), "101 messages")
    assert heard == pytest.approx(expected)


def test_the_clock_runs_with_the_recording(graph: Any, bag: Path) -> None:
    listener = graph.node("listener")
    times: list[float] = []
    listener.create_subscription(
        Clock, "/clock", lambda m: times.append(m.clock.sec + 1e-9 * m.clock.nanosec), QoSProfile(depth=500)
    )
    graph.spin(listener)
    node = player(graph, bag, clock=True, rate=4.0)
    graph.until(lambda: listener.count_publishers("/clock") == 1, "the clock is there")
    time.sleep(0.2)
    assert node.play()
    graph.until(lambda: times and times[-1] > 1.985, "the last tick")
    assert len(times) >= 99
    assert times == sorted(times)
    assert np.diff(times) == pytest.approx(0.01)
    assert times[-1] == pytest.approx(1.0 + 0.99)  # a record is written with its first stamp at one second


def test_a_loop_begins_again_and_is_stopped_by_a_signal(graph: Any, bag: Path) -> None:
    listener = graph.node("listener")
    heard: list[float] = []
    listener.create_subscription(JointState, "joint_states", lambda m: heard.append(m.position[0]), QoSProfile(depth=500))
    graph.spin(listener)
    process = graph.start_node("player", bag=bag, rate=20.0, loop=True, topics="[/joint_states]", wait_for_subscribers=1)
    graph.until(lambda: heard.count(0.0) >= 2, "a second round")
    assert graph.finish(process, signal.SIGINT)[0] == 0


def test_a_bag_that_cannot_be_played_is_one_line(graph: Any, bag: Path, tmp_path: Path) -> None:
    for parameters, reason in (
        ({"bag": tmp_path / "nowhere"}, f"{tmp_path / 'nowhere'}: is not there; "),
        ({"bag": bag, "topics": "[/nothing]"}, "no topic /nothing in the bag; it holds: /joint_states, /reference; "),
        ({}, "parameter 'bag' of the player: is missing; "),
        ({"bag": bag, "rate": -1.0}, "rate"),
    ):
        status, out, error = graph.finish(graph.start_node("player", **parameters))
        assert (status, out) == (2, "")
        assert re.fullmatch(r"player: .*\n", error), error
        assert reason in error


def test_nobody_listens(graph: Any, bag: Path) -> None:
    node = player(graph, bag, wait_for_subscribers=1, wait_timeout=0.2)
    with pytest.raises(NoSubscribersError, match=r"0 of 1 subscriptions within 0\.2 s"):
        node.play()


def test_a_damaged_bag_is_refused(graph: Any, tmp_path: Path) -> None:
    (tmp_path / "bad.mcap").write_bytes(b"not a bag at all")
    with pytest.raises(BagError):
        player(graph, tmp_path / "bad.mcap")


def test_a_type_that_is_not_installed_is_left_out(graph: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    bag = tmp_path / "strange"
    with BagWriter(bag) as writer:
        writer.topic("/gadget", "gadget_msgs/msg/Gadget", msgdef="float64 data\n", digest="RIHS01_" + 64 * "0")
        writer.topic("/force_command", "std_msgs/msg/Float64")
        for k in range(5):
            writer.write("/gadget", k, serialize_message(Float64(data=1.0)))
            writer.write("/force_command", k, serialize_message(Float64(data=float(k))))
    node = player(graph, bag)
    assert node.play()
    assert node.published == 5
    assert capfd.readouterr().err.count("/gadget: not played, its type gadget_msgs/msg/Gadget is not installed") == 1


def test_quality_of_service_is_that_of_the_recording(graph: Any, tmp_path: Path) -> None:
    from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    never = QosTime(2147483647, 4294967295)
    qos = Qos(
        QosHistory.KEEP_LAST, 1, QosReliability.BEST_EFFORT, QosDurability.TRANSIENT_LOCAL, never, never,
        QosLiveliness.AUTOMATIC, never, False,
    )  # fmt: skip
    store = get_typestore(Stores.ROS2_JAZZY)
    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        there = writer.add_connection("/force_command", "std_msgs/msg/Float64", typestore=store, offered_qos_profiles=[qos])
        other = writer.add_connection("/other", "std_msgs/msg/Float64", typestore=store)
        writer.write(there, 1, serialize_message(Float64(data=1.0)))
        writer.write(other, 2, serialize_message(Float64(data=1.0)))
    node = player(graph, tmp_path / "bag")
    offered = {topic: node.get_publishers_info_by_topic(topic)[0].qos_profile for topic in ("/force_command", "/other")}
    assert offered["/force_command"].durability == DurabilityPolicy.TRANSIENT_LOCAL
    assert offered["/force_command"].reliability == ReliabilityPolicy.BEST_EFFORT
    assert offered["/other"].durability == DurabilityPolicy.VOLATILE
    assert offered["/other"].reliability == ReliabilityPolicy.RELIABLE


def test_stop_ends_the_playing(graph: Any, bag: Path) -> None:
    node = player(graph, bag, rate=0.01)
    result: list[bool] = []
    thread = threading.Thread(target=lambda: result.append(node.play()))
    thread.start()
    graph.until(lambda: node.published > 0, "it plays")
    node.stop.set()
    thread.join(timeout=10.0)
    assert result == [False]
    assert node.published < 100
