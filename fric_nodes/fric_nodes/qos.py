"""Quality of service of every topic, in one place.

Samples are reliable and kept in a queue that holds far more than a node can be behind: in lock-step, at some thousand samples
a second, a recorder that has to wait for the processor is soon hundreds behind, and wants all of them. A model is kept for
whoever comes later.
"""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

__all__ = ["DIAGNOSTICS", "MODEL", "SAMPLES"]

SAMPLES = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=2000, reliability=ReliabilityPolicy.RELIABLE)
"""``joint_states``, ``reference``, ``feedforward_force``, ``force_command``."""

MODEL = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""``friction/model``: the last one, also for a node that starts later."""

DIAGNOSTICS = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=10, reliability=ReliabilityPolicy.RELIABLE)
"""``/diagnostics``."""
