"""What an excitation is: a planned motion, known for all times in advance, or a force that answers the motion.

An excitation lives in a file of its own in ``excitation/`` and offers a constant ``EXCITATION``: its parameters, declared as
everywhere, and a function of their values. Most plan a motion (or, published as a force, its course over time): position,
velocity and acceleration in closed form, so that a node may ask for any sample, in any order, and gets the same bits. The
others give a force from the position measured, sample by sample.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from .errors import InputError
from .parameter import Parameter
from .record import Array

__all__ = ["OUTPUTS", "Excitation", "ExcitationError", "Feedback", "Plan", "Points", "Text", "Trajectory"]

OUTPUTS = ("reference", "force")
"""What an excitation may be published as: a motion that a controller follows, or a force."""


class ExcitationError(InputError):
    """An excitation that can't be planned as asked."""


class Points(NamedTuple):
    """A motion at some times; each of shape ``(n,)``: position [x], velocity [x/s], acceleration [x/s^2].

    Published as a force, the position is the force [F] and the others are its time derivatives.
    """

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


class Feedback(Protocol):
    """A force that answers the motion, sample by sample."""

    @property
    def duration(self) -> float:
        """From the start to the end [s]."""

    def force(self, time: float, position: float) -> float:
        """The force [F] from ``time`` [s] on, in ``[0, duration]``, with the sensor at ``position`` [x].

        Called once per sample, in order; a time that isn't later than the last one starts the excitation anew.
        """


class Text(NamedTuple):
    """A setting of an excitation that is no number: its name, default, documentation, and the texts allowed (empty: any)."""

    name: str
    default: str
    doc: str
    choices: tuple[str, ...] = ()


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
        plan: see :class:`Plan`; takes the texts by their names as a third argument where there are any. None for a feedback.
        answer: the feedback for values of the parameters; None for a plan.
        texts: settings that are no numbers.
        outputs: which of :data:`OUTPUTS` it can be published as.
    """

    id: str
    title: str
    shows: str
    parameters: tuple[Parameter, ...]
    plan: Callable[..., Trajectory] | None = None
    answer: Callable[[Mapping[str, float]], Feedback] | None = None
    texts: tuple[Text, ...] = ()
    outputs: tuple[str, ...] = OUTPUTS

    def part(self, values: Mapping[str, float], texts: Mapping[str, str], random: np.random.Generator) -> Trajectory | Feedback:
        """The plan or the feedback for values of all parameters.

        Raises:
            InputError: it can't be planned as asked.
        """
        if self.answer is not None:
            return self.answer(values)
        assert self.plan is not None
        return self.plan(values, random, texts) if self.texts else self.plan(values, random)
