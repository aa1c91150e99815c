"""Stand-ins for a model's assembled terms, so that plants and loops can be written and type-checked against their names.

:mod:`fric.engine.compile` copies the functions that use these names into a module where they are the model's own. They
are never called here.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ..effect import Context

__all__ = [
    "ACCELERATION",
    "ACTUATED",
    "ACTUATED_RATE",
    "ELASTIC",
    "MEMORY",
    "N_STATES",
    "PUSHED",
    "RIGID",
    "SEEN",
    "SEEN_RATE",
    "Inner",
    "Surroundings",
    "bends",
    "command",
    "drive",
    "force",
    "level",
    "level_sum",
    "link",
    "own",
    "play",
    "prepare",
    "pushed",
    "remember",
    "remembers",
    "slip",
    "step",
    "unpacked",
]

RIGID = True
"""True when no term has slip dynamics of its own, so that the contact sticks exactly."""

ACCELERATION = False
"""True when a term depends on the sign of the acceleration."""

PUSHED = False
"""True when a term depends on the force that pushes the body."""

ELASTIC = False
"""True when a term of the transmission gives a force, so that motor and load are two bodies always."""

MEMORY = False
"""True when a term of the contact has memory."""

N_STATES = 2
"""Number of the plant's mechanical states."""

SEEN = 0
"""Index of the state that the sensor reports as position."""

SEEN_RATE = 1
"""Index of the state that the sensor reports as velocity."""

ACTUATED = 0
"""Index of the state that is the position of the body that the command moves."""

ACTUATED_RATE = 1
"""Index of the state that is its velocity."""


class Inner(NamedTuple):
    """The inner states of the terms.

    Attributes:
        z: states of the slip dynamics, shape ``(n_states,)``.
        z_next: where a step writes them, shape ``(2 n_states,)``; the second half is work space.
        memory: states of the terms with memory, shape ``(n_memory,)``.
        constants: what terms have derived from their parameters, shape ``(n_constants,)``.
    """

    z: Any
    z_next: Any
    memory: Any
    constants: Any


class Surroundings(NamedTuple):
    """What surrounds a step: time at its start [s], relative normal load [1], difference from the reference temperature [K]."""

    time: float
    load: float
    temperature: float


def bends(p: Any) -> bool:
    """True when a term that is there depends on the sign of the acceleration."""
    raise AssertionError("a stand-in, see the module")


def pushed(p: Any) -> bool:
    """True when a term that is there depends on the force that pushes the body."""
    raise AssertionError("a stand-in, see the module")


def remembers(p: Any) -> bool:
    """True when a term of the contact that is there has memory."""
    raise AssertionError("a stand-in, see the module")


def level(c: Context, p: Any) -> float:
    """Slip level of all terms [F], not below zero."""
    raise AssertionError("a stand-in, see the module")


def level_sum(c: Context, p: Any) -> float:
    """Slip level of all terms [F] as it is; linear in the linear parameters."""
    raise AssertionError("a stand-in, see the module")


def force(c: Context, p: Any) -> float:
    """Force of all terms that have one [F], positive against positive motion."""
    raise AssertionError("a stand-in, see the module")


def slip(z: Any, z_next: Any, v: float, h: float, level: float, constants: Any, p: Any) -> float:
    """Mean friction force [F] of the slip dynamics over a step, which leads ``z`` to ``z_next``."""
    raise AssertionError("a stand-in, see the module")


def command(u: float, h: float, memory: Any, p: Any) -> float:
    """Mean force [F] of the actuator over a step of ``h`` [s] when it is told to give ``u``."""
    raise AssertionError("a stand-in, see the module")


def play(p: Any) -> float:
    """Free play of the transmission [x]."""
    raise AssertionError("a stand-in, see the module")


def link(e_0: float, e_1: float, h: float, p: Any) -> float:
    """Mean force [F] that the transmission passes on over a step in which the motor's lead goes from ``e_0`` to ``e_1``."""
    raise AssertionError("a stand-in, see the module")


def remember(c: Context, p: Any) -> None:
    """Lead the memory of all terms over the step of which ``c`` is the middle."""
    raise AssertionError("a stand-in, see the module")


def prepare(p: Any, constants: Any) -> None:
    """Write the constants that terms derive from their parameters."""
    raise AssertionError("a stand-in, see the module")


def own(c: Context, p: Any) -> float:
    """The plant's own force at the contact (gravity, a spring) [F], positive against positive motion."""
    raise AssertionError("a stand-in, see the module")


def step(p: Any, x: Any, x_next: Any, s: Inner, u: float, h: float, around: Surroundings) -> float:
    """One step of the plant."""
    raise AssertionError("a stand-in, see the module")


def drive(p: Any, q: float, v: float, a: float) -> float:
    """Force that moves the plant against nothing but its inertia and its own force [F]."""
    raise AssertionError("a stand-in, see the module")


def unpacked(p: Any) -> Any:
    """The values ``p``, ``(n_parameters,)``, as a tuple: constants of a loop, where an array might change with every store."""
    raise AssertionError("a stand-in, see the module")
