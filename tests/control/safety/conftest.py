"""A simulated axis behind the safety layer, in library time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import pytest
from fric.axis import SimulatedAxis
from fric.control.safety import Limits, SafetyLayer
from fric.model import Model, build_model, term

H = 2_000_000  # [ns] period
DT = 1e-9 * H  # [s]
LIMITS = Limits(
    100.0, 3000.0, speed=0.5, position_min=-0.1, position_max=0.1,
    inertia_min=1.6, inertia_max=2.4, friction=16.0, viscous=40.0, position_noise=1e-7,
)  # fmt: skip


def slide(mass: float = 2.0, coulomb: float = 10.0, viscous: float = 35.0, bias: float = 0.0) -> Model:
    """A model of a slide with some friction and a constant load."""
    terms = [term("coulomb", force=coulomb), term("viscous", coefficient=viscous), term("bias", force=bias)]
    return build_model("rigid", {"mass": mass}, terms)


@dataclass
class Rig:
    """Axis and layer; ``wanted`` gives the commanded force from time [s] and position [m], ``seen`` what is measured."""

    model: Model = field(default_factory=slide)
    limits: Limits = LIMITS
    wanted: Callable[[float, float], float] = lambda t, x: 0.0
    seen: Callable[[float, float], float] = lambda t, x: x
    speaks: bool = True
    measures: bool = True
    positions: list[float] = field(default_factory=list)
    forces: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.axis = SimulatedAxis(self.model, resolution=2e-7)
        self.layer = SafetyLayer(self.limits)
        self.now = self.origin = 10**18

    def run(self, seconds: float, until: Callable[[], bool] = lambda: False) -> int:
        """Go on for so long, or until it holds; number of samples."""
        n_samples = round(seconds / DT)
        for k in range(n_samples):
            if until():
                return k
            self.now += H
            time = 1e-9 * (self.now - self.origin)
            position = self.seen(time, self.axis.measure().position)
            if self.measures:
                self.layer.reading(self.now, self.now, position)
            if self.speaks:
                self.layer.command(self.now, self.now, self.wanted(time, position), "test")
            force = self.layer.step(self.now)
            self.axis.advance(force, DT)
            self.positions.append(self.axis.position)
            self.forces.append(force)
        return n_samples

    def enable(self) -> None:
        """Let the readings come, and enable."""
        self.run(0.02)
        self.layer.enable(self.now)

    @property
    def speed(self) -> float:
        """True speed now [m/s]."""
        return (self.positions[-1] - self.positions[-2]) / DT


@pytest.fixture
def rig() -> type[Rig]:
    return Rig


@pytest.fixture
def model() -> Callable[..., Model]:
    return slide
