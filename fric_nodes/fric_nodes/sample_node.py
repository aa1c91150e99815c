"""A node that learns from joint states: position and effort of each sample, taken in bulk.

Where the joint states carry no effort, or the command is wanted, the force command serves, in the type that is published.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import Any

from fric.signals.sample_pairs import EffortPairing, Sample
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from .base import FricNode
from .bulk import BulkSubscription
from .convert import JointSample, joint_sample
from .forces import force_in
from .parameters import NodeParameter
from .qos import SAMPLES

__all__ = ["JOINT_STATES", "SampleNode"]

JOINT_STATES = (
    NodeParameter("joint", "", "name of the joint; empty: the only or first one of the joint states"),
    NodeParameter(
        "effort_hold", "preceding", "when an effort in a joint state acts", choices=("following", "preceding", "linear")
    ),
)
_QUEUE = 5000  # samples that may wait while a block is being worked on
_ROUND = 0.01  # [s] between two rounds of taking samples
_BATCH = 1000  # samples worked on in one round, so that services get their turn
_REPORT = 1.0  # [s] between two reports


class SampleNode(FricNode):
    """Takes joint states, and gives each sample with its effort to :meth:`learn`.

    Args:
        name: of the node.
        declarations: its parameters besides :data:`JOINT_STATES`.
        options: as for :class:`FricNode`.

    Attributes:
        joint: name of the joint; empty until the first joint state when none was given.
        pairing: says which effort belongs to which sample.
        by_command: the force is the command, whatever the joint states carry.
        newest: stamp of the newest sample that was learnt from [ns]; -1 before.
    """

    def __init__(self, name: str, declarations: Sequence[NodeParameter], **options: Any) -> None:
        super().__init__(name, (*JOINT_STATES, *declarations), **options)
        self.joint = self.settings.text("joint")
        self.pairing = EffortPairing(self.settings.text("effort_hold"))
        self.by_command = False
        self.newest = -1
        self._origin = -1  # [ns]; seconds since 1970 would leave too few digits for the steps
        self._unstamped = False
        deep = QoSProfile(depth=_QUEUE, reliability=SAMPLES.reliability)
        self._states = BulkSubscription(self, "sensor_msgs/msg/JointState", "joint_states", deep, raw=False)
        self._commands: BulkSubscription | None = None
        self.create_timer(_ROUND, self.work, clock=self.steady)
        self.report_every(_REPORT)

    def learn(self, time: float, sample: Sample) -> None:
        """Use ``sample``, which is ``time`` [s] after the first one; for the node to define."""
        raise NotImplementedError

    def after_round(self, taken: int) -> None:
        """Called after each round, in which ``taken`` joint states came."""

    def seconds(self) -> float:
        """Time of the newest sample since the first one [s]."""
        return (self.newest - self._origin) * 1e-9

    def work(self) -> None:
        """Take what has come and learn from it."""
        before = time.time_ns()  # the clock on which the middleware stamps reception
        self._take_commands()
        taken = 0
        for message, received, _ in self._states.take(_BATCH):
            taken += 1
            self._take(message, received)
        for sample in self.pairing.ready(before):
            if self._origin < 0:
                self._origin = sample.time
            self.learn((sample.time - self._origin) * 1e-9, sample)
            self.newest = sample.time
        self._listen_to_commands()
        self.after_round(taken)

    def _take_commands(self) -> None:
        if self._commands is None:
            return
        for message, received, _ in self._commands.take(_BATCH):
            command = self.usable("command", force_in, message)
            if command is not None:
                stamp, force = command
                self.pairing.command(force, received, None if stamp < 0 else stamp)

    def _of_joint(self, message: JointState) -> JointSample:
        if not self.joint and message.name:
            self.joint = message.name[0]
        return joint_sample(message, self.joint)

    def _take(self, message: JointState, received: int) -> None:
        sample = self.usable("joint state", self._of_joint, message)
        if sample is None:
            return
        if sample.stamp and self._unstamped:
            # In lock-step the first stamp is 0, which looks like none; time by the wall doesn't go with what follows.
            self.pairing.clear()
            self._origin = -1
        self._unstamped = not sample.stamp
        effort = math.nan if self.by_command else sample.effort
        self.pairing.state(Sample(sample.stamp or received, received, sample.position, effort))

    def _listen_to_commands(self) -> None:
        if self._commands is not None or not (self.by_command or self.pairing.lacks_effort):
            return
        topic = self.resolve_topic_name("force_command")
        for publisher in self.get_publishers_info_by_topic(topic):
            deep = QoSProfile(depth=_QUEUE, reliability=publisher.qos_profile.reliability)
            self._commands = BulkSubscription(self, publisher.topic_type, topic, deep, raw=False)
            self.get_logger().info(f"the force is taken from {topic}")
            return

    def close(self) -> None:
        """Learn from what has come."""
        self.work()
