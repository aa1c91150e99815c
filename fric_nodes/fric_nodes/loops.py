"""The two compiled loops of every model: motion from force, and force from motion.

They are written once, over the names of :mod:`fric_nodes.assembled`, and compiled for each structure by
:mod:`fric_nodes.compile`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .assembled import RIGID, drive, force, level_sum, slip, step, unpacked
from .effect import Context

__all__ = ["predict", "simulate"]


def simulate(
    p: Any, u: Any, h: float, n_sub: int, t_0: float, load: Any, temperature: Any, x: Any, z: Any, x_out: Any, friction_out: Any,
) -> None:  # fmt: skip
    """Lead the states ``x`` and ``z``, in place, over ``len(u)`` intervals of length ``h`` [s] in ``n_sub`` steps each.

    ``u[k]`` acts over the whole interval k. ``x_out[k]`` is the mechanical state at the end of interval k and
    ``friction_out[k]`` the contact's mean friction force [F] over it. ``load`` and ``temperature`` hold one value, or one
    for each interval.
    """
    p = unpacked(p)
    h_sub = h / n_sub
    x_next = np.empty_like(x)
    z_next = np.empty_like(z)
    for k in range(u.shape[0]):
        load_k = load[k] if load.shape[0] > 1 else load[0]
        temperature_k = temperature[k] if temperature.shape[0] > 1 else temperature[0]
        total = 0.0
        for m in range(n_sub):
            t = t_0 + k * h + m * h_sub
            total += step(p, x, x_next, z, z_next, u[k], h_sub, t, load_k, temperature_k)
            for j in range(x.shape[0]):
                x[j] = x_next[j]
            if not RIGID:
                for j in range(z.shape[0]):
                    z[j] = z_next[j]
        for j in range(x.shape[0]):
            x_out[k, j] = x[j]
        friction_out[k] = total / n_sub


def predict(
    p: Any, t: Any, q: Any, v: Any, a: Any, h: float, load: Any, temperature: Any, z: Any, u_out: Any, friction_out: Any,
) -> None:  # fmt: skip
    """Force that the model needs for the motion ``q``, ``v``, ``a`` at each sample, all of shape ``(n_samples,)``.

    Slip dynamics are led from half a step before each sample to half a step after it at the sample's velocity, so that the mean
    force over the step belongs to the sample itself and no half step of delay creeps in. ``z`` is led on in place.
    """
    p = unpacked(p)
    z_next = np.empty_like(z)
    for k in range(q.shape[0]):
        load_k = load[k] if load.shape[0] > 1 else load[0]
        temperature_k = temperature[k] if temperature.shape[0] > 1 else temperature[0]
        direction = 1.0 if v[k] > 0.0 else (-1.0 if v[k] < 0.0 else 0.0)
        c = Context(q[k], v[k], direction, t[k], load_k, temperature_k)
        if RIGID:
            friction = direction * level_sum(c, p)
        else:
            friction = slip(z, z_next, v[k], h, level_sum(c, p), p)
            for j in range(z.shape[0]):
                z[j] = z_next[j]
        friction_out[k] = friction
        u_out[k] = drive(p, q[k], v[k], a[k]) + force(c, p) + friction
