"""The limits of the safety layer as ROS parameters; the same names in every node that commands a force."""

from __future__ import annotations

import math
from typing import Any

from fric.control.safety import Limits

from .parameters import NodeParameter, Settings

__all__ = ["SAFETY", "limits_of"]

_NONE = 1e12  # physical scale: far above what an axis may have; stands for no limit, since a parameter can't be infinite
SAFETY = (
    NodeParameter("force_limit", 100.0, "largest force", "N or N m", 1e-9, _NONE),
    NodeParameter("force_rate", 5000.0, "largest change of the force in time", "N/s or N m/s", 1e-9, _NONE),
    NodeParameter("speed_limit", _NONE, "largest speed; 1e12: none", "m/s or rad/s", 1e-9, _NONE),
    NodeParameter("position_min", -_NONE, "lower end of the range; -1e12: none", "m or rad", -_NONE, _NONE),
    NodeParameter("position_max", _NONE, "upper end of the range; 1e12: none", "m or rad", -_NONE, _NONE),
    NodeParameter("following_error", _NONE, "largest distance of position and reference; 1e12: none", "m or rad", 1e-12, _NONE),
    NodeParameter("temperature_limit", _NONE, "largest temperature of the drive, where it is measured", "degC", 0.0, _NONE),
    NodeParameter(
        "inertia_min", 0.0, "least inertia; 0: unknown, a stop takes the force away without braking", "kg or kg m^2", 0.0, _NONE
    ),
    NodeParameter("inertia_max", _NONE, "largest inertia", "kg or kg m^2", 0.0, _NONE),
    NodeParameter("friction", 0.0, "largest resistance besides the viscous one, break-away included", "N or N m", 0.0, _NONE),
    NodeParameter("viscous", 0.0, "largest growth of the resistance with speed", "N s/m or N m s/rad", 0.0, _NONE),
    NodeParameter("load", 0.0, "largest force that moves the axis besides the drive's", "N or N m", 0.0, _NONE),
    NodeParameter("position_noise", 0.0, "largest error of a position reading, half a step included", "m or rad", 0.0, _NONE),
    NodeParameter("latency", 0.004, "from a force's output until it acts, and from a reading until its use", "s", 0.0, 1.0),
    NodeParameter("brake_time", 0.03, "time constant with which the last of the speed is braked", "s", 1e-3, 10.0),
    NodeParameter("command_timeout", 0.05, "a command of this age is lost", "s", 1e-3, 10.0),
    NodeParameter("state_timeout", 0.02, "a joint state of this age is lost", "s", 1e-3, 10.0),
    NodeParameter("clock_tolerance", 0.005, "how far a stamp may lie in the future", "s", 0.0, 10.0),
    NodeParameter("hold", False, "keep the position after a stop; otherwise the force goes to zero"),
)
"""Parameters of :class:`fric.control.safety.Limits`."""

_RENAMED = {"force_limit": "force", "speed_limit": "speed", "temperature_limit": "temperature"}


def limits_of(settings: Settings, period: float) -> Limits:
    """The limits, for a loop with ``period`` [s].

    Raises:
        SafetyError: they make no sense together.
    """
    values: dict[str, Any] = {}
    for parameter in SAFETY:
        if isinstance(parameter.default, bool):
            continue
        value = settings.number(parameter.name)
        unlimited = abs(value) >= _NONE
        values[_RENAMED.get(parameter.name, parameter.name)] = math.copysign(math.inf, value) if unlimited else value
    return Limits(**values, hold=settings.flag("hold"), longest_step=2.0 * period)
