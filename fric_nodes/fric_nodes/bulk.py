"""Taking messages in bulk, past the executor.

An executor of rclpy rebuilds its wait set for every round and starts a coroutine for every message, which costs in the order of
100 us of processor time per message. A recorder or an identifier doesn't need to react to each message at once, so its
subscriptions are kept off the wait set and emptied from a timer instead: the middleware receives into the subscription's queue
on its own thread, and one message then costs about 2 us to take. The queue must hold what comes between two rounds.

The events executor of rclpy asks no callback group: it hands over each message as it comes. Such messages are kept, and
taken in the next round like the others.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from importlib import import_module
from typing import Any, NamedTuple

from rclpy.callback_groups import CallbackGroup
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

__all__ = ["BulkSubscription", "Taken", "message_class", "offered_qos", "stored_qos"]


class Taken(NamedTuple):
    """A message as the middleware delivered it.

    Attributes:
        payload: the serialized message, or the message itself when the subscription decodes.
        received: time of reception [ns since 1970].
        sequence: the publisher's own count of its messages, from 1; None when the middleware has none.
    """

    payload: Any
    received: int
    sequence: int | None


def message_class(msgtype: str) -> Any:
    """Python class of a message type such as ``sensor_msgs/msg/JointState``.

    Raises:
        ImportError: the type is not installed.
    """
    package, _, name = msgtype.partition("/msg/")
    try:
        return getattr(import_module(f"{package}.msg"), name)
    except AttributeError:
        raise ImportError(f"package '{package}' has no message '{name}'") from None


class _OffTheWaitSet(CallbackGroup):
    """A callback group whose entities are never ready to run, so that no executor waits on them."""

    def can_execute(self, entity: object) -> bool:
        return False

    def beginning_execution(self, entity: object) -> bool:
        return False

    def ending_execution(self, entity: object) -> None:
        return None


class BulkSubscription:
    """A subscription that is emptied on demand.

    Args:
        node: the node that subscribes.
        msgtype: such as ``sensor_msgs/msg/JointState``.
        topic: name of the topic.
        qos: quality of service; its depth bounds what may come between two calls of :meth:`take`.
        raw: give the bytes as they came; otherwise the decoded messages, at some 10 us each.

    Raises:
        ImportError: the message type is not installed.
    """

    def __init__(self, node: Node, msgtype: str, topic: str, qos: QoSProfile, *, raw: bool = True) -> None:
        self.topic = topic
        self.msgtype = msgtype
        self.qos = qos
        self._raw = raw
        self._class = message_class(msgtype)
        self._node = node
        self._group = _OffTheWaitSet()
        self._handed_over: deque[Taken] = deque(maxlen=qos.depth)
        self._subscription: Any = node.create_subscription(
            self._class,
            topic,
            self._keep,
            qos,
            callback_group=self._group,
            # Event handlers are waitables of their own and would cost the wait set what was saved above.
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
            raw=raw,
        )

    def _keep(self, payload: Any) -> None:
        # Time of reception and sequence could be asked for, but the events executor of rclpy 7.1 fails on handing them over.
        self._handed_over.append(Taken(payload, time.time_ns(), None))

    def take(self, limit: int) -> Iterator[Taken]:
        """Take out what has been received, at most ``limit`` messages, oldest first."""
        handle = self._subscription.handle
        take: Callable[[Any, bool], Any] = handle.take_message
        with handle:
            for _ in range(limit):
                if self._handed_over:
                    yield self._handed_over.popleft()
                    continue
                taken = take(self._class, self._raw)
                if taken is None:
                    return
                payload, info = taken
                yield Taken(payload, info["received_timestamp"], info.get("publication_sequence_number"))

    def publishers(self) -> int:
        """Number of publishers that are matched."""
        return int(self._subscription.get_publisher_count())

    def destroy(self) -> None:
        """Leave the topic."""
        self._node.destroy_subscription(self._subscription)


def offered_qos(publishers: Iterable[TopicEndpointInfo], depth: int) -> QoSProfile:
    """The strictest quality of service with which every one of ``publishers`` can be received.

    Reliable and transient-local are asked for only where all publishers offer them, since asking for more than is offered means
    to receive nothing.
    """
    offers = [publisher.qos_profile for publisher in publishers]
    reliable = all(offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers)
    latched = bool(offers) and all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def stored_qos(profile: QoSProfile) -> Qos:
    """``profile`` as bags hold it. Discovery tells neither history nor depth: they are unknown, as in the bags of rosbag2."""
    return Qos(
        history=QosHistory[profile.history.name],
        depth=profile.depth,
        reliability=QosReliability[profile.reliability.name],
        durability=QosDurability[profile.durability.name],
        deadline=_stored_time(profile.deadline),
        lifespan=_stored_time(profile.lifespan),
        liveliness=QosLiveliness[profile.liveliness.name],
        liveliness_lease_duration=_stored_time(profile.liveliness_lease_duration),
        avoid_ros_namespace_conventions=profile.avoid_ros_namespace_conventions,
    )


def _stored_time(duration: Duration) -> QosTime:
    return QosTime(*divmod(duration.nanoseconds, 1_000_000_000))
