"""What a plant is: the bodies between command and sensor, with their equations of motion.

A plant lives in a file of its own in ``plants/`` and offers three compiled functions, and whatever helpers they call:

``step(p, x, x_next, s, u, h, around) -> float``
    leads the state ``x`` and the inner states ``s`` of the terms over one step of ``h`` [s] under the constant command ``u``,
    writes ``x_next`` and ``s.z_next``, and returns the mean friction force at the contact [F];
``own(c, p) -> float``
    the plant's own force at the contact (gravity, a spring), positive when it opposes positive motion [F];
``drive(p, q, v, a) -> float``
    the force that the motion needs without any term of the model [F].

They use the model's terms under the names of :mod:`fric.engine.assembled`; ``p`` holds all values, the plant's own first.
The body at the contact is led by :mod:`fric.engine.contact`, whatever else moves around it. Of modules only ``math`` is
at hand.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .parameter import Parameter
from .record import Array

__all__ = ["Plant", "Signal"]

_FORCE = Parameter("force", "u", "F", "force of the actuator")


@dataclass(frozen=True, eq=False)
class Signal:
    """Something that a plant measures besides position and velocity.

    Attributes:
        name: the topic's name, such as ``normal_load``.
        dimension: as of a parameter.
        doc: what it is.
        of: its values, shape ``(n,)``, from the plant's values, the states ``(n, n_states)`` and the commands ``(n,)``.
    """

    name: str
    dimension: str
    doc: str
    of: Callable[[Array, Array, Array], Array]


@dataclass(frozen=True, eq=False)
class Plant:
    """One kind of plant; the file that defines it is its whole implementation.

    Attributes:
        id: ``type`` in a model file.
        title: its name in a sentence.
        equation: plain-text equation of motion.
        source: paper and equation number.
        parameters: the plant's own; they come first in ``p``.
        states: names of the mechanical states; the first two are position and velocity of the contact.
        functions: the compiled functions, ``step``, ``own`` and ``drive`` among them, each after those that it calls.
        inertia: mass that the contact feels [F s^2/x] from the plant's own values, for step sizes.
        encoder: which states the sensor reports as position and velocity.
        whole: mass that a slow command moves [F s^2/x], from the plant's own values; None: as ``inertia``.
        actuated: which states are position and velocity of the body that the command moves; None: as ``encoder``.
        motor: mass of that body, by itself [F s^2/x], from the plant's own values; None: as ``whole``.
        initial: the states at rest from ``(values, position, velocity)``; None: zeros, but for position and velocity.
        signals: what it measures besides.
        effort: the force on the contact, as :attr:`Signal.of`, where the command isn't a force; None: the applied command.
        command: what the command is.
        rate: fastest rate of the plant itself [1/s] from its own values; None: slow.
        driven: the plant whose functions take over when the model has a transmission; None: it can't have one.
        behind: the same with the sensor on the load; None: the sensor can't be there.
        led: the effort is measured at the contact: what moves the bodies is not in it, nor is their mass to be found.
    """

    id: str
    title: str
    equation: str
    source: str
    parameters: tuple[Parameter, ...]
    states: tuple[str, ...]
    functions: tuple[Callable[..., Any], ...]
    inertia: Callable[..., float]
    encoder: tuple[int, int] = (0, 1)
    initial: Callable[[Array, float, float], Array] | None = None
    signals: tuple[Signal, ...] = ()
    effort: Callable[[Array, Array, Array], Array] | None = None
    command: Parameter = _FORCE
    rate: Callable[..., float] | None = None
    driven: Plant | None = None
    behind: Plant | None = None
    whole: Callable[..., float] | None = None
    actuated: tuple[int, int] | None = None
    motor: Callable[..., float] | None = None
    led: bool = False

    def total_inertia(self, *values: float) -> float:
        """Mass that a slow command moves [F s^2/x]."""
        return (self.inertia if self.whole is None else self.whole)(*values)

    def motor_inertia(self, *values: float) -> float:
        """Mass of the body that the command moves, by itself [F s^2/x]."""
        return self.total_inertia(*values) if self.motor is None else self.motor(*values)

    @property
    def inertia_names(self) -> tuple[str, ...]:
        """Names of the parameters that are a mass, or a moment of inertia, of the moving body: what a force may not show."""
        return tuple(each.name for each in self.parameters if each.dimension == "F s^2/x" and each.positive)

    def start(self, values: Array, position: float, velocity: float) -> Array:
        """The states at the start of a run, ``(n_states,)``, with the sensor at ``position`` [x] and ``velocity`` [x/s]."""
        if self.initial is not None:
            return self.initial(values, position, velocity)
        states = np.zeros(len(self.states))
        states[:2] = position, velocity
        return states
