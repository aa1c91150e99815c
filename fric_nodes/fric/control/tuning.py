"""Gains of a PID position controller for a mass with viscous damping: the most integral action at a given sensitivity.

Loop: m dv/dt = u - d v with the force held between samples, at a period h, the command arriving a time tau late (a fraction
of a sample or several), and the controller of :mod:`fric.control.feedbacks.pid` as it computes. The exact discrete plant,

    x_(k+1) = Phi(h) x_k + Phi(h - f) Gamma(f) u_(k-n-1) + Gamma(h - f) u_(k-n),     tau = n h + f,  0 <= f < h,

so that the held sample (half a period of delay on average) is part of it. The gains are those with the largest k_i for which
|S| = |1/(1 + L)| <= M_s and |T| = |L/(1 + L)| <= M_t at all frequencies up to Nyquist and the closed loop is stable. The
largest k_i means the least integrated error after a step of load (integral of e = step / k_i), which is what friction does at
a reversal.
Source: Astrom, Panagopoulos, Hagglund 1998, and Astrom and Hagglund 2006, section 6.4 (MIGO); the search over the other two
gains is this module's own. The delayed discretisation follows Astrom and Wittenmark 1997, section 2.3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from ..errors import InputError
from ..record import Array
from .feedbacks.pid import PidGains
from .loop import LoopMargins

__all__ = ["LoopMargins", "TuningError", "loop_margins", "tune"]

Complex = NDArray[np.complex128]


class TuningError(InputError):
    """A loop for which no gains are found."""


class _Loop:
    """The open loop without its gains: one plant, one period, one delay, on one grid of frequencies."""

    def __init__(self, mass: float, damping: float, period: float, delay: float, filter_time: float, decades: int) -> None:
        self.omega: Array = np.geomspace(10.0**-decades, 1.0, 100 * decades**2, dtype=np.float64) * math.pi / period
        z = np.exp(1j * self.omega * period)
        self._numerator, self._denominator = _plant(mass, damping, period, delay)
        plant = np.polyval(self._numerator.astype(complex), z) / np.polyval(self._denominator.astype(complex), z)
        self.plant: Complex = np.asarray(plant, dtype=np.complex128)
        self.integral: Complex = period * z / (z - 1.0)
        self.derivative: Complex = (z - 1.0) / ((filter_time + period) * z - filter_time)
        # The closed loop's polynomial is the one without gains and, by each of k_p, k_i and k_d, another. Without integral gain
        # the integrator's own pole takes no part in the loop.
        integrator, lag = _coefficients(1.0, -1.0), _coefficients(filter_time + period, -filter_time)
        held = np.polymul(_coefficients(period, 0.0), lag)
        self._proportional = self._closed(lag, (lag, _coefficients(0.0), integrator))
        self._integrating = self._closed(
            np.polymul(integrator, lag), (np.polymul(integrator, lag), held, np.polymul(integrator, integrator))
        )

    def _closed(self, controller: Array, by_gain: Sequence[Array]) -> tuple[Array, list[Array]]:
        """Closed-loop polynomials: without gains, and by each gain; of denominator and numerators of the controller."""
        parts: list[Array] = [np.asarray(np.polymul(part, self._numerator), dtype=np.float64) for part in by_gain]
        return np.asarray(np.polymul(controller, self._denominator), dtype=np.float64), parts

    def ratio(self, kp: float, ki: float, kd: float) -> Complex:
        """L at the grid's frequencies."""
        return self.plant * (kp + ki * self.integral + kd * self.derivative)

    def stable(self, kp: float, ki: float, kd: float) -> bool:
        """True when all closed-loop poles lie inside the unit circle."""
        alone, by_gain = self._integrating if ki != 0.0 else self._proportional
        closed = alone.copy()
        for gain, part in zip((kp, ki, kd), by_gain, strict=True):
            closed[closed.shape[0] - part.shape[0] :] += gain * part
        return bool(np.all(np.abs(np.roots(closed)) < 1.0))

    def peaks(self, kp: float, ki: float, kd: float) -> tuple[float, float]:
        """Largest |S| and |T|."""
        ratio = self.ratio(kp, ki, kd)
        sensitivity = 1.0 / np.abs(1.0 + ratio)
        return float(sensitivity.max()), float((np.abs(ratio) * sensitivity).max())


def _coefficients(*values: float) -> Any:
    """A polynomial in z, highest power first."""
    return np.array(values)


def _plant(mass: float, damping: float, period: float, delay: float) -> tuple[Array, Array]:
    """Numerator and denominator in z of the held, delayed plant, force to position."""
    n, f = divmod(delay, period)
    if period - f < 1e-9 * period:  # a delay of whole samples, up to rounding
        n, f = n + 1.0, 0.0

    def transition(t: float) -> Array:
        a = damping / mass * t
        way = t if a == 0.0 else -math.expm1(-a) * mass / damping
        return np.array([[1.0, way], [0.0, math.exp(-a)]])

    def effect(t: float) -> Array:
        a = damping / mass * t
        if a < 1e-4:  # series, where the closed form cancels
            return np.array([t * t / mass * (0.5 - a / 6.0 + a * a / 24.0), t / mass * (1.0 - a / 2.0 + a * a / 6.0)])
        fall = -math.expm1(-a)
        return np.array([(t - fall * mass / damping) / damping, fall / damping])

    phi, new = transition(period), effect(period - f)
    old = transition(period - f) @ effect(f)
    # position(z)/u(z) = [1 0] (zI - Phi)^-1 (new + old / z) / z^n
    det = np.array([1.0, -(phi[0, 0] + phi[1, 1]), phi[0, 0] * phi[1, 1]])

    def row(gamma: Array) -> Array:
        return np.array([gamma[0], -phi[1, 1] * gamma[0] + phi[0, 1] * gamma[1]])

    numerator = np.polyadd(np.polymul(row(new), [1.0, 0.0]), row(old))
    return numerator, np.polymul(det, np.concatenate([[1.0], np.zeros(int(n) + 1)]))


