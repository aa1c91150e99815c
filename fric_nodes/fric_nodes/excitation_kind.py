"""What an excitation is: a planned motion, known for all times in advance.

An excitation lives in a file of its own in ``excitation/`` and offers a constant ``EXCITATION``: its parameters, declared as
everywhere, and a function that plans the motion for their values. The plan gives position, velocity and acceleration in
closed form, so that a node may ask for any sample, in any order, and gets the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from .errors import InputError
from .parameter import Parameter
from .record import Array

__all__ = ["Excitation", "ExcitationError", "Plan", "Points", "Trajectory"]


class ExcitationError(InputError):
    """An excitation that can't be planned as asked."""


class Points(NamedTuple):
    """A motion at some times; each of shape ``(n,)``: position [x], velocity [x/s], acceleration [x/s^2]."""

    position: Array
    velocity: Array
    acceleration: Array


class Trajectory(Protocol):
    """A planned motion from rest at position 0 to rest at position 0."""

    @property
    def duration(self) -> float:
        """From the start to the end [s]."""

    def at(self, time: Array) -> Points:
        """The motion at ``time`` [s], shape ``(n,)``, which lies in ``[0, duration]``."""


class Plan(Protocol):
    """Plans a motion; an ExcitationError says what is wrong with the values."""

    def __call__(self, values: Mapping[str, float], random: np.random.Generator) -> Trajectory:
        """The motion for these ``values`` of the parameters; what is random in it comes from ``random`` only."""


@dataclass(frozen=True, eq=False)
class Excitation:
    """One kind of excitation; the file that defines it is its whole implementation.

    Attributes:
        id: its name in a node's parameters.
        title: its name in a sentence.
        shows: what a recording of it lets one identify.
        parameters: all with defaults.
        plan: see :class:`Plan`.
    """

    id: str
    title: str
    shows: str
    parameters: tuple[Parameter, ...]
    plan: Callable[[Mapping[str, float], np.random.Generator], Trajectory]
