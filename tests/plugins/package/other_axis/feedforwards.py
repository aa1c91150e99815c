"""A constant force."""

from __future__ import annotations

from fric.control.feedforward_kind import FeedforwardKind, Force, Setting
from fric.parameter import Parameter


class Constant:
    friction = 0.0

    def __init__(self, force: float) -> None:
        self.force = force

    def reset(self) -> None:
        pass

    def step(self, time: float, position: float, velocity: float, acceleration: float) -> float:
        return self.force


def build(setting: Setting) -> Force:
    return Constant(setting.values["force"])


FEEDFORWARD = FeedforwardKind("constant", "constant force", build, (Parameter("force", "F", "F", "force", default=0.0),))
