"""Says when a topic carries nothing because what one side offers is less than what the other side asks for.

The middleware tells of it once, when the two meet. From then on that topic is looked at for every report, so that it is known
when the other side is gone. A subscription that is kept off the executor's wait set hears nothing; it is always looked at.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any, NamedTuple

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSCompatibility, QoSProfile, ReliabilityPolicy, qos_check_compatible
from rclpy.topic_endpoint_info import TopicEndpointInfo

from .qos import qos_parameter

__all__ = ["QosWatch"]


class _End(NamedTuple):
    """This node's end of a topic."""

    topic: str
    takes: bool
    qos: QoSProfile


class QosWatch:
    """Watches the topics of ``node``.

    Args:
        node: whose topics they are, and whose log says what is wrong.
        counters: of the node; counts each meeting of two ends that don't go together.
    """

    def __init__(self, node: Node, counters: Counter[str]) -> None:
        self._node = node
        self._counters = counters
        self._suspects: list[_End] = []
        self._always: dict[str, _End] = {}
        self._said: set[str] = set()

    def events_of_subscription(self, topic: str, qos: QoSProfile) -> SubscriptionEventCallbacks:
        """What a subscription of the node is to be made with."""
        return SubscriptionEventCallbacks(incompatible_qos=self._on_event(_End(topic, True, qos)))

    def events_of_publisher(self, topic: str, qos: QoSProfile) -> PublisherEventCallbacks:
        """What a publisher of the node is to be made with."""
        return PublisherEventCallbacks(incompatible_qos=self._on_event(_End(topic, False, qos)))

    def look_always(self, topic: str, qos: QoSProfile) -> None:
        """Look at a subscription that hears of nothing by itself, at every report; it takes the place of an earlier one."""
        self._always[topic] = _End(topic, True, qos)

    def _on_event(self, end: _End) -> Callable[[Any], None]:
        def met(_info: Any) -> None:
            self._counters[f"incompatible QoS: {end.topic}"] += 1
            if end not in self._suspects:
                self._suspects.append(end)  # the next report says so; by then it is known whose the other end is

        return met

    def faults(self) -> list[str]:
        """What doesn't go together at present, in words; the log says when each begins and ends."""
        now: dict[str, None] = {}
        for end in (*self._suspects, *self._always.values()):
            now |= dict.fromkeys(self._faults_of(end))
        logger = self._node.get_logger()
        for text in now:
            if text not in self._said:
                logger.error(text)
        for text in self._said - set(now):
            logger.info(f"over: {text}")
        self._said = set(now)
        return list(now)

    def _faults_of(self, end: _End) -> list[str]:
        name = self._node.resolve_topic_name(end.topic)
        if end.takes:
            others = self._node.get_publishers_info_by_topic(name)
        else:
            others = self._node.get_subscriptions_info_by_topic(name)
        found = []
        for other in others:
            offered, asked = (other.qos_profile, end.qos) if end.takes else (end.qos, other.qos_profile)
            if qos_check_compatible(offered, asked)[0] == QoSCompatibility.ERROR:
                found.append(self._text(end, other, name))
        return found

    def _text(self, end: _End, other: TopicEndpointInfo, name: str) -> str:
        # The middleware may come to know an end of a topic before the node that it belongs to.
        whose = "another node" if "UNKNOWN" in other.node_name else f"{other.node_namespace.rstrip('/')}/{other.node_name}"
        offered, asked = (other.qos_profile, end.qos) if end.takes else (end.qos, other.qos_profile)
        less, more = _difference(offered, asked)
        if end.takes:
            said = f"{name}: {whose} offers {less}, this node asks for {more} and receives nothing from it"
            remedy = f"set {qos_parameter(end.topic)} to sensor_data" if self._settable(end) and less == "best effort" else ""
        else:
            said = f"{name}: this node offers {less}, {whose} asks for {more} and receives nothing from it"
            remedy = f"set {qos_parameter(end.topic)} to reliable" if self._settable(end) and more == "reliable" else ""
        return f"{said}; {remedy}" if remedy else said

    def _settable(self, end: _End) -> bool:
        return bool(self._node.has_parameter(qos_parameter(end.topic)))


def _difference(offered: QoSProfile, asked: QoSProfile) -> tuple[str, str]:
    """What is offered and what is asked for, in the policy in which they differ."""
    if asked.reliability == ReliabilityPolicy.RELIABLE and offered.reliability == ReliabilityPolicy.BEST_EFFORT:
        return "best effort", "reliable"
    if asked.durability == DurabilityPolicy.TRANSIENT_LOCAL and offered.durability == DurabilityPolicy.VOLATILE:
        return "volatile", "transient local"
    return "less in deadline or liveliness", "more"
