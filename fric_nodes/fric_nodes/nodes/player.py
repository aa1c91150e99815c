"""Publishes a recording into the running graph: the same bytes, in the same order, at the recording's own pace or another."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import Any

from builtin_interfaces.msg import Time
from fric.bagio.errors import BagError
from fric.bagio.playback import Due, Pace, recorded_qos, schedule
from fric.bagio.read import bag_info, iterate_raw
from fric.errors import InputError
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosbags.interfaces import Qos
from rosgraph_msgs.msg import Clock

from ..base import wait_until_sent
from ..bulk import message_class
from ..orderly import OrderlyNode, run
from ..parameters import NodeParameter, NodeParameterError, Settings

__all__ = ["PARAMETERS", "NoSubscribersError", "PlayerNode", "main"]

_BURST = 16  # messages published at once when there is no pace to keep; small against the queues of subscribers
PARAMETERS = (
    NodeParameter("bag", "", "bag to play: a rosbag2 folder, or a .mcap or .db3 file"),
    NodeParameter("rate", 1.0, "speed relative to the recording; 0: without a pace, limited by pause", lower=0.0, upper=1000.0),
    NodeParameter("start", 0.0, "leave out what comes before this time of the recording", unit="s", lower=0.0),
    NodeParameter("end", 0.0, "leave out what comes after this time of the recording; 0: nothing", unit="s", lower=0.0),
    NodeParameter("loop", False, "begin again at the end, until stopped", settable=True),
    NodeParameter("topics", [""], "topics to play; empty: all"),
    NodeParameter("clock", False, "publish the time of the recording on /clock"),
    NodeParameter("time_source", "log", "pace by time of reception, or by the messages' own stamps", choices=("log", "stamp")),
    NodeParameter("wait_for_subscribers", 0, "subscriptions, over all topics, to wait for before playing", lower=0, upper=1000),
    NodeParameter("wait_timeout", 10.0, "longest time to wait for them", unit="s", lower=0.0),
    NodeParameter("pause", 0.002, f"rest after every {_BURST} messages when rate is 0", unit="s", lower=0.0, upper=1.0),
)
_FRICTION_MODEL = "fric_interfaces/msg/FrictionModel"
_DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
_DEPTH = 1000  # messages kept for a slow reliable subscriber
_CLOCK_TICK = 0.01  # [s] of the recording between two messages on /clock
_MATCHING = 0.2  # [s] the subscribers' side learns of the match somewhat later, and would miss the first messages
_SETTLE_LIMIT = 15.0  # [s]; Fast DDS asks for what was lost every 3 s: a few rounds for a subscriber on a busy machine


class NoSubscribersError(InputError):
    """Nobody subscribed to what is to be played."""


class PlayerNode(OrderlyNode):
    """Publishes the messages of a bag; nothing happens before :meth:`play`.

    Raises:
        BagError: not a bag, damaged beyond use, or without a topic that was asked for.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__("player", **node_options)
        settings = self._settings = Settings(self, PARAMETERS)
        if not settings.text("bag"):
            raise NodeParameterError("parameter 'bag' of the player", "is missing", "name the bag to play")
        self._bag = Path(settings.text("bag"))
        self.stop = threading.Event()
        """Set it to end the playing early."""
        self.published = 0
        """Messages published so far."""
        self._time = self.create_publisher(Clock, "/clock", 10) if settings.flag("clock") else None
        self._thread: threading.Thread | None = None
        self._refusal: InputError | None = None
        self._stamped: set[str] = set()
        self._publishers_of: dict[str, Publisher] = {}
        self._total = 0
        self._open(settings.texts("topics"))

    def _open(self, topics: list[str]) -> None:
        """Make a publisher for every topic to be played whose type is installed."""
        known = {topic.name: topic for topic in bag_info(self._bag).topics}
        if any(topic.encoding == "ros1" for topic in known.values()):
            remedy = f"convert it first: rosbags-convert --src {self._bag} --dst {self._bag.with_suffix('')}_ros2"
            raise BagError(self._bag, "is a ROS 1 bag, whose messages no ROS 2 node takes", remedy)
        for name in topics:
            if name not in known:
                raise BagError(self._bag, f"no topic {name} in the bag; it holds: {', '.join(known)}", "choose among these")
        offered = recorded_qos(self._bag)
        for name in topics or known:
            topic = known[name]
            try:
                kind = message_class(topic.msgtype)
            except ImportError as error:
                self.get_logger().warning(f"{name}: not played, its type {topic.msgtype} is not installed ({error})")
                continue
            if next(iter(kind.get_fields_and_field_types().values()), "") == "std_msgs/Header":
                self._stamped.add(topic.msgtype)
            self._publishers_of[name] = self.create_publisher(kind, name, _playing_qos(offered.get(name), topic.msgtype))
            self._total += topic.n_messages

    def begin(self) -> None:
        """Play in a thread of its own, so that the pace doesn't depend on what the executor has to do."""

        def work() -> None:
            try:
                self.play()
            except InputError as error:
                self._refusal = error

        self._thread = threading.Thread(target=work, name="play")
        self._thread.start()

    @property
    def done(self) -> bool:
        """True when the playing that was begun has ended."""
        return self._thread is not None and not self._thread.is_alive()

    def close(self) -> None:
        """End the playing.

        Raises:
            InputError: what kept it from being played.
        """
        self.stop.set()
        if self._thread is not None:
            self._thread.join()
        if self._refusal is not None:
            raise self._refusal

    def play(self) -> bool:
        """Publish the recording, as often as was asked for; True when it was published to its end.

        Raises:
            BagError: the bag turns out to be damaged on the way.
            NoSubscribersError: nobody subscribed in time.
        """
        settings = self._settings
        self._wait_for_subscribers(settings.integer("wait_for_subscribers"), settings.number("wait_timeout"))
        rate, end = settings.number("rate"), settings.number("end")
        by_stamp = settings.text("time_source") == "stamp"
        while True:
            pace = Pace(rate, self.stop) if rate > 0 else None
            messages = schedule(
                iterate_raw(self._bag, list(self._publishers_of)),
                stamped=self._stamped - {_DIAGNOSTICS} if by_stamp else (),
                start=settings.number("start"),
                end=end if end > 0 else None,
                tick=_CLOCK_TICK if self._time else None,
            )
            for due in messages:
                if not (pace.wait(due.time_ns) if pace else self._throttle()):
                    return False
                self._publish(due)
            late = f", at most {pace.worst_delay * 1e3:.1f} ms late" if pace else ""
            self.get_logger().info(f"played {self.published} messages{late}")
            if not settings.flag("loop"):
                self._settle()
                return True
            self.published = 0

    def _publish(self, due: Due) -> None:
        if due.message is not None:
            self._publishers_of[due.message.topic].publish(due.message.data)
            self.published += 1
            self._progress()
        elif self._time is not None:
            seconds, nanoseconds = divmod(due.time_ns, 1_000_000_000)
            self._time.publish(Clock(clock=Time(sec=seconds, nanosec=nanoseconds)))

    def _progress(self) -> None:
        if self._total and self.published * 10 // self._total != (self.published - 1) * 10 // self._total:
            self.get_logger().info(f"{100 * self.published // self._total} % ({self.published} of {self._total} messages)")

    def _throttle(self) -> bool:
        """Without a pace to keep, rest after every burst, so that subscribers can empty their queues; False when told to stop.

        Waiting for acknowledgements instead would be slower and no safer: they say that a message is in the subscriber's queue,
        not that it was taken out, and the middleware may ask for them as seldom as every 3 s.
        """
        if self.published % _BURST == 0 and self.published:
            return not self.stop.wait(self._settings.number("pause"))
        return not self.stop.is_set()

    def _settle(self) -> None:
        """Wait until every reliable subscriber has acknowledged what was published, so that leaving loses nothing."""
        deadline = time.monotonic() + _SETTLE_LIMIT
        for publisher in self._publishers_of.values():
            wait_until_sent(self, publisher, max(deadline - time.monotonic(), 0.0))

    def _wait_for_subscribers(self, wanted: int, patience: float) -> None:
        def count() -> int:
            return sum(publisher.get_subscription_count() for publisher in self._publishers_of.values())

        deadline = time.monotonic() + patience
        while count() < wanted and not self.stop.wait(0.02):
            if time.monotonic() > deadline:
                raise NoSubscribersError(
                    self._bag,
                    f"{count()} of {wanted} subscriptions within {patience:g} s",
                    "start the subscribers first, or raise wait_timeout",
                )
        if wanted:
            self.stop.wait(_MATCHING)


def _playing_qos(recorded: Qos | None, msgtype: str) -> QoSProfile:
    """Quality of service as recorded; where the bag does not say, reliable, and latched for a friction model."""
    if recorded is None:
        latched, reliable = msgtype == _FRICTION_MODEL, True
    else:
        latched, reliable = recorded.durability.name == "TRANSIENT_LOCAL", recorded.reliability.name != "BEST_EFFORT"
    return QoSProfile(
        depth=1 if latched and recorded is None else _DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def main(args: list[str] | None = None) -> None:
    """Play a bag to its end; exit status 0 also when stopped by a signal, 2 when the bag cannot be played."""

    def make() -> PlayerNode:
        node = PlayerNode()
        node.begin()
        return node

    run("player", make, args)


if __name__ == "__main__":
    main()
