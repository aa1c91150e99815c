"""Margins of a sampled loop of any linear controller around a mass with damping and, where it sticks, a spring.

Plant: m d^2y/dt^2 + d dy/dt + k y = u, the command held over a period h and arriving tau late, tau = n h + f. Its states
x = (y, dy/dt) obey

    x_(k+1) = Phi(h) x_k + Phi(h - f) Gamma(f) u_(k-n-1) + Gamma(h - f) u_(k-n),

exactly, with Phi and Gamma from the matrix exponential. A controller is a ratio of polynomials in z. Closed-loop poles are the
roots of num_c num_p + den_c den_p.

Friction adds either a viscous slope or, in pre-sliding, the spring k to this plant: a loop that keeps its margins for the free
mass and for the mass on the spring is tested at both ends of what friction does to it. Source: Astrom and Wittenmark 1997,
section 2.3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from ..record import Array

__all__ = ["LinearPlant", "LoopMargins", "Polynomials", "added", "margins", "pid_polynomials", "response"]

Polynomials = tuple[Array, Array]
"""Numerator and denominator in z, highest power first."""

_DECADES, _PER_DECADE = 5, 120  # numerical: of the grid of frequencies below Nyquist
_ON_CIRCLE = 1e-9  # numerical: poles that cancel exactly stand on the circle within rounding


@dataclass(frozen=True)
class LoopMargins:
    """How far a closed loop is from its limits.

    Attributes:
        gain_margin: factor by which the gain may rise [1].
        phase_margin: smallest over all crossovers [deg].
        delay_margin: delay that may be added [s].
        sensitivity: largest |S|, M_s [1].
        complementary: largest |T|, M_t [1].
        crossover: highest frequency with |L| = 1 [Hz].
        bandwidth: lowest frequency at which |S| reaches 1/sqrt(2) [Hz].
        stable: all poles inside the unit circle.
    """

    gain_margin: float
    phase_margin: float
    delay_margin: float
    sensitivity: float
    complementary: float
    crossover: float
    bandwidth: float
    stable: bool


@dataclass(frozen=True)
class LinearPlant:
    """A mass with damping and spring, and the timing of its loop.

    Attributes:
        mass: m [F s^2/x].
        damping: d [F s/x].
        period: h [s].
        delay: tau, from a reading until the command that answers it acts [s].
        stiffness: k [F/x].
    """

    mass: float
    damping: float
    period: float
    delay: float = 0.0
    stiffness: float = 0.0

    def polynomials(self) -> Polynomials:
        """Force to position."""
        h = self.period
        n, f = divmod(self.delay, h)
        if h - f < 1e-9 * h:
            n, f = n + 1.0, 0.0
        a = np.array([[0.0, 1.0, 0.0], [-self.stiffness / self.mass, -self.damping / self.mass, 1.0 / self.mass], [0.0] * 3])

        def led(t: float) -> tuple[Array, Array]:
            e = np.asarray(expm(a * t))
            return e[:2, :2], e[:2, 2]

        phi, _ = led(h)
        late, new = led(h - f)
        old = late @ led(f)[1]
        det = np.array([1.0, -float(np.trace(phi)), float(np.linalg.det(phi))])

        def row(gamma: Array) -> Array:
            return np.array([gamma[0], -phi[1, 1] * gamma[0] + phi[0, 1] * gamma[1]])

        numerator = np.polyadd(np.polymul(row(new), [1.0, 0.0]), row(old))
        return np.asarray(numerator), np.asarray(np.polymul(det, np.concatenate([[1.0], np.zeros(int(n) + 1)])))


def response(of: Polynomials, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Values at ``z``."""
    numerator, denominator = (np.polyval(each.astype(complex), z) for each in of)
    return np.asarray(numerator / denominator)


def added(parts: Sequence[Polynomials]) -> Polynomials:
    """Sum of ratios; denominators that are the same array are taken once."""
    numerator: Any = parts[0][0]
    denominator: Any = parts[0][1]
    for n, d in parts[1:]:
        if d.shape == denominator.shape and np.array_equal(d, denominator):
            numerator = np.polyadd(numerator, n)
        else:
            numerator = np.polyadd(np.polymul(numerator, d), np.polymul(n, denominator))
            denominator = np.polymul(denominator, d)
    return np.asarray(numerator), np.asarray(denominator)


def pid_polynomials(kp: float, ki: float, kd: float, filter_time: float, period: float) -> Polynomials:
    """The PID controller of :mod:`fric.control.feedbacks.pid`; without k_i there is no integrator in it."""
    lag = np.array([filter_time + period, -filter_time])
    whole = added([(np.array([kp]), np.array([1.0])), (kd * np.array([1.0, -1.0]), lag)])
    if ki == 0.0:
        return whole
    return added([whole, (np.array([ki * period, 0.0]), np.array([1.0, -1.0]))])


def margins(plant: LinearPlant, controller: Polynomials) -> LoopMargins:
    """Margins of the loop; infinite where the gain never reaches 1."""
    top, bottom = plant.polynomials()
    h = plant.period
    omega = np.geomspace(10.0**-_DECADES, 1.0, _DECADES * _PER_DECADE) * math.pi / h
    z = np.exp(1j * omega * h)
    ratio = response((top, bottom), z) * response(controller, z)
    poles = np.roots(np.polyadd(np.polymul(top, controller[0]), np.polymul(bottom, controller[1])))
    size, phase = np.abs(ratio), np.unwrap(np.angle(ratio))
    sensitivity = 1.0 / np.abs(1.0 + ratio)
    crossings = np.nonzero(np.diff(np.sign(size - 1.0)))[0]
    angles = [math.degrees((phase[k] + 2.0 * math.pi) % (2.0 * math.pi) - math.pi) for k in crossings]
    delays = [math.radians(angle % 360.0) / omega[k] for angle, k in zip(angles, crossings, strict=True)]
    real_axis = np.nonzero((np.diff(np.sign(ratio.imag)) != 0) & (ratio.real[:-1] < 0.0))[0]
    low = np.nonzero(sensitivity >= math.sqrt(0.5))[0]
    return LoopMargins(
        gain_margin=min((1.0 / size[k] for k in real_axis if size[k] < 1.0), default=math.inf),
        phase_margin=min(angles, key=abs, default=math.inf),
        delay_margin=min(delays, default=math.inf),
        sensitivity=float(sensitivity.max()),
        complementary=float((size * sensitivity).max()),
        crossover=float(omega[crossings[-1]] / (2.0 * math.pi)) if crossings.size else 0.0,
        bandwidth=float(omega[low[0]] / (2.0 * math.pi)) if low.size else math.inf,
        stable=bool(np.all(np.abs(poles) < 1.0 + _ON_CIRCLE * poles.size)),
    )
