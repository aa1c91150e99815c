"""What an axis may do, and the bounds on its dynamics from which the safety layer derives the rest."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from ...errors import InputError

__all__ = ["Limits", "SafetyError"]


class SafetyError(InputError):
    """Limits that can't be used, or a request that the present state doesn't allow."""


_POSITIVE = ("force", "force_rate", "speed", "command_timeout", "state_timeout", "longest_step", "brake_time", "readings")
_MAY_BE_INFINITE = ("force_rate", "speed", "position_min", "position_max", "following_error", "temperature", "inertia_max")
_INNER = {"readings", "longest_step", "rest_speed", "brake_time"}


@dataclass(frozen=True)
class Limits:
    """Limits of one axis and bounds on its dynamics. Every value is a physical scale of the machine.

    The bounds describe the axis as m dv/dt = F + d with inertia_min <= m <= inertia_max, |d| <= friction + viscous |v| + load.
    With ``inertia_min`` = 0 they are unknown: a stop takes the force away without braking; no motion is compared with force.

    Attributes:
        force: largest force [F].
        force_rate: largest change of the force [F/s].
        speed: largest speed [x/s].
        position_min: lower end of the range [x].
        position_max: upper end of the range [x].
        following_error: largest distance between reference and position [x].
        temperature: largest temperature [degC], where it is measured.
        inertia_min: least inertia of the axis [F s^2/x].
        inertia_max: largest inertia of the axis [F s^2/x].
        friction: largest resistance to motion that doesn't grow with speed, break-away included [F].
        viscous: largest growth of the resistance with speed [F s/x].
        load: largest force besides the drive's that can set the axis in motion, such as its weight [F].
        position_noise: largest error of a position reading, half an encoder step included [x].
        latency: largest time from a force's output until it acts, and from a reading's stamp until it is used [s].
        readings: readings in each half of the window over which motion is compared with force.
        command_timeout: a command of this age is lost [s].
        state_timeout: a joint state of this age is lost [s].
        clock_tolerance: how far a stamp may lie in the future [s].
        longest_step: a step counts as at most so long, so that the force doesn't jump after a stall [s].
        brake_time: time constant with which the last of the speed is braked [s]; several times the latency.
        rest_speed: the axis rests below it [x/s]; 0 takes a hundredth of the speed limit.
        hold: keep the position after a stop; otherwise the force goes to zero.
        resume: after a stop because a command or a joint state was lost, go on by itself when both are back; the cause is
            counted and not latched.

    Raises:
        SafetyError: a value can't be used, or the force can't brake the load.
    """

    force: float
    force_rate: float = math.inf
    speed: float = math.inf
    position_min: float = -math.inf
    position_max: float = math.inf
    following_error: float = math.inf
    temperature: float = math.inf
    inertia_min: float = 0.0
    inertia_max: float = math.inf
    friction: float = 0.0
    viscous: float = 0.0
    load: float = 0.0
    position_noise: float = 0.0
    latency: float = 0.004
    readings: int = 2
    command_timeout: float = 0.05
    state_timeout: float = 0.02
    clock_tolerance: float = 0.005
    longest_step: float = 0.004
    brake_time: float = 0.03
    rest_speed: float = 0.0
    hold: bool = False
    resume: bool = False

    def __str__(self) -> str:
        """Those that bound anything, in one line."""
        given = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in _INNER}
        told = [f"{name} {value:g}" for name, value in given.items() if value and abs(value) != math.inf]
        return f"limits: {', '.join(told)}"

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            infinite_is_good = name in _MAY_BE_INFINITE and not math.isnan(value)
            if not (math.isfinite(value) or infinite_is_good):
                raise SafetyError("safety limits", f"{name} is {value}", "give a finite number")
            if name not in {"position_min", "position_max", "temperature"} and value < 0:
                raise SafetyError("safety limits", f"{name} is {value}", "give a number of at least 0")
        for name in _POSITIVE:
            if not getattr(self, name) > 0:
                raise SafetyError("safety limits", f"{name} is {getattr(self, name)}", "give a number greater than 0")
        if not self.position_min < self.position_max:
            given = f"position_min {self.position_min:g} is not below position_max {self.position_max:g}"
            raise SafetyError("safety limits", given, "give the ends in this order")
        if self.inertia_min > 0.0 and not self.inertia_min <= self.inertia_max < math.inf:
            given = f"inertia_min is {self.inertia_min:g} and inertia_max {self.inertia_max:g}"
            raise SafetyError("safety limits", given, "give both, the least one first")
        if self.brakes and not math.isfinite(self.force_rate):
            raise SafetyError("safety limits", "a braking stop needs a finite force_rate", "give one, or inertia_min 0")
        if self.load >= self.force:
            given = f"the load of {self.load:g} is not below the force limit of {self.force:g}"
            raise SafetyError("safety limits", given, "a force that doesn't exceed the load can't stop the axis")
        if self.brakes and self.brake_time < 3.0 * self.latency:
            given = f"brake_time {self.brake_time:g} s is below three times the latency of {self.latency:g} s"
            raise SafetyError("safety limits", given, "give a longer brake_time: the braking loop would oscillate")

    @property
    def brakes(self) -> bool:
        """True when the inertia is known, so that a stop can brake."""
        return self.inertia_min > 0.0

    @property
    def at_rest(self) -> float:
        """Speed below which the axis counts as resting [x/s]."""
        if self.rest_speed > 0.0:
            return self.rest_speed
        return 0.01 * self.speed if math.isfinite(self.speed) else math.inf
