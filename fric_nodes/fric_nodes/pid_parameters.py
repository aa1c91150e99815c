"""The control law of the node ``pid``: its own gains as ROS parameters, settable while it runs, or a controller file."""

from __future__ import annotations

from fric.control.controller import Law
from fric.control.controller_file import read_controller
from fric.control.feedbacks.pid import Pid, PidGains
from fric.errors import InputError

from .parameters import NodeParameter, Settings

__all__ = ["CONTROLLER_FILE", "GAINS", "gains_of", "law_of", "same_period"]

_SAME = 1e-6  # numerical: relative difference of two periods that are meant to be one
CONTROLLER_FILE = NodeParameter(
    "controller_file", "", "a fric-controller/1 file: its controller takes the place of the PID and its gains; empty: none"
)
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


def same_period(path: str, given: float, period: float) -> None:
    """Refuse a file that is for another period [s] than this node's.

    Raises:
        InputError: it is.
    """
    if abs(given - period) > _SAME * period:
        raise InputError(path, f"is for a period of {given:g} s, this node's is {period:g} s", "give both the same")


def law_of(settings: Settings, period: float) -> Law:
    """The law that answers joint states every ``period`` [s].

    Raises:
        InputError: a gain can't be used; or the controller file, or it is for another period, or names a feedforward
            that nobody would add.
    """
    path, limit = settings.text(CONTROLLER_FILE.name), settings.number("force_limit")
    if not path:
        return Pid(gains_of(settings), limit)
    found = read_controller(path)
    same_period(path, found.period, period)
    if found.feedforward is not None and not settings.flag("use_feedforward"):
        problem = "names a feedforward, which the node compensator computes, and use_feedforward is false"
        raise InputError(path, problem, "give the file to both nodes and set use_feedforward")
    return found.kind.build(found.gains, min(limit, found.force_limit))
