"""A proportional controller."""

from __future__ import annotations

from fric.control.controller import Controller, Setpoint
from fric.parameter import Parameter


class Proportional:
    def __init__(self, gain: float, limit: float) -> None:
        self.gain, self.limit, self.saturated = gain, limit, 0

    def begin(self, wanted: Setpoint, state: tuple[float, float], force: float, duration: float) -> None:
        pass

    def reset(self) -> None:
        pass

    def answer(self, wanted: Setpoint, measured: float, duration: float, feedforward: float = 0.0) -> float:
        return min(max(self.gain * (wanted.position - measured) + feedforward, -self.limit), self.limit)


CONTROLLER = Controller(
    "proportional",
    "proportional controller",
    (Parameter("gain", "k", "F/x", "force per error", lower=0.0, default=100.0),),
    lambda values, limit: Proportional(values["gain"], limit),
)
