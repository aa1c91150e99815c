"""The gains of the node ``pid`` as ROS parameters, all settable while it runs."""

from __future__ import annotations

from fric.control.feedbacks.pid import PidGains

from .parameters import NodeParameter, Settings

__all__ = ["GAINS", "gains_of"]

_LARGEST = 1e12  # physical scale: far above any gain or force of an axis
GAINS = (
    NodeParameter("kp", 1e5, "proportional gain", "N/m or N m/rad", 0.0, _LARGEST, settable=True),
    NodeParameter("ki", 0.0, "integral gain", "N/(m s) or N m/(rad s)", 0.0, _LARGEST, settable=True),
    NodeParameter("kd", 0.0, "derivative gain", "N s/m or N m s/rad", 0.0, _LARGEST, settable=True),
    NodeParameter("filter_time", 0.001, "time constant of the derivative filter", "s", 0.0, 10.0, settable=True),
    NodeParameter("position_weight", 1.0, "weight of the reference in the proportional part", "", 0.0, 2.0, settable=True),
    NodeParameter("velocity_weight", 1.0, "weight of the reference in the derivative part", "", 0.0, 2.0, settable=True),
    NodeParameter("tracking_time", 0.0, "time constant of the anti-windup; 0: kp/ki", "s", 0.0, 1e3, settable=True),
    NodeParameter("force_limit", 1e6, "largest command", "N or N m", 0.0, _LARGEST, settable=True),
)


def gains_of(settings: Settings) -> PidGains:
    """The present gains.

    Raises:
        PidError: one of them can't be used.
    """
    value = settings.number
    return PidGains(
        value("kp"), value("ki"), value("kd"), value("filter_time"), value("position_weight"), value("velocity_weight"),
        value("tracking_time"),
    )  # fmt: skip
