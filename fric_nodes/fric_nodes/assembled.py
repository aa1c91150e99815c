"""Stand-ins for a model's assembled terms, so that plants and loops can be written and type-checked against their names.

:mod:`fric_nodes.compile` copies the functions that use these names into a module where they are the model's own. They are never
called here.
"""

from __future__ import annotations

from typing import Any

from .effect import Context

__all__ = ["RIGID", "drive", "force", "level", "level_sum", "slip", "step", "unpacked"]

RIGID = True
"""True when no term has slip dynamics of its own, so that the contact sticks exactly."""


def level(c: Context, p: Any) -> float:
    """Slip level of all terms [F], not below zero."""
    raise AssertionError("a stand-in, see the module")


def level_sum(c: Context, p: Any) -> float:
    """Sum of the slip levels [F] as it is; linear in the linear parameters."""
    raise AssertionError("a stand-in, see the module")


def force(c: Context, p: Any) -> float:
    """Force of all terms at the place ``force`` [F], positive against positive motion."""
    raise AssertionError("a stand-in, see the module")


def slip(z: Any, z_next: Any, v: float, h: float, level: float, p: Any) -> float:
    """Mean friction force [F] of the slip dynamics over a step, which leads ``z`` to ``z_next``."""
    raise AssertionError("a stand-in, see the module")


def step(
    p: Any, x: Any, x_next: Any, z: Any, z_next: Any, u: float, h: float, t: float, load: float, temperature: float
) -> float:
    """One step of the plant."""
    raise AssertionError("a stand-in, see the module")


def drive(p: Any, q: float, v: float, a: float) -> float:
    """Force that moves the plant against nothing but its inertia [F]."""
    raise AssertionError("a stand-in, see the module")


def unpacked(p: Any) -> Any:
    """The values ``p``, ``(n_parameters,)``, as a tuple: constants of a loop, where an array might change with every store."""
    raise AssertionError("a stand-in, see the module")
