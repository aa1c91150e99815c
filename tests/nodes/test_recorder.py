from __future__ import annotations

import contextlib
import re
import signal
import time
from pathlib import Path
from typing import Any

import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from fric.bagio import bag_info, iterate_raw, read_record
from fric_nodes.nodes.player import PlayerNode
from fric_nodes.nodes.recorder import RecorderNode
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String

from fric_interfaces.msg import Reference

TALKER = str(Path(__file__).with_name("talker.py"))


def positions(bag: Path, topic: str = "/joint_states") -> list[float]:
    """Positions of a topic as rosbags' own decoder, not the reader under test in production, finds them."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    return [float(store.deserialize_cdr(raw.data, raw.msgtype).position[0]) for raw in iterate_raw(bag, [topic])]


def recorder(graph: Any, bag: Path, **parameters: object) -> RecorderNode:
    """A recorder in this process, not served by any executor."""
    given = [Parameter(name, value=value) for name, value in {"bag": str(bag), **parameters}.items()]
    node = RecorderNode(context=graph.context(), parameter_overrides=given)
    graph.owns(node)
    return node


def cycle(node: RecorderNode, seconds: float = 0.0) -> None:
    """What the recorder's timers do, at a time of the test's choosing."""
    end = time.monotonic() + seconds
    while True:
        node.discover()
        node.drain()
        if time.monotonic() >= end:
            return
        time.sleep(0.01)


def size(bag: Path) -> int:
    """Of all files of a bag [B] while it is being written: a journal comes and goes."""
    total = 0
    for file in bag.glob("*"):
        with contextlib.suppress(FileNotFoundError):
            total += file.stat().st_size
    return total


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_killed_recorder_leaves_a_readable_bag(graph: Any, tmp_path: Path, storage: str) -> None:
    bag = tmp_path / "bag"
    process = graph.start_node("recorder", bag=bag, storage=storage)
    graph.start(TALKER, "1000", "20000", "joint_states")
    graph.until(lambda: size(bag) > 200_000, "the bag grows")
    killed = time.time_ns()
    process.kill()
    process.wait()
    assert not (bag / "metadata.yaml").exists()
    record = read_record(bag)
    last = max(raw.log_time_ns for raw in iterate_raw(bag))
    assert killed - last < 1_000_000_000
    assert record.n_samples > 500  # how many fit into what has grown depends on when the journal is written
    assert record.joint == "axis"
    found = positions(bag)
    assert found == pytest.approx([k * 1e-3 for k in range(len(found))])


@pytest.mark.parametrize(("storage", "compression"), [("mcap", "none"), ("sqlite3", "zstd")])
def test_sigint_closes_the_bag(graph: Any, tmp_path: Path, storage: str, compression: str) -> None:
    bag = tmp_path / "bag"
    process = graph.start_node(
        "recorder", bag=bag, storage=storage, compression=compression, joint="slide", position_unit="rad", force_unit="N m"
    )
    talker = graph.start(TALKER, "1000", "700", "joint_states")
    assert graph.finish(talker)[0] == 0
    # Acknowledged is as good as recorded: what is still in the queues must not be lost by the signal.
    status, _, error = graph.finish(process, signal.SIGINT)
    assert status == 0
    assert "0 lost" in error
    assert len(positions(bag)) == 700
    custom = yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]["custom_data"]
    assert custom["fric.joint"] == "slide"
    assert (custom["fric.position_unit"], custom["fric.force_unit"]) == ("rad", "N m")
    assert custom["fric.effort_hold"] == "preceding"


def test_nothing_is_lost_at_thousands_of_messages_a_second(graph: Any, tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    process = graph.start_node("recorder", bag=bag)
    topics = ["joint_states", "reference", "force_command", "feedforward_force"]
    # Two processes with two topics each: 4800 messages/s for 2.5 s.
    talkers = [graph.start(TALKER, "1200", "3000", *pair) for pair in (topics[:2], topics[2:])]
    for talker in talkers:
        assert graph.finish(talker, limit=60.0)[0] == 0
    assert graph.finish(process, signal.SIGINT)[0] == 0
    counts = {topic.name: topic.n_messages for topic in bag_info(bag).topics}
    assert {name: counts[f"/{name}"] for name in topics} == dict.fromkeys(topics, 3000)
    for name in topics:
        assert positions(bag, f"/{name}") == pytest.approx([k * 1e-3 for k in range(3000)])
    times = [raw.log_time_ns for raw in iterate_raw(bag)]
    assert times == sorted(times)


@pytest.mark.long
def test_stamp_order_gives_the_same_bag_twice(graph: Any, tmp_path: Path) -> None:
    contents = []
    for run in range(2):
        bag = tmp_path / f"bag{run}"
        process = graph.start_node("recorder", bag=bag, log_time="stamp", topics="[joint_states,reference]")
        assert graph.finish(graph.start(TALKER, "0", "1500", "joint_states", "reference"), limit=90.0)[0] == 0
        status, _, error = graph.finish(process, signal.SIGINT)
        assert status == 0
        assert "recorded 3000 messages, 0 lost" in error
        contents.append([(raw.log_time_ns, raw.topic, raw.data) for raw in iterate_raw(bag)])
    assert len(contents[0]) == 3000
    assert contents[0] == contents[1]
    assert contents[0][-1][0] == 1499 * 1_000_000


def test_an_existing_bag_is_refused_in_one_line(graph: Any, tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    bag.mkdir()
    (bag / "precious").write_text("mine")
    status, out, error = graph.finish(graph.start_node("recorder", bag=bag))
    assert (status, out) == (2, "")
    assert re.fullmatch(rf"recorder: {bag}: exists already.*; .*\n", error)
    assert [file.name for file in bag.iterdir()] == ["precious"]


def test_latched_and_best_effort_topics_are_received(graph: Any, tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    node = graph.node("source")
    latched = node.create_publisher(String, "friction/model", QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    loose = node.create_publisher(JointState, "joint_states", QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT))
    latched.publish(String(data="published before the recorder was there"))
    under_test = recorder(graph, bag)
    graph.until(lambda: cycle(under_test) or loose.get_subscription_count() == 1, "the recorder subscribes")
    graph.until(lambda: cycle(under_test) or under_test.written["/friction/model"] == 1, "the latched message")
    sent = JointState(name=["axis"], position=[0.5])

    def arrives() -> bool:
        loose.publish(sent)
        cycle(under_test, 0.05)
        return under_test.written["/joint_states"] > 0

    graph.until(arrives, "a best-effort message")
    under_test.close()
    assert [raw.data for raw in iterate_raw(bag, ["/friction/model"])] == [
        serialize_message(String(data="published before the recorder was there"))
    ]
    assert deserialize_message(next(iterate_raw(bag, ["/joint_states"])).data, JointState) == sent


def test_a_best_effort_publisher_that_joins_a_reliable_one_is_heard(graph: Any, tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    node = graph.node("source")
    strict = node.create_publisher(Float64, "force_command", 10)
    under_test = recorder(graph, bag)
    graph.until(lambda: cycle(under_test) or strict.get_subscription_count() == 1, "the recorder subscribes")
    loose = node.create_publisher(Float64, "force_command", QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT))
    graph.until(lambda: cycle(under_test) or loose.get_subscription_count() == 1, "the recorder subscribes again")

    def arrives() -> bool:
        loose.publish(Float64(data=2.0))
        cycle(under_test, 0.05)
        return under_test.written["/force_command"] > 0

    graph.until(arrives, "a message of the second publisher")
    under_test.close()


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_what_publishers_offer_is_in_the_bag_and_played_again(graph: Any, tmp_path: Path, storage: str) -> None:
    bag = tmp_path / "bag"
    node = graph.node("source")
    latched = node.create_publisher(String, "friction/model", QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    strict = node.create_publisher(JointState, "joint_states", 10)
    node.create_publisher(Float64, "friction/mismatch", 10)  # whatever its type: recorded by default
    under_test = recorder(graph, bag, storage=storage)
    graph.until(lambda: cycle(under_test) or strict.get_subscription_count() == 1, "the recorder subscribes")
    loose = node.create_publisher(JointState, "joint_states", QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT))
    graph.until(lambda: cycle(under_test) or loose.get_subscription_count() == 1, "the recorder subscribes again")
    graph.until(lambda: cycle(under_test) or latched.get_subscription_count() == 1, "and to the model")
    strict.publish(JointState(name=["axis"], position=[0.5]))
    graph.until(lambda: cycle(under_test) or under_test.written["/joint_states"] == 1, "a message")
    graph.until(lambda: cycle(under_test) or "/friction/mismatch" in under_test.written, "the mismatch")
    under_test.close()
    metadata = yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    offered = {
        entry["topic_metadata"]["name"]: [
            (qos["reliability"], qos["durability"]) for qos in entry["topic_metadata"]["offered_qos_profiles"]
        ]
        for entry in metadata["topics_with_message_count"]
    }
    assert offered["/friction/model"] == [("reliable", "transient_local")]
    assert offered["/joint_states"] == [("reliable", "volatile"), ("best_effort", "volatile")]
    player = graph.owns(PlayerNode(context=graph.context(), parameter_overrides=[Parameter("bag", value=str(bag))]))
    played = {each.topic_name: (each.qos_profile.reliability, each.qos_profile.durability) for each in player.publishers}
    assert played["/friction/model"] == (ReliabilityPolicy.RELIABLE, DurabilityPolicy.TRANSIENT_LOCAL)
    assert played["/joint_states"] == (ReliabilityPolicy.BEST_EFFORT, DurabilityPolicy.VOLATILE)


@pytest.mark.parametrize("lock_step", [False, pytest.param(True, marks=pytest.mark.long)])
def test_the_recorder_may_be_started_last(graph: Any, tmp_path: Path, lock_step: bool) -> None:
    """The excitation waits for it, so that the motion is recorded from its start on."""
    common = {"lock_step": str(lock_step).lower(), "period": 0.002}
    graph.start_node("plant", duration=2.0 if lock_step else 0.0, **common)
    graph.start_node("pid", use_feedforward="false", **common)
    excitation = graph.start_node("excitation", wait_for_nodes="[recorder]", start_delay=0.5, **common)
    watcher = graph.node("watcher")
    heard: list[Reference] = []
    watcher.create_subscription(Reference, "reference", heard.append, 2000)
    graph.spin(watcher)
    everyone = {"plant", "pid", "excitation"}
    graph.until(lambda: everyone <= set(watcher.get_node_names()), "the loop is there")
    time.sleep(1.0)
    assert not heard, "it does not begin without the recorder"
    bag = tmp_path / "bag"
    process = graph.start_node("recorder", bag=bag)
    graph.until(lambda: len(heard) > 600, "the motion")
    excitation.kill()
    assert graph.finish(process, signal.SIGINT)[0] == 0
    references = [deserialize_message(raw.data, Reference) for raw in iterate_raw(bag, ["/reference"])]
    assert len(references) > 500
    assert abs(references[0].velocity) == 0.0, "the recording begins at rest"
    if lock_step:
        assert (references[0].header.stamp.sec, references[0].header.stamp.nanosec) == (0, 0)
    assert any(abs(each.velocity) > 0.0 for each in references)


def test_topics_are_chosen_and_namespaced(graph: Any, tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    node = graph.node("source", namespace="left")
    publishers = [node.create_publisher(Float64, name, 10) for name in ("force_command", "other", "/elsewhere")]
    given = [Parameter("bag", value=str(bag)), Parameter("topics", value=["force_command", "/elsewhere"])]
    under_test = RecorderNode(context=graph.context(), namespace="left", parameter_overrides=given)
    graph.owns(under_test)
    wanted = (publishers[0], publishers[2])
    graph.until(lambda: cycle(under_test) or all(p.get_subscription_count() == 1 for p in wanted), "both are subscribed")
    assert publishers[1].get_subscription_count() == 0
    under_test.close()
    assert {topic.name for topic in bag_info(bag).topics} == {"/left/force_command", "/elsewhere"}


def test_a_queue_that_is_too_short_shows_in_the_diagnostics(graph: Any, tmp_path: Path) -> None:
    listener = graph.node("listener")
    heard: list[DiagnosticArray] = []
    listener.create_subscription(DiagnosticArray, "diagnostics", heard.append, 10)
    publisher = listener.create_publisher(Float64, "force_command", 200)
    graph.spin(listener)
    under_test = recorder(graph, tmp_path / "bag", queue_depth=10, topics=["force_command"])
    graph.until(lambda: cycle(under_test) or publisher.get_subscription_count() == 1, "the recorder subscribes")
    publisher.publish(Float64(data=0.0))
    graph.until(lambda: cycle(under_test) or under_test.written["/force_command"] == 1, "the first message")
    for k in range(100):
        publisher.publish(Float64(data=float(k)))
    graph.until(lambda: cycle(under_test) or under_test.written["/force_command"] == 11, "the last ten messages")
    heard.clear()
    graph.until(lambda: under_test.report() or heard, "diagnostics")
    status = heard[0].status[0]
    assert status.level == b"\x01"
    values = {pair.key: pair.value for pair in status.values}
    assert values["lost"] == "90"
    assert values["/force_command"] == "11 received, 0 repeated, 90 lost"
    under_test.close()
