"""What is taken in bulk arrives in full and in order, whichever executor serves the node."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest
from fric_nodes.bulk import BulkSubscription
from fric_nodes.qos import SAMPLES
from rclpy.executors import Executor, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from sensor_msgs.msg import JointState

if TYPE_CHECKING:
    from .conftest import Graph

_COUNT = 500


@pytest.mark.parametrize("kind", [SingleThreadedExecutor, MultiThreadedExecutor, EventsExecutor])
def test_every_message_arrives_once_and_in_order(graph: Graph, kind: Callable[..., Executor]) -> None:
    taker, giver = graph.node("taker"), graph.node("giver")
    publisher = giver.create_publisher(JointState, "joint_states", SAMPLES)
    bulk = BulkSubscription(taker, "sensor_msgs/msg/JointState", "joint_states", SAMPLES, raw=False)
    found: list[float] = []

    def work() -> None:
        found.extend(each.payload.position[0] for each in bulk.take(1000))

    taker.create_timer(0.01, work)
    graph.spin(taker, kind=kind)
    graph.until(lambda: publisher.get_subscription_count() and bulk.publishers(), "the two to meet")
    for number in range(_COUNT):
        publisher.publish(JointState(position=[float(number)]))
    graph.until(lambda: len(found) >= _COUNT, f"{_COUNT} messages")
    assert found == [float(number) for number in range(_COUNT)]
