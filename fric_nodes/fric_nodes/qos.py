"""Quality of service of every topic, in one place.

Samples are reliable and kept in a queue that holds far more than a node can be behind: in lock-step, at some thousand samples
a second, a recorder that has to wait for the processor is soon hundreds behind, and wants all of them. A model is kept for
whoever comes later.

A control loop in wall time takes its samples with best effort instead, from a short queue: it wants the newest, and never an
old one sent again. A reliable subscription hands samples over in their order. When its process is held up, the shared-memory
port of Fast DDS is full after 512 messages, and what comes after that is lost; the subscription then waits with all newer
samples until the lost ones have been asked for, which the publisher's heartbeat allows every 3 s.
"""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

__all__ = ["DIAGNOSTICS", "LATEST", "MODEL", "SAMPLES"]

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
