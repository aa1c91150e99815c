"""The limits of the safety layer as ROS parameters; the same names in every node that commands a force."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from fric.control.safety import Limits

from .parameters import NodeParameter, Settings

__all__ = ["ENABLED", "RESUME", "SAFETY", "limits_of", "safety_parameters"]

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
RESUME = NodeParameter("resume", True, "wall time: go on by itself when a command or a joint state that was lost is back")
ENABLED = NodeParameter("enable_at_start", True, "wall time: let forces through from the start; otherwise when ~/enable asks")

_RENAMED = {"force_limit": "force", "speed_limit": "speed", "temperature_limit": "temperature"}


def safety_parameters(*left_out: str, **defaults: float) -> tuple[NodeParameter, ...]:
    """The parameters of a node on whose side the loop is simulated: no limit but those that are given, in wall time only.

    Args:
        left_out: names of those that the node declares itself, or has no use for.
        defaults: by name, where they differ.
    """
    given = {"force_rate": _NONE, **defaults}
    return tuple(
        replace(p, default=given.get(p.name, p.default), doc=f"wall time: {p.doc}") for p in SAFETY if p.name not in left_out
    )


def limits_of(settings: Settings, period: float, **given: float | bool) -> Limits:
    """The limits, for a loop with ``period`` [s].

    Args:
        settings: values of the parameters.
        period: of the loop.
        given: limits by their names in :class:`Limits`, in the place of parameters.

    Raises:
        SafetyError: they make no sense together.
    """
    values: dict[str, Any] = {}
    for parameter in SAFETY:
        if isinstance(parameter.default, bool) or parameter.name not in settings:
            continue
        value = settings.number(parameter.name)
        unlimited = abs(value) >= _NONE
        values[_RENAMED.get(parameter.name, parameter.name)] = math.copysign(math.inf, value) if unlimited else value
    values |= {"hold": settings.flag("hold"), "longest_step": 2.0 * period, **given}
    return Limits(**values)
