"""The examiner's axis in motion: closed loop, drive, transmission, body, contact and encoder, in one loop of very small steps.

Nothing here is shared with the models that a diagnosis fits (:mod:`fric.engine`, ``effects/``): other code, another
method (semi-implicit Euler: velocities first, then positions), and a step at least twenty times finer than a sample and
never above 20 us. Sticking is an event: a velocity that would change its sign is set to zero, and the body stays there
while what pushes it is no more than the break-away level. Bristles and elements are led by implicit Euler, which no
stiffness makes unstable.

The controller is part of the loop: proportional and derivative action on the encoder's rounded position, once per sample,
its command held until the next, on top of a feedforward from the reference. What is recorded is that command.

Equations: m dv/dt = f - F(q, v, t) - F_contact, with f the force behind command path and transmission. Sources of the laws
are in :mod:`fric.diagnosis.prove.laws`; slip dynamics: Canudas de Wit 1995 (bristle), Al-Bender, Lampaert, Swevers
2005 (elements with slip dynamics), Iwan 1966 (population of elements that stick or slip).
"""

from __future__ import annotations

import math
from collections import namedtuple
from dataclasses import dataclass
from typing import Any

import numpy as np

from .chain import N_STATES, begin, encoder, stepped
from .course import Course, Run
from .laws import compiled_loop
from .physics import FIELDS, Physics

__all__ = ["Loop", "integrate"]

_FINEST = 25  # steps per sample at least
_LONGEST = 2e-5  # [s]

Numbers: Any = namedtuple("Numbers", FIELDS)  # type: ignore[misc]


@dataclass(frozen=True)
class Loop:
    """Controller and encoder: gains [N/m], [N s/m], largest command [N], sampling time [s], step of the encoder [m]."""

    proportional: float
    derivative: float
    largest: float
    sample_time: float
    resolution: float


def integrate(physics: Physics, loop: Loop, course: Course) -> Run:
    """Lead the axis through ``course``, from rest at its first reference."""
    n = course.reference.shape[0]
    n_steps = max(_FINEST, math.ceil(loop.sample_time / _LONGEST))
    out = np.empty((5, n))
    gains = np.array([loop.proportional, loop.derivative, loop.largest, loop.sample_time, loop.resolution])
    step = loop.sample_time / n_steps
    elements = physics.population()
    late = np.zeros(round(physics.delay / step) + 1)
    history = np.zeros((round(physics.lag_time / step) if physics.lag == 3.0 else 0) + 1)
    _lead(
        Numbers(*physics.vector().tolist()), elements, np.zeros(N_STATES), np.zeros(max(elements.shape[0], 1)), late, history,
        gains, n_steps,
        course.reference, course.feedforward, course.load, course.warmer, course.windows, course.noise, out,
    )  # fmt: skip
    return Run(*out)


@compiled_loop
def _lead(
    p: Any, elements: Any, s: Any, z: Any, late: Any, history: Any, gains: Any, n_steps: int,
    reference: Any, feedforward: Any, load: Any, warmer: Any, windows: Any, noise: Any, out: Any,
) -> None:  # fmt: skip
    kp, kd, largest, sample_time, resolution = gains
    h = sample_time / n_steps
    begin(p, s, reference[0])
    before = reference[0]
    slope = 0.0
    count = 0
    for k in range(reference.shape[0]):
        seen, rate = encoder(p, s)
        measured = seen + noise[k]
        if resolution > 0.0:
            measured = resolution * math.floor(measured / resolution + 0.5)
        wanted = 0.0
        if k > 0:
            wanted = (reference[k] - reference[k - 1]) / sample_time
            slope += 0.5 * ((measured - before) / sample_time - slope)
        before = measured
        u = feedforward[k] + kp * (reference[k] - measured) + kd * (wanted - slope)
        u = max(-largest, min(largest, u))
        out[0, k] = u
        out[1, k] = measured
        out[2, k] = seen
        out[3, k] = rate
        t = k * sample_time
        disturbed = 0.0
        for j in range(windows.shape[0]):
            if windows[j, 0] <= t < windows[j, 1]:
                disturbed = 1.0
        held = 0.0
        for step in range(n_steps):
            held += stepped(p, s, z, elements, late, history, u, t + step * h, h, count, load[k], warmer[k], disturbed)
            count += 1
        out[4, k] = held / n_steps
