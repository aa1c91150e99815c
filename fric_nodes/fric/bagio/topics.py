"""What every reader of recordings here speaks of: a topic of a bag, a message as it was recorded, and the roles of topics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from rosbags.interfaces import MessageDefinition

__all__ = ["Raw", "Topic", "Topics", "ros2_name"]


class Topic(NamedTuple):
    """A topic in a bag: name, message type, number of messages, definition of the type as stored in the bag.

    ``encoding`` is how its messages are written: ``cdr``, or ``ros1``.
    """

    name: str
    msgtype: str
    n_messages: int
    definition: MessageDefinition
    encoding: str = "cdr"


class Raw(NamedTuple):
    """A message as recorded: topic, message type, time of reception [ns], bytes (CDR, or those of ROS 1)."""

    topic: str
    msgtype: str
    log_time_ns: int
    data: bytes


@dataclass(frozen=True)
class Topics:
    """Names of the topics in a bag; a name that is not there also matches one single topic under a namespace.

    A name may have a selection behind a colon that says which number of a message is meant (``/effort_controller/commands:0``),
    see :mod:`.selection`; with one, a topic of any type may be named for every role but ``joint_states`` and ``reference``.

    Attributes:
        joint_states: ``sensor_msgs/msg/JointState``, or another type of several joints, see :mod:`.joints`.
        force_command: ``std_msgs/msg/Float64`` or ``fric_interfaces/msg/StampedForce`` [N or N m], each held until the next.
        reference: ``fric_interfaces/msg/Reference``, or the state of a trajectory controller.
        feedforward: as ``force_command``; not part of a record, but known to reports.
        normal_load: as ``force_command`` [N], as are all further signals of a plant.
        temperature: as ``normal_load`` [degC].
        effort: a measured force, taken in place of that of the joint states, interpolated between its messages [N or N m];
            such as ``/wrench:wrench.force.z``; empty: that of the joint states, or the command.
    """

    joint_states: str = "/joint_states"
    force_command: str = "/force_command"
    reference: str = "/reference"
    feedforward: str = "/feedforward_force"
    normal_load: str = "/normal_load"
    temperature: str = "/temperature"
    effort: str = ""


def ros2_name(msgtype: str) -> str:
    """Name of a ROS 1 type as ROS 2 writes it: ``sensor_msgs/JointState`` is ``sensor_msgs/msg/JointState``."""
    package, _, rest = msgtype.partition("/")
    return f"{package}/msg/{rest}" if rest and "/" not in rest else msgtype