def _most_integral(loop: _Loop, limits: tuple[float, float], kp: float, kd: float) -> float:
    """Largest k_i that keeps ``limits`` of |S| and |T| with these two gains; negative when not even 0 does."""

    def good(ki: float) -> bool:
        peaks = loop.peaks(kp, ki, kd)
        return peaks[0] <= limits[0] and peaks[1] <= limits[1] and loop.stable(kp, ki, kd)

    if not good(0.0):
        return -1.0
    low, high = 0.0, kp * kp / max(kd, 1e-12)
    for _ in range(24):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if good(middle) else (low, middle)
    return low


def tune(
    mass: float,
    damping: float,
    period: float,
    *,
    delay: float = 0.0,
    filter_time: float = 0.0,
    sensitivity: float = 1.7,
    complementary: float = 1.7,
) -> tuple[PidGains, LoopMargins]:
    """Gains with the largest integral gain within the limits, and the margins they leave.

    Args:
        mass: m [F s^2/x].
        damping: d [F s/x].
        period: h [s].
        delay: from measurement to command, on top of the held sample [s].
        filter_time: of the derivative filter [s].
        sensitivity: M_s [1].
        complementary: M_t [1].

    Raises:
        TuningError: an argument is out of its range, or no gains satisfy the limits.
    """
    given = {"mass": mass, "period": period, "sensitivity - 1": sensitivity - 1.0, "complementary - 1": complementary - 1.0}
    for name, value in given.items():
        if not 0.0 < value < math.inf:
            raise TuningError("tuning", f"{name} is {value:g}", "give a number greater than 0")
    if min(damping, delay, filter_time) < 0.0:
        raise TuningError("tuning", "damping, delay or filter_time is negative", "give numbers of at least 0")
    loop = _Loop(mass, damping, period, delay, filter_time, 2)
    most = partial(_most_integral, loop, (sensitivity, complementary))
    # Crossover and ratio in the units of the loop: the delay sets the scale of time, the mass that of force.
    scale = 1.0 / (0.5 * period + delay + filter_time + period)

    def gains(x: Array) -> tuple[float, float]:
        crossover, ratio = scale * math.exp(x[0]), math.exp(x[1])
        return mass * crossover**2 * ratio, mass * crossover

    grid = [np.array([a, b]) for a in np.linspace(-2.5, 0.7, 14) for b in np.linspace(-3.0, 0.5, 12)]
    start = max(grid, key=lambda x: most(*gains(x)))
    if most(*gains(start)) <= 0.0:
        raise TuningError("tuning", "no gains keep the loop within its limits", "allow a higher sensitivity")
    simplex = np.array([start, start + np.array([0.1, 0.0]), start + np.array([0.0, 0.1])])
    options = {"xatol": 1e-4, "fatol": 1e-3, "maxfev": 200, "initial_simplex": simplex}
    found = minimize(lambda x: -most(*gains(x)), start, method="Nelder-Mead", options=options)
    kp, kd = gains(found.x)
    result = PidGains(kp, most(kp, kd), kd, filter_time)
    return result, loop_margins(result, mass, damping, period, delay=delay)


def loop_margins(gains: PidGains, mass: float, damping: float, period: float, *, delay: float = 0.0) -> LoopMargins:
    """Margins of the loop with ``gains``; arguments as for :func:`tune`."""
    loop = _Loop(mass, damping, period, delay, gains.filter_time, 7)
    triple = (gains.proportional, gains.integral, gains.derivative)
    ratio = loop.ratio(*triple)
    size, phase = np.abs(ratio), np.unwrap(np.angle(ratio))
    sensitivity, complementary = loop.peaks(*triple)
    crossings = np.nonzero(np.diff(np.sign(size - 1.0)))[0]
    # The angle to -180 deg, taken into (-180, 180]: with more than one crossover the smallest counts.
    margins = [math.degrees((phase[k] + math.pi + math.pi) % (2.0 * math.pi) - math.pi) for k in crossings]
    delays = [math.radians(margin % 360.0) / loop.omega[k] for margin, k in zip(margins, crossings, strict=True)]
    # Crossings of the negative real axis at more than unit distance from 0 bound the gain from below, the others from above.
    real_axis = np.nonzero((np.diff(np.sign(ratio.imag)) != 0) & (ratio.real[:-1] < 0.0))[0]
    above = [1.0 / size[k] for k in real_axis if size[k] < 1.0]
    low = np.nonzero(1.0 / np.abs(1.0 + ratio) >= math.sqrt(0.5))[0]
    return LoopMargins(
        gain_margin=min(above, default=math.inf),
        phase_margin=min(margins, key=abs, default=math.inf),
        delay_margin=min(delays, default=math.inf),
        sensitivity=sensitivity,
        complementary=complementary,
        crossover=float(loop.omega[crossings[-1]] / (2.0 * math.pi)) if crossings.size else 0.0,
        bandwidth=float(loop.omega[low[0]] / (2.0 * math.pi)) if low.size else math.inf,
        stable=loop.stable(*triple),
    )
