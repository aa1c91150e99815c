"""What a generator of truth is: a way to lead an axis, and the numbers of an axis that it honours.

A generator is another hand that writes the same physics: it shares no line with the loop of :mod:`fric.diagnosis.prove.truth`,
with its laws, with the models that a diagnosis fits, or with another generator. Common to all are names alone: those of
the numbers of an axis, of what a controller does, and of what is written down.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from ....errors import InputError
from ..course import Course, Run
from ..physics import Physics
from .controllers import Controller

__all__ = ["ANY", "Generator", "Hand", "Honoured"]

Honoured = Mapping[str, tuple[float, ...]]
"""Numbers of an axis by name, each with the values that it may have; all of them where the tuple is :data:`ANY`."""

ANY: tuple[float, ...] = ()


@dataclass(frozen=True)
class Generator:
    """Another hand that leads an axis.

    Attributes:
        name: of the variant of the examination that it makes.
        honoured: numbers of an axis that change its motion as they should; every other one has to be at its default.
        lead: axis, controller, course, step of the encoder [m] and sampling time of the recording [s] to what happened.
        ready: raises an InputError where something has to be installed first.
        without: effects of the vocabulary that it can't make.
        apart: numbers that it honours, but not both at once.
    """

    name: str
    honoured: Honoured
    lead: Callable[[Physics, Controller, Course, float, float], Run]
    ready: Callable[[], None] = lambda: None
    without: frozenset[str] = frozenset()
    apart: tuple[tuple[str, str], ...] = field(default=())

    def check(self, physics: Physics) -> None:
        """Refuse an axis that would be led as if it were another one.

        Raises:
            InputError: a number is set that this generator doesn't honour.
        """
        others = [name for name, value in physics.named().items() if not self._honours(name, value)]
        if physics.elements:
            others.append("elements")
        if others:
            raise InputError(f"generator '{self.name}'", f"does not honour {', '.join(others)}", "use another variant")
        for first, second in self.apart:
            if getattr(physics, first) and getattr(physics, second):
                raise InputError(f"generator '{self.name}'", f"has either {first} or {second}", "set one of the two to 0")

    def _honours(self, name: str, value: float) -> bool:
        return name in self.honoured and (self.honoured[name] == ANY or value in self.honoured[name])


@dataclass(frozen=True)
class Hand:
    """A generator with a controller."""

    generator: Generator
    controller: Controller

    def __call__(self, physics: Physics, course: Course, resolution: float, sample_time: float) -> Run:
        """What happens to ``physics`` on ``course``, with an encoder of this step [m], written every ``sample_time`` [s]."""
        return self.generator.lead(physics, self.controller, course, resolution, sample_time)
