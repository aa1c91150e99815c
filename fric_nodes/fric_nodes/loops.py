"""The compiled loops of every model: motion from force, force from motion, and motion followed sample by sample.

They are written once, over the names of :mod:`fric_nodes.assembled`, and compiled for each structure by
:mod:`fric_nodes.compile`, which also hands in ``x_next`` and ``z_next``, the work space of a step.
"""

from __future__ import annotations

from typing import Any

from .assembled import RIGID, drive, force, level_sum, slip, step, unpacked
from .effect import Context

__all__ = ["observe", "predict", "simulate"]


def simulate(
    p: Any, u: Any, h: float, n_sub: int, t_0: float, load: Any, temperature: Any, x: Any, z: Any,
    x_out: Any, friction_out: Any, x_next: Any, z_next: Any,
) -> None:  # fmt: skip
    """Lead the states ``x`` and ``z``, in place, over ``len(u)`` intervals of length ``h`` [s] in ``n_sub`` steps each.

    ``u[k]`` acts over the whole interval k. ``x_out[k]`` is the mechanical state at the end of interval k and
    ``friction_out[k]`` the contact's mean friction force [F] over it. ``load`` and ``temperature`` hold one value, or one
    for each interval.
    """
    p = unpacked(p)
    h_sub = h / n_sub
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
    x_next: Any, z_next: Any,
) -> None:  # fmt: skip
    """Force that the model needs for the motion ``q``, ``v``, ``a`` at each sample, all of shape ``(n_samples,)``.

    Slip dynamics are led from half a step before each sample to half a step after it at the sample's velocity, so that the mean
    force over the step belongs to the sample itself and no half step of delay creeps in. ``z`` is led on in place.
    """
    p = unpacked(p)
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


def observe(
    p: Any, u: Any, y: Any, h: Any, n_sub: int, load: Any, temperature: Any,
    alpha: float, beta: float, noise: float, x: Any, z: Any, innovation: Any,
    x_next: Any, z_next: Any,
) -> None:  # fmt: skip
    """Follow the measured positions ``y``: predict each from the state before it, then correct position and velocity.

    ``innovation[k]`` is ``y[k]`` minus its prediction [x], for ``len(u)`` intervals of lengths ``h`` [s]. The correction has
    the constant gains of an alpha-beta filter. A contact that sticks exactly is left at rest while the innovation stays within
    three times ``noise`` [x]: the noise of an encoder must not shake it loose.
    """
    p = unpacked(p)
    t = 0.0
    for k in range(u.shape[0]):
        h_sub = h[k] / n_sub
        load_k = load[k] if load.shape[0] > 1 else load[0]
        temperature_k = temperature[k] if temperature.shape[0] > 1 else temperature[0]
        for m in range(n_sub):
            step(p, x, x_next, z, z_next, u[k], h_sub, t + m * h_sub, load_k, temperature_k)
            for j in range(x.shape[0]):
                x[j] = x_next[j]
            if not RIGID:
                for j in range(z.shape[0]):
                    z[j] = z_next[j]
        e = y[k] - x[0]
        innovation[k] = e
        x[0] += alpha * e
        if not (RIGID and x[1] == 0.0 and abs(e) <= 3.0 * noise):
            x[1] += beta * e / h[k]
        t += h[k]
