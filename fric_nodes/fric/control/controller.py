"""What a feedback controller is: its parameters, and a law that answers one reading of the position after the other.

A controller is one file in ``control/feedbacks/`` with a constant ``CONTROLLER``, found by being there. Controller files
(``fric-controller/1``), closed-loop simulations and the node ``pid`` take its parameters from the declaration.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, Protocol

from ..errors import InputError
from ..model import Model
from ..parameter import Parameter
from .tunable import Tunable

__all__ = ["ControlInputError", "Controller", "Law", "Setpoint", "check_inputs"]


class ControlInputError(InputError):
    """A sample that a control law can't answer."""


class Setpoint(NamedTuple):
    """The motion wanted at one instant: position [x], velocity [x/s], acceleration [x/s^2]."""

    position: float
    velocity: float = 0.0
    acceleration: float = 0.0


def check_inputs(wanted: Setpoint, measured: float, duration: float, feedforward: float) -> None:
    """Refuse what isn't finite; arguments as of :meth:`Law.answer`.

    Raises:
        ControlInputError: an input isn't finite, or the duration isn't positive.
    """
    if not math.isfinite(wanted.position + wanted.velocity + wanted.acceleration + measured + feedforward):
        given = f"wanted {tuple(wanted)}, measured {measured}, feedforward {feedforward}"
        raise ControlInputError("controller", f"an input is not finite ({given})", "leave the sample out")
    if not 0.0 < duration < math.inf:
        raise ControlInputError("controller", f"duration is {duration}", "give the time since the last sample, greater than 0")


class Law(Protocol):
    """A controller at work, with its state."""

    limit: float
    """Largest output [F]."""

    @property
    def saturated(self) -> int:
        """Number of samples at which the limit took something away."""

    def begin(self, wanted: Setpoint, state: tuple[float, float], force: float, duration: float) -> None:
        """Start in motion, as if it had been controlling before.

        Args:
            wanted: at the first sample.
            state: position [x] and velocity [x/s] then.
            force: output at the first sample [F]; what the gains don't give stands in an integral, where there is one.
            duration: time between samples [s].
        """

    def reset(self) -> None:
        """Start anew, at rest."""

    def answer(self, wanted: Setpoint, measured: float, duration: float, feedforward: float = 0.0) -> float:
        """Output [F] for one sample that comes ``duration`` [s] after the last.

        Args:
            wanted: motion wanted.
            measured: position [x].
            duration: time since the last sample [s].
            feedforward: force added inside the limit [F].

        Raises:
            InputError: an input or the output isn't finite.
        """


@dataclass(frozen=True)
class Controller:
    """One kind of controller.

    Attributes:
        id: its name in files and parameters.
        title: its name in a sentence.
        parameters: its gains.
        build: the law with values of all parameters by name, and the largest output [F].
        source: where it comes from.
        designed: of a kind whose gains come from a design file, the kind that holds the one at a path; None: it has none.
        units: of position and force that a design holds for, as text; None: any.
        from_model: parameters that an identified model gives, by name; None: there are none.
        tunable: how its gains are made from an identified model; None: they are given by hand.
    """

    id: str
    title: str
    parameters: tuple[Parameter, ...]
    build: Callable[[Mapping[str, float], float], Law] = field(repr=False)
    source: str = ""
    designed: Callable[[Path], Controller] | None = field(default=None, repr=False)
    units: tuple[str, str] | None = None
    from_model: Callable[[Model], dict[str, float]] | None = field(default=None, repr=False)
    tunable: Tunable | None = field(default=None, repr=False)

    def refusal(self, values: Mapping[str, float]) -> str | None:
        """What is wrong with ``values``, or None when they can be used."""
        for parameter in self.parameters:
            said = parameter.refusal(values[parameter.name])
            if said is not None:
                return f"{parameter.name} {said}"
        return None
