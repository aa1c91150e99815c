"""What the nodes of the control loop share: its period, lock-step, deadlines, and when a message is new."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.executors import Executor
from rclpy.experimental import EventsExecutor
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from sensor_msgs.msg import JointState

from .base import FricNode
from .convert import JointSample, joint_sample
from .parameters import NodeParameter
from .qos import LATEST, SAMPLES
from .scheduling import use_realtime_scheduling
from .timing import Deadlines

__all__ = ["COMMON", "LOCK_STEP", "PERIOD", "LoopNode", "wall_clock"]

PERIOD = NodeParameter("period", 0.002, "sample period of the loop", "s", 1e-5, 10.0)
LOCK_STEP = NodeParameter("lock_step", False, "count samples instead of time: the plant waits for the command to each sample")
COMMON = (
    NodeParameter("joint", "axis", "name of the joint in joint states and models"),
    NodeParameter(
        "realtime_priority", 0, "wall time: SCHED_FIFO priority to ask the system for; 0: normal scheduling", "", 0, 99
    ),
    NodeParameter("wait_for_subscribers", 1, "publish the first sample when so many listen; later ones always", "", 0, 100),
    NodeParameter("wait_for_nodes", [""], "and when these nodes do, such as recorder, so that it has the start; empty: none"),
    NodeParameter("diagnostics_period", 1.0, "time between two reports on /diagnostics", "s", 0.01, 3600.0),
)
_LOOK = 0.02  # physical scale: [s] between two looks at who listens; well below the rest before a motion


class LoopNode(FricNode):
    """A node that answers sample by sample.

    Args:
        name: of the node.
        declarations: its parameters besides the common ones.
        options: as for :class:`FricNode`.

    Attributes:
        joint: name of the joint.
        lock_step: True when time is the number of the sample.
        period: of the loop [s]; 0 when the node has none.

    Raises:
        NodeParameterError: a parameter has a value that can't be used.
    """

    def __init__(self, name: str, declarations: Sequence[NodeParameter], **options: Any) -> None:
        super().__init__(name, (*COMMON, *declarations), **options)
        self.joint = self.settings.text("joint")
        self.lock_step = LOCK_STEP in declarations and self.settings.flag("lock_step")
        self.period = self.settings.number("period") if PERIOD in declarations else 0.0
        self.deadlines = Deadlines(0.0 if self.lock_step else self.period)
        self._scheduling = "normal"
        self._heard = False
        self._look_again = 0.0  # [s], monotonic
        reporter = self.report_every(self.settings.number("diagnostics_period"))
        reporter.more = lambda: {"scheduling": self._scheduling, **self.condition()}

    @staticmethod
    def make_executor() -> Executor:
        """An executor with little work per message.

        The SingleThreadedExecutor collects all entities anew for every wait and wraps each callback into a task:
        ``fric bench lock-step`` is several times as fast with the events executor.
        """
        return EventsExecutor()

    def begin(self) -> None:
        """Ask for real-time scheduling, where it is wanted."""
        priority = self.settings.integer("realtime_priority")
        if priority > 0 and not self.lock_step:
            self._scheduling = use_realtime_scheduling(priority)
            self.get_logger().info(f"scheduling: {self._scheduling}")

    @property
    def input_qos(self) -> QoSProfile:
        """With which the loop takes samples: every one of them in lock-step, the newest in wall time."""
        return SAMPLES if self.lock_step else LATEST

    def take_in(self, kind: Any, topic: str, take: Callable[[Any], None]) -> Subscription:
        """Give each message on ``topic`` to ``take``, in their order; in wall time together with all that have come after it.

        The executors of rclpy that wait on a set of entities hand over one message a round, and only to one of the callbacks
        that exclude each other. A node that has fallen behind would stay behind: it would take the oldest message of a full
        queue each time, refuse it for its age, and seldom come to the topics that stand later in the set.
        """
        if self.lock_step:
            return self.create_subscription(kind, topic, take, self.input_qos)
        made: list[Subscription] = []

        def take_all(message: Any) -> None:
            take(message)
            # A node that has just been taken down has no handle any more.
            with suppress(InvalidHandle):
                for subscription in made:
                    with subscription.handle:
                        for _ in range(self.input_qos.depth):
                            waiting = subscription.handle.take_message(kind, False)
                            if waiting is None:
                                break
                            take(waiting[0])

        made.append(self.create_subscription(kind, topic, take_all, self.input_qos))
        return made[0]

    def start_anew(self) -> None:
        """Forget who has listened so far, and how well deadlines were kept."""
        self._heard = False
        self.deadlines.skip()

    def summary(self) -> str:
        """Joint and clock; what else the node works with comes after it."""
        clock = "lock-step" if self.lock_step else "wall time"
        period = f", period {self.period:g} s, {clock}" if self.period > 0.0 else ""
        return f"joint {self.joint}{period}"

    def has_audience(self, publisher: Publisher) -> bool:
        """True once as many nodes as asked for listen to ``publisher``, and from then on."""
        if not self._heard:
            listening = publisher.get_subscription_count()
            self._heard = listening >= self.settings.integer("wait_for_subscribers") and self._awaited_listen(publisher)
        return self._heard

    def _awaited_listen(self, publisher: Publisher) -> bool:
        """True once all nodes of the parameter ``wait_for_nodes`` listen to ``publisher``."""
        names = self.settings.texts("wait_for_nodes")
        now = time.monotonic()
        if not names or now < self._look_again:
            return not names
        self._look_again = now + _LOOK
        listening = set()
        for end in self.get_subscriptions_info_by_topic(publisher.topic_name):
            listening |= {end.node_name, f"{end.node_namespace.rstrip('/')}/{end.node_name}"}
        missing = [name for name in names if name not in listening]
        if missing:
            self.get_logger().info(f"waiting for {', '.join(missing)}", throttle_duration_sec=5.0)
        return not missing and publisher.get_subscription_count() >= len(names)

    def state_of_joint(self, message: JointState) -> JointSample | None:
        """The joint's part of ``message``; None, and a refusal, when it can't be used."""
        return self.usable("joint state", self._of_joint, message)

    def _of_joint(self, message: JointState) -> JointSample:
        return joint_sample(message, self.joint)

    def refuse_late_state(self) -> None:
        """Refuse a joint state whose stamp is not later than the one before."""
        self.refuse("joint state", "its stamp is not later than the last one's")


def wall_clock() -> tuple[int, int]:
    """Time since 1970 and monotonic time of one instant [ns]: stamps count on from here, free of clock corrections."""
    return time.time_ns(), time.monotonic_ns()
