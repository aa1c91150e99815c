"""Limit cycles foretold by harmonic balance: first harmonics of friction and of the controller itself, on a sinusoidal motion.

The axis is taken to swing with y = A sin(w t) about a position that the reference holds. Friction F and command u then have
first harmonics, as complex numbers beside that of y,

    N(A, w) = F_1/A,    C(A, w) = -u_1/A,

both found by running what is really there along that motion: the identified friction with its pre-sliding, and the law with its
dead zone, resets, friction compensation and limit, behind the encoder. With the hold over a period h and the delay tau the
command acts as u e^(-j w (h/2 + tau)) sinc(w h/2), and the motion goes on when

    D(A, w) = N(A, w) + C(A, w) e^(-j w (h/2 + tau)) sinc(w h/2) - m w^2 = 0.

Zeros of D are limit cycles as far as the axis filters the higher harmonics, which a mass does with 1/w^2. Where D at the same w
turns from damping (Im D > 0, energy leaves) below the amplitude to driving above it, the cycle is the border of what comes to
rest; the other way round it is where the axis ends.

What this can't foretell: stick-slip of an integral, of which the motion is no sine but rests and jumps; that is left to the
simulation of :func:`fric.control.autotune.resting_width`. Source: Gelb and Vander Velde 1968; Armstrong-Helouvry and Amin 1996
(where describing functions fail for friction).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..model import Model
from ..record import Array
from ..simulation import Predictor
from .controller import Law, Setpoint

__all__ = ["LimitCycle", "friction_harmonic", "law_harmonic", "limit_cycles"]

_SETTLED, _COUNTED = 2, 1  # numerical: periods of motion before the harmonic is taken, and over which it is
_SAMPLES = 400  # numerical: of friction in a period
_FREQUENCIES, _AMPLITUDES = 20, 10  # numerical: of the grid, at equal ratios
_BISECTIONS = 6  # numerical: of a zero between two amplitudes


@dataclass(frozen=True)
class LimitCycle:
    """A motion that keeps itself up.

    Attributes:
        amplitude: A [x].
        frequency: [Hz].
        stable: True where the axis ends in it, False where it is the border of what comes to rest.
    """

    amplitude: float
    frequency: float
    stable: bool


def _first(values: Array, phase: Array) -> complex:
    """First harmonic of ``values`` beside sin(``phase``), over whole periods."""
    rotor = np.exp(-1j * phase)
    return complex(2.0 * np.mean(values * rotor) * 1j)


def friction_harmonic(model: Model, amplitude: float, frequency: float) -> complex:
    """N(A, w) of the model's friction and other forces, without its inertia [F/x]; ``frequency`` in Hz."""
    w = 2.0 * math.pi * frequency
    n = (_SETTLED + _COUNTED) * _SAMPLES
    h = 1.0 / (frequency * _SAMPLES)
    t = h * np.arange(n, dtype=np.float64)
    q, v = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)
    force, _ = Predictor(model).run(t, q, v, np.zeros(n), h)
    last = slice(_SETTLED * _SAMPLES, None)
    return _first(force[last], np.asarray(w * t[last])) / amplitude


def law_harmonic(law: Law, amplitude: float, frequency: float, period: float, resolution: float = 0.0) -> complex:
    """C(A, w) of a law that holds the position 0 and reads every ``period`` [s] an encoder of ``resolution`` [x] [F/x]."""
    law.reset()
    n = max(round(1.0 / (frequency * period)), 4)
    w = 2.0 * math.pi / (n * period)  # a whole number of samples in a period
    phase = w * period * np.arange((_SETTLED + _COUNTED) * n)
    seen = amplitude * np.sin(phase)
    if resolution > 0.0:
        seen = resolution * np.round(seen / resolution)
    rest = Setpoint(0.0)
    force = np.array([law.answer(rest, each, period) for each in seen.tolist()])
    last = slice(_SETTLED * n, None)
    return -_first(force[last], np.asarray(phase[last])) / amplitude


def limit_cycles(
    model: Model,
    law: Callable[[], Law],
    period: float,
    *,
    delay: float = 0.0,
    resolution: float = 0.0,
    smallest: float,
    largest: float,
    crossover: float,
) -> list[LimitCycle]:
    """Limit cycles of ``law`` against ``model``.

    Args:
        model: identified; its total inertia is the mass.
        law: builds the controller anew.
        period: between two readings [s].
        delay: from a reading until its command acts [s].
        resolution: step of the encoder [x].
        smallest: amplitude looked for [x].
        largest: likewise [x].
        crossover: of the loop [rad/s]; frequencies from a twentieth of it to four times are looked at.

    Raises:
        InputError: the range of amplitudes is none.
    """
    if not 0.0 < smallest < largest < math.inf:
        raise InputError("limit cycles", f"amplitudes from {smallest:g} to {largest:g}", "give 0 < smallest < largest")
    made = law()
    highest = min(4.0 * crossover / (2.0 * math.pi), 0.2 / period)
    frequencies = np.geomspace(0.05 * crossover / (2.0 * math.pi), highest, _FREQUENCIES).tolist()

    def balance(amplitude: float, frequency: float) -> complex:
        # The law takes whole samples in a period: friction is asked at the same frequency.
        n = max(round(1.0 / (frequency * period)), 4)
        frequency = 1.0 / (n * period)
        w = 2.0 * math.pi * frequency
        half = 0.5 * w * period
        held = cmath.exp(-1j * w * (0.5 * period + delay)) * math.sin(half) / half
        of_law = law_harmonic(made, amplitude, frequency, period, resolution) * held
        return friction_harmonic(model, amplitude, frequency) + of_law - model.total_inertia * w * w

    amplitudes = np.geomspace(smallest, largest, _AMPLITUDES).tolist()
    grid = [[balance(a, f) for f in frequencies] for a in amplitudes]
    found: list[LimitCycle] = []
    for k in range(_AMPLITUDES - 1):
        low, high = _resonance(frequencies, grid[k]), _resonance(frequencies, grid[k + 1])
        if low is None or high is None or low[1] * high[1] > 0.0:
            continue
        amplitude, frequency = _between(balance, frequencies, amplitudes[k], amplitudes[k + 1], low[1])
        found.append(LimitCycle(amplitude, frequency, low[1] < 0.0))
    return found


def _resonance(frequencies: Sequence[float], values: Sequence[complex]) -> tuple[float, float] | None:
    """Highest frequency at which Re D passes 0 downwards, where mass and stiffness balance, and Im D there; None: nowhere."""
    for k in reversed(range(len(values) - 1)):
        a, b = values[k], values[k + 1]
        if a.real > 0.0 >= b.real:
            share = a.real / (a.real - b.real)
            return frequencies[k] + share * (frequencies[k + 1] - frequencies[k]), a.imag + share * (b.imag - a.imag)
    return None


def _between(
    balance: Callable[[float, float], complex], frequencies: Sequence[float], low: float, high: float, below: float
) -> tuple[float, float]:
    """Amplitude and frequency between ``low`` and ``high`` at which damping turns its sign; ``below`` is that at ``low``."""
    frequency = math.nan
    for _ in range(_BISECTIONS):
        middle = math.sqrt(low * high)
        at = _resonance(frequencies, [balance(middle, f) for f in frequencies])
        if at is None:
            break
        frequency = at[0]
        low, high = (middle, high) if at[1] * below > 0.0 else (low, middle)
    return math.sqrt(low * high), frequency
