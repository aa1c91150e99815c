"""What a plant is: the bodies between command and sensor, with their equations of motion.

A plant lives in a file of its own in ``plants/`` and offers two compiled functions, and whatever helpers they call:

``step(p, x, x_next, z, z_next, u, h, t, load, temperature) -> float``
    leads the state ``x`` and the friction states ``z`` over one step of ``h`` [s] under the constant actuator force ``u``,
    writes ``x_next`` and ``z_next``, and returns the mean friction force at the contact [F];
``drive(p, q, v, a) -> float``
    the force that the motion needs without any term of the model [F].

They use the model's terms under the names of :mod:`fric_nodes.assembled`; ``p`` holds all values, the plant's own first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .parameter import Parameter

__all__ = ["Plant"]


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
        functions: the compiled functions, ``step`` and ``drive`` among them, each after those that it calls.
        inertia: mass that the contact feels [F s^2/x] from the plant's own values, for step sizes.
    """

    id: str
    title: str
    equation: str
    source: str
    parameters: tuple[Parameter, ...]
    states: tuple[str, ...]
    functions: tuple[Callable[..., Any], ...]
    inertia: Callable[..., float]
