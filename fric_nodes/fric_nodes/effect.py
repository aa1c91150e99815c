"""What an effect is: one physical mechanism, the place where it acts, and its compiled equation.

A model is a plant and a list of terms, each term an effect with values. Terms don't all add up (a pre-sliding law replaces
the jump of Coulomb friction, a load dependence scales it), so an effect says at which :class:`Place` it acts and the model is
assembled in a fixed order. The same place names the component in a diagnosis.

An effect lives in a file of its own in ``effects/`` and offers up to three compiled functions, all written once and used by
the simulator, the predictor, the regressors and the compensator alike:

``level(c, base, *p) -> float``
    the slip level [F], how large friction is while sliding, given the level ``base`` of the terms before it (the sum of all
    is kept from going below zero);
``force(c, *p) -> float``
    a force that opposes positive motion when positive [F];
``slip(z, z_next, i, v, h, level, *p) -> float``
    the mean friction force [F] over a step of ``h`` [s] at the constant velocity ``v`` [x/s] that leads the states
    ``z[i:]`` to ``z_next[i:]``, where sliding friction would be ``level`` [F].

``c`` is a :class:`Context`; ``*p`` are the effect's parameters in the order of their declaration.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, NamedTuple

from .parameter import Parameter

__all__ = ["Context", "Effect", "Place"]


class Place(Enum):
    """Where in the chain from command to sensor an effect acts; the order is the order of assembly."""

    COMMAND_PATH = "command path"
    TRANSMISSION = "transmission"
    SLIP_LEVEL = "slip level"
    SLIP_DYNAMICS = "slip dynamics"
    FORCE = "force"
    SENSOR = "sensor"


class Context(NamedTuple):
    """What an effect may look at, for one instant of one contact.

    Attributes:
        position: [x].
        velocity: [x/s].
        direction: +1.0 or -1.0; at rest the direction in which the contact is being pushed.
        time: [s].
        load: normal load relative to nominal [1].
        temperature: difference from the reference temperature [K].
    """

    position: float
    velocity: float
    direction: float
    time: float
    load: float
    temperature: float


Compiled = Callable[..., float]


@dataclass(frozen=True, eq=False)
class Effect:
    """One physical effect; the file that defines it is its whole implementation.

    Attributes:
        id: the term's name in a model file, from the vocabulary of the contract.
        law: which of several laws for the same effect; ``""`` when there is one only.
        place: where it acts.
        title: its name in a sentence.
        equation: plain-text equation.
        source: paper and equation number.
        parameters: in the order in which the compiled functions take them.
        level: see the module's docstring; None when the effect doesn't contribute there.
        force: as ``level``.
        slip: as ``level``; at most one term of a model may have it.
        n_states: number of internal states of ``slip``.
        rate: fastest rate [1/s] of the effect on a body of the given mass, from ``(mass, *values)``; sets the step. None: slow.
        regime: where in a recording the effect shows.
        looks_like: other effects with a similar trace, each with the experiment that tells them apart.
        repeatable: True when a model may hold several terms of this effect.
    """

    id: str
    place: Place
    title: str
    equation: str
    source: str
    parameters: tuple[Parameter, ...]
    law: str = ""
    level: Compiled | None = None
    force: Compiled | None = None
    slip: Compiled | None = None
    n_states: int = 0
    rate: Callable[..., float] | None = None
    regime: str = ""
    looks_like: Mapping[str, str] = field(default_factory=dict)
    repeatable: bool = False

    @property
    def key(self) -> str:
        """``id`` or ``id/law``: unique in the registry."""
        return f"{self.id}/{self.law}" if self.law else self.id

    def values(self, given: Mapping[str, Any]) -> Sequence[float]:
        """The parameters' values in order, defaults filled in; KeyError when one without default is missing."""
        return [float(given[p.name]) if p.name in given or p.default is None else p.default for p in self.parameters]
