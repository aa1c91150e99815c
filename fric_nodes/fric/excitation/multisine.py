"""Multisine: a sum of sines of the same size in velocity, with random phases, scaled to a peak position and a peak velocity.

Equation: q(t) = w(t) g sum_k sin(2 pi f_k t + phi_k) / f_k, with lines f_k = k/T between the band's edges, w a window that
fades in and out, and g such that neither limit is exceeded.
Source: Pintelon and Schoukens 2012, System Identification, section 2.3 (random phase multisines).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..excitation_kind import Excitation, ExcitationError, Points, Trajectory
from ..parameter import Parameter
from ..record import Array
from .windowed import Windowed

__all__ = ["EXCITATION"]


class _Lines:
    """Sum of sines; ``size`` of shape ``(n_lines,)`` are position amplitudes [x]."""

    def __init__(self, omega: Array, phase: Array, size: Array) -> None:
        self.omega, self.phase, self.size = omega, phase, size

    def __call__(self, time: Array) -> Points:
        q, v, a = np.zeros_like(time), np.zeros_like(time), np.zeros_like(time)
        for omega, phase, size in zip(self.omega, self.phase, self.size, strict=True):
            angle = omega * time + phase
            sine, cosine = size * np.sin(angle), size * np.cos(angle)
            q, v, a = q + sine, v + omega * cosine, a - omega * omega * sine
        return Points(q, v, a)


def plan(values: Mapping[str, float], random: np.random.Generator) -> Trajectory:
    duration, low, high = values["duration"], values["frequency_low"], values["frequency_high"]
    number = np.arange(max(math.ceil(low * duration), 1), math.floor(high * duration) + 1)
    if number.size == 0:
        remedy = "raise frequency_high, lower frequency_low or lengthen duration"
        raise ExcitationError("multisine", f"no line of 1/{duration:g} s lies in {low:g} to {high:g} Hz", remedy)
    lines = int(values["lines"])
    if number.size > lines:
        number = np.unique(np.round(np.geomspace(number[0], number[-1], lines)).astype(int))
    omega: Array = 2.0 * math.pi * number.astype(np.float64) / duration
    phase = random.uniform(0.0, 2.0 * math.pi, number.size)
    wave = _Lines(omega, phase, 1.0 / omega)
    motion = Windowed(wave, duration, values["ramp"])
    samples = motion.at(np.linspace(0.0, duration, max(int(40 * high * duration), 100)))
    scale = min(
        values["amplitude"] / float(np.max(np.abs(samples.position))), values["speed"] / float(np.max(np.abs(samples.velocity)))
    )
    # A little less, for peaks between the points that were looked at.
    wave.size = wave.size * 0.995 * scale
    return motion


EXCITATION = Excitation(
    id="multisine",
    title="random-phase multisine",
    shows="inertia and viscous friction, over many speeds and reversals",
    parameters=(
        Parameter("duration", "T", "s", "length", lower=0.1, upper=1e5, default=20.0),
        Parameter("frequency_low", "f_1", "1/s", "lower edge of the band", lower=1e-4, upper=1e4, default=0.1),
        Parameter("frequency_high", "f_2", "1/s", "upper edge of the band", lower=1e-4, upper=1e4, default=4.0),
        Parameter(
            "lines", "n", "1", "most sines to use, spread over the band in equal ratios", lower=1, upper=1000, default=30
        ),
        Parameter("amplitude", "q_max", "x", "largest position", default=0.05, positive=True, upper=1e4),
        Parameter("speed", "v_max", "x/s", "largest velocity", default=0.3, positive=True, upper=1e4),
        Parameter("ramp", "T_r", "s", "time to fade in, and out", lower=0.0, upper=1e4, default=1.0),
    ),
    plan=plan,
)
