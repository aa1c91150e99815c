"""The free oscillation with asymmetric kinetic and viscous friction, in closed form.

    m x'' + c(v) x' + k x + f(v) = 0,   c = 2 m (sigma + D_sigma sgn v),   f = k (x_k sgn v + D_x)

(mean and half difference, forward minus backward). Within a half cycle of direction s = sgn v nothing changes sign, so
y = x + D_x + s x_k swings as a linear oscillator does, with damping sigma_s = sigma + s D_sigma and frequency
omega_s = sqrt(omega_0^2 - sigma_s^2), each direction its own. From a reversal at (t_n, X_n):

    x = C_s + (X_n - C_s) g_s(t - t_n),   C_s = -(D_x + s x_k),
    g_s(t) = exp(-sigma_s t) (cos omega_s t + sigma_s/omega_s sin omega_s t),
    X_n = C_s - q_s (X_{n-1} - C_s),      t_n = t_{n-1} + pi/omega_s,   q_s = exp(-pi sigma_s/omega_s)

and the body stays when |X_n + D_x| <= x_k. With q_+ = e^{-pi alpha} and q_- = e^{-pi beta} this is de Marchi's recursion, X_n
+ q X_{n-1} = -(1 + q) (D_x + s x_k). Corrected in the printed slides, which contradict themselves: y = x + D_x + x_k sgn x'
(not sgn y, and both parts shift x); y_n = -q y_{n-1} (the exponent e^{-n pi beta} belongs to y_0 alone); the logarithmic
decrement is pi beta = -log|y_n/y_{n-1}| = +pi sigma/omega_d; the ratios for q hold for the measured peaks X, not for y; and
both friction offsets are minus half the difference and minus half the sum of (X_n + q X_{n-1})/(1 + q) of successive half
cycles.

Source: de Marchi 1998 (extended logarithmic decrement); the rest derived here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...record import Array

__all__ = ["NATURAL", "Natural", "chain", "half_cycle", "leading_position", "plain_motion", "shape"]

NATURAL = ("frequency", "damping", "damping_difference", "offset", "offset_difference")
"""Names of the natural parameters, in the order of every vector and covariance of them."""

_MOST_DAMPED = 0.999


@dataclass(frozen=True)
class Natural:
    """What a free oscillation shows; without a force there is nothing that shows the mass.

    Attributes:
        frequency: undamped natural frequency omega_0 [rad/s].
        damping: ratio zeta = sigma/omega_0, mean of both directions [1].
        damping_difference: half the difference of the ratios, forward minus backward [1].
        offset: kinetic friction over stiffness x_k, mean of both directions [x].
        offset_difference: half its difference, forward minus backward, any constant force included [x].
    """

    frequency: float
    damping: float
    damping_difference: float = 0.0
    offset: float = 0.0
    offset_difference: float = 0.0

    @property
    def values(self) -> Array:
        """As a vector in the order of :data:`NATURAL`, shape ``(5,)``."""
        return np.array([getattr(self, name) for name in NATURAL])

    @classmethod
    def of(cls, values: Array) -> Natural:
        """From a vector of shape ``(5,)``."""
        return cls(*(float(value) for value in values))


def half_cycle(natural: Natural, direction: int) -> tuple[float, float, float]:
    """Damping sigma [1/s], damped frequency omega [rad/s] and centre C [x] while moving in ``direction`` (1 or -1)."""
    ratio = natural.damping + direction * natural.damping_difference
    ratio = min(max(ratio, -_MOST_DAMPED), _MOST_DAMPED)
    sigma = ratio * natural.frequency
    omega = natural.frequency * float(np.sqrt(1.0 - ratio**2))
    return sigma, omega, -(natural.offset_difference + direction * natural.offset)


def shape(time: Array, sigma: float, omega: float) -> tuple[Array, Array]:
    """Shape g of a half cycle and its derivative [1/s] at ``time`` [s] from the reversal, each of shape ``(n,)``."""
    decay = np.exp(-sigma * time)
    cosine, sine = np.cos(omega * time), np.sin(omega * time)
    return decay * (cosine + sigma / omega * sine), -decay * (omega + sigma**2 / omega) * sine


def chain(natural: Natural, time: float, position: float, direction: int, n: int) -> tuple[Array, Array]:
    """Times and positions of ``n`` reversals from the first, after which the body moves in ``direction``; sticking left out."""
    times, positions = np.empty(n), np.empty(n)
    sides = {s: half_cycle(natural, s) for s in (1, -1)}
    for k in range(n):
        times[k], positions[k] = time, position
        sigma, omega, centre = sides[direction]
        position = centre - float(np.exp(-np.pi * sigma / omega)) * (position - centre)
        time += float(np.pi / omega)
        direction = -direction
    return times, positions


def plain_motion(natural: Natural, time: Array, first: float, position: float, direction: int) -> Array:
    """Position at ``time`` [s], shape ``(n,)``, of the motion whose first reversal is at (``first``, ``position``).

    Before it the body comes from the other direction, and the half cycles go on for ever: a stop is for the caller to see.
    """
    slowest = min(half_cycle(natural, s)[1] for s in (1, -1))
    n = max(int(np.ceil((float(time[-1]) - first) * slowest / np.pi)) + 2, 2)
    times, positions = chain(natural, first, position, direction, n)
    number = np.clip(np.searchsorted(times, time, side="right") - 1, -1, n - 1)
    moved = np.where(number < 0, -direction, direction * (1 - 2 * (number % 2)))
    at = np.maximum(number, 0)
    answer = np.empty(time.shape[0])
    for s in (1, -1):
        here = moved == s
        sigma, omega, centre = half_cycle(natural, s)
        g, _ = shape(time[here] - times[at[here]], sigma, omega)
        answer[here] = centre + (positions[at[here]] - centre) * g
    return answer


def leading_position(natural: Natural, position: float) -> int:
    """Direction in which a body that rests at ``position`` starts to move; 0 when it stays."""
    off = position + natural.offset_difference
    if abs(off) <= natural.offset:
        return 0
    return -1 if off > 0 else 1
