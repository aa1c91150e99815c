"""Quality of service of every topic, in one place.

Samples are reliable and kept in a queue that holds far more than a node can be behind: in lock-step, at some thousand samples
a second, a recorder that has to wait for the processor is soon hundreds behind, and wants all of them. A model is kept for
whoever comes later.

A control loop in wall time takes its samples with best effort instead, from a short queue: it wants the newest, and never an
old one sent again. A reliable subscription hands samples over in their order. When its process is held up, the shared-memory
port of Fast DDS is full after 512 messages, and what comes after that is lost; the subscription then waits with all newer
samples until the lost ones have been asked for, which the publisher's heartbeat allows every 3 s.

Each topic of samples that a node takes or gives has a parameter ``qos.TOPIC``. With ``sensor_data`` a subscription also
receives from a publisher that offers best effort, as encoders and drives often do; a publisher then sends no message twice.
"""

from __future__ import annotations

from collections.abc import Mapping

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from .parameters import NodeParameter

__all__ = [
    "DIAGNOSTICS",
    "LATEST",
    "MODEL",
    "SAMPLES",
    "SAMPLE_TOPICS",
    "as_text",
    "chosen_qos",
    "qos_parameter",
    "qos_parameters",
]

SAMPLES = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=2000, reliability=ReliabilityPolicy.RELIABLE)
"""``joint_states``, ``reference``, ``feedforward_force``, ``force_command``."""

LATEST = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)
"""The same topics as a control loop in wall time takes them; publishers offer more."""

MODEL = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""``friction/model``: the last one, also for a node that starts later."""

DIAGNOSTICS = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=10, reliability=ReliabilityPolicy.RELIABLE)
"""``/diagnostics``."""

_RELIABILITY = {"reliable": ReliabilityPolicy.RELIABLE, "sensor_data": ReliabilityPolicy.BEST_EFFORT}

SAMPLE_TOPICS: Mapping[str, tuple[str, ...]] = {
    "plant": ("joint_states", "force_command"),
    "hardware_bridge": ("joint_states", "force_command", "reference", "drive_states"),
    "excitation": ("joint_states", "reference", "force_command"),
    "compensator": ("reference", "feedforward_force", "feedforward_friction"),
    "pid": ("joint_states", "reference", "feedforward_force", "force_command"),
    "experiment": ("joint_states", "reference", "feedforward_force", "force_command"),
    "identifier": ("joint_states",),
    "monitor": ("joint_states",),
}
"""Topics of samples, by the name that a node has by default. The recorder and the player go by what they find.

The force command to the identifier and the monitor is taken as it is offered. ``drive_states`` is the topic of the parameter of
this name.
"""


def qos_parameter(topic: str) -> str:
    """Name of the parameter for ``topic``."""
    return f"qos.{topic}"


def qos_parameters(node: str) -> tuple[NodeParameter, ...]:
    """The parameters of the node that is called ``node`` by default."""
    about = "quality of service: default (docs/howto/run_the_nodes.md), reliable, or sensor_data: best effort"
    return tuple(
        NodeParameter(qos_parameter(topic), "default", f"{topic}: {about}", choices=("default", *_RELIABILITY))
        for topic in SAMPLE_TOPICS.get(node, ())
    )


def chosen_qos(chosen: str, profile: QoSProfile) -> QoSProfile:
    """The quality of service that a parameter asks for.

    Args:
        chosen: one of its choices.
        profile: of the node itself.
    """
    if chosen == "default":
        return profile
    return QoSProfile(
        history=profile.history, depth=profile.depth, reliability=_RELIABILITY[chosen], durability=profile.durability
    )


def as_text(qos: QoSProfile) -> str:
    """Reliability and depth, and durability where it is more than the usual, in words."""
    kept = ", transient local" if qos.durability is DurabilityPolicy.TRANSIENT_LOCAL else ""
    return f"{qos.reliability.name.lower().replace('_', ' ')}, depth {qos.depth}{kept}"
