"""What an effect is: one physical mechanism, the place where it acts, and its compiled equation.

A model is a plant and a list of terms, each term an effect with values. Terms don't all add up (a pre-sliding law replaces
the jump of Coulomb friction, a load dependence scales it), so an effect says at which :class:`Place` it acts and the model is
assembled in a fixed order. The same place names the component in a diagnosis.

An effect lives in a file of its own in ``effects/`` and offers one or more compiled functions, all written once and used by
the simulator, the predictor, the regressors and the compensator alike:

``level(c, base, *p) -> float``
    the slip level [F], how large friction is while sliding, given the level ``base`` of the terms before it (the sum of all
    is kept from going below zero);
``force(c, *p) -> float``
    a force that opposes positive motion when positive [F];
``slip(z, z_next, i, v, h, level, *p) -> float``
    the mean friction force [F] over a step of ``h`` [s] at the constant velocity ``v`` [x/s] that leads the states
    ``z[i:]`` to ``z_next[i:]``, where sliding friction would be ``level`` [F];
``command(u, h, y, i, *p) -> float``
    the mean force [F] over a step of ``h`` [s] that an actuator gives when it is told to give ``u``; leads its states
    ``y[i:]`` on;
``uncommand(f, *p) -> float``
    the command [F] that makes a memoryless command path give the force ``f``;
``play(*p) -> float``
    free play of a transmission [x];
``link(e_0, e_1, h, free, *p) -> float``
    the mean force [F] that a transmission passes on over a step of ``h`` [s] in which the motor gets ahead of the load by
    ``e_1`` instead of ``e_0`` [x], with the play ``free`` [x] of all terms. Links of several terms add up; the link of a term
    that has play counts only where no other term has a link.

``c`` is a :class:`Context`; ``*p`` are the effect's parameters in the order of their declaration.

An effect with memory (a lag, the age of a contact, a resonator) has ``n_memory`` states in ``c.memory``, which live as long as
the model runs. Its ``level`` and ``force`` take the offset ``i`` of its states before ``*p`` and only read them, since a step
evaluates them several times; ``remember(c, base, i, *p)`` leads them on when the step is done, with ``c`` its middle.
An effect that derives constants from its parameters writes ``n_constants`` of them with ``prepare(k, j, *p)`` once per run; its
``slip`` then takes the array ``k`` and the offset ``j`` before ``*p``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, NamedTuple

import numpy as np

from .parameter import Parameter
from .record import Array

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
    """What an effect may look at, for one instant of one contact, or for the middle of one step.

    Attributes:
        position: [x].
        velocity: [x/s].
        direction: +1.0 or -1.0; at rest the direction in which the contact is being pushed.
        time: [s].
        load: normal load relative to nominal [1].
        temperature: difference from the reference temperature [K].
        acceleration: [x/s^2]; only its sign, and only for effects with ``uses_acceleration``; 0 otherwise.
        step: length of the step of which this is the middle [s]; 0 for an instant.
        memory: states of all terms with memory, shape ``(n_memory,)``, at the start of the step.
        push: force that pushes the body [F], of the actuator or what a transmission passes on; for effects with ``uses_push``.
    """

    position: float
    velocity: float
    direction: float
    time: float
    load: float
    temperature: float
    acceleration: float
    step: float
    memory: Any
    push: float


Compiled = Callable[..., float]
Count = int | Callable[..., int]


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
        usual: True for the law that is meant when a model names none; without one it is the first by file name.
        near: another law of the effect that this one comes so near that a diagnosis tries only that; ``""``: none does.
        form_of: another law of the effect, in whose place alone a diagnosis tries this one; ``""``: it has a place of its own.
        shows_alone: True for a form that may show where the law that it is a form of hardly does: it is tried by itself, too.
        order: within its place, what comes first: 0 what adds up, 10 what lags, 20 what depends on direction, 30 what scales
            the rest, 40 what comes from another contact.
        level: see the module's docstring, as for all compiled functions; None when the effect doesn't contribute there.
        force: as ``level``.
        slip: as ``level``; at most one term of a model may have it.
        command: as ``level``.
        uncommand: as ``level``.
        play: as ``level``.
        link: as ``level``.
        remember: as ``level``; for effects with memory.
        prepare: as ``level``; for effects with constants.
        n_states: number of internal states of ``slip``, or a function of the values.
        initial: the states of ``slip`` at the start of a run, from the values; None: zeros.
        n_memory: number of states in the memory; they are zero at the start of a run, but for
        velocities: numbers of those that begin with the velocity of the body, of what is carried along by it.
        n_constants: number of constants, or a function of the values.
        uses_acceleration: True when it depends on the sign of the acceleration.
        uses_push: True when it depends on the force that pushes the body.
        rate: fastest rate [1/s] of the effect on a body of the given mass, from ``(mass, *values)``; sets the step. None: slow.
        absent: values of nonlinear parameters at which the effect does nothing, however the others are.
        passes_for: parameters that another effect's parameter has held, too, where this effect was not known: name, and the
            other's name in a model with one term of that effect.
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
    usual: bool = False
    near: str = ""
    form_of: str = ""
    shows_alone: bool = False
    order: int = 0
    level: Compiled | None = None
    force: Compiled | None = None
    slip: Compiled | None = None
    command: Compiled | None = None
    uncommand: Compiled | None = None
    play: Compiled | None = None
    link: Compiled | None = None
    remember: Callable[..., None] | None = None
    prepare: Callable[..., None] | None = None
    n_states: Count = 0
    initial: Callable[..., Array] | None = None
    n_memory: int = 0
    velocities: tuple[int, ...] = ()
    n_constants: Count = 0
    uses_acceleration: bool = False
    uses_push: bool = False
    rate: Callable[..., float] | None = None
    absent: Mapping[str, float] = field(default_factory=dict)
    passes_for: Mapping[str, str] = field(default_factory=dict)
    regime: str = ""
    looks_like: Mapping[str, str] = field(default_factory=dict)
    repeatable: bool = False

    @property
    def key(self) -> str:
        """``id`` or ``id/law``: unique in the registry."""
        return f"{self.id}/{self.law}" if self.law else self.id

    @property
    def functions(self) -> Mapping[str, Callable[..., Any]]:
        """Its compiled functions by their role."""
        roles = ("level", "force", "slip", "command", "uncommand", "play", "link", "remember", "prepare")
        return {role: getattr(self, role) for role in roles if getattr(self, role) is not None}

    @property
    def amplitudes(self) -> tuple[str, ...]:
        """The parameters that say how strong the effect is; none when no value of a parameter makes it vanish."""
        if self.slip is not None or self.link is not None or self.play is not None:
            return ()
        return tuple(p.name for p in self.parameters if (p.linear and not p.shape) or p.name in self.absent)

    @property
    def neutral(self) -> tuple[float, ...] | None:
        """Values at which a model with the effect moves as one without it; None when there are none."""
        if not self.amplitudes:
            return None
        without = {p.name: 0.0 for p in self.parameters if p.linear} | dict(self.absent)
        rest = {p.name: 1.0 for p in self.parameters if p.default is None}
        return tuple(self.values(rest | without))

    def values(self, given: Mapping[str, Any]) -> Sequence[float]:
        """The parameters' values in order, defaults filled in; KeyError when one without default is missing."""
        return [float(given[p.name]) if p.name in given or p.default is None else p.default for p in self.parameters]

    def start(self, values: Sequence[float], force: float = 0.0) -> Array:
        """The states of ``slip`` at the start of a run with these ``values``, shape ``(n_states,)``.

        A single bristle is bent as far as the ``force`` [F] asks for that the contact bears then; of several it can't be told.
        """
        if self.initial is not None:
            return self.initial(*values)
        states = np.zeros(self.n_states(*values) if callable(self.n_states) else self.n_states)
        if force != 0.0 and states.shape[0] == 1:
            states[0] = force / next(x for p, x in zip(self.parameters, values, strict=True) if p.dimension == "F/x")
        return states

    def memory(self, velocity: float) -> Array:
        """The memory at the start of a run, in which the body moves with ``velocity`` [x/s], shape ``(n_memory,)``."""
        begins = np.zeros(self.n_memory)
        for place in self.velocities:
            begins[place] = velocity
        return begins

    def constants(self, values: Sequence[float]) -> int:
        """Number of constants for these ``values``."""
        return self.n_constants(*values) if callable(self.n_constants) else self.n_constants
