"""The control law of the node ``pid``: its own gains as ROS parameters, settable while it runs, or a controller file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fric.control.controller import Law
from fric.control.controller_file import read_controller
from fric.control.feedbacks.pid import Pid, PidError, PidGains
from fric.errors import InputError

from .forces import STAMPED
from .loop import LOCK_STEP, PERIOD
from .parameters import NodeParameter, Settings
from .wall_time import LIMITS, REFERENCES, STATES

__all__ = ["CONTROLLER_FILE", "PARAMETERS", "gains_of", "law_of", "same_period"]

_SAME = 1e-6  # numerical: relative difference of two periods that are meant to be one
CONTROLLER_FILE = NodeParameter(
    "controller_file", "", "a fric-controller/1 file: its controller takes the place of the PID and its gains; empty: none"
)
_DERIVATIVE_TIME = 100.0  # physical scale: [s] no axis is damped for so long; a slip of the hand in a gain is far beyond
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
PARAMETERS = (
    PERIOD,
    LOCK_STEP,
    *GAINS,
    CONTROLLER_FILE,
    NodeParameter("use_feedforward", True, "add the feedforward force; in lock-step false means not to wait for one"),
    NodeParameter("feedforward_timeout", 0.1, "wall time: leave out a feedforward that is older", "s", 1e-3, 1e6),
    *REFERENCES,
    *STATES,
    *LIMITS,
    STAMPED,
)


def gains_of(values: Mapping[str, Any], period: float) -> PidGains:
    """The gains among ``values`` of parameters by name, for a loop with ``period`` [s].

    Raises:
        PidError: one of them can't be used, or they make no sense together.
    """
    gains = PidGains(*(float(values[parameter.name]) for parameter in GAINS if parameter.name != "force_limit"))
    kp, ki, kd = gains.proportional, gains.integral, gains.derivative
    if ki * period > kp > 0.0:
        given = f"ki is {ki:g} and kp {kp:g}: an integral time of {kp / ki:.3g} s, below the period of {period:g} s"
        raise PidError("gains", given, f"give a ki of at most {kp / period:.4g}")
    if kd > _DERIVATIVE_TIME * kp > 0.0:
        given = f"kd is {kd:g} and kp {kp:g}: a derivative time of {kd / kp:.3g} s"
        raise PidError("gains", given, f"give a kd of at most {_DERIVATIVE_TIME * kp:.4g}")
    return gains


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
        return Pid(gains_of(settings.values(), period), limit)
    found = read_controller(path)
    same_period(path, found.period, period)
    if found.feedforward is not None and not settings.flag("use_feedforward"):
        problem = "names a feedforward, which the node compensator computes, and use_feedforward is false"
        raise InputError(path, problem, "give the file to both nodes and set use_feedforward")
    return found.kind.build(found.gains, min(limit, found.force_limit))
