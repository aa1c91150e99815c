"""Chirp: a sine of exponentially rising frequency, its amplitude such that position, velocity and acceleration keep limits.

Equation: q(t) = A(f) sin(2 pi integral of f dt), f(t) = f_1 (f_2/f_1)^(t/T), A(f) the least of q_max, v_max/(2 pi f),
a_max/(2 pi f)^2, rounded off where one limit takes over from another (harmonic mean of second powers), so that A has
continuous derivatives.
Source: exponential sweep, Farina 2000; the amplitude law is this module's own.
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


def plan(values: Mapping[str, float], random: np.random.Generator) -> Trajectory:
    duration, low, high = values["duration"], values["frequency_low"], values["frequency_high"]
    if low >= high:
        raise ExcitationError("chirp", f"frequency_low {low:g} is not below frequency_high {high:g}", "swap them")
    rate = math.log(high / low) / duration
    inverse = (1.0 / values["amplitude"], 1.0 / values["speed"], 1.0 / values["acceleration"])

    def wave(time: Array) -> Points:
        omega = 2.0 * math.pi * low * np.exp(rate * time)
        angle = (omega - 2.0 * math.pi * low) / rate
        # A = s^(-1/2), s the sum of squares of w^k / limit_k, and dw/dt = rate w.
        parts = [(inverse[k] * omega**k) ** 2 for k in range(3)]
        s = parts[0] + parts[1] + parts[2]
        ds = 2.0 * rate * (parts[1] + 2.0 * parts[2])
        dds = 4.0 * rate**2 * (parts[1] + 4.0 * parts[2])
        size = s**-0.5
        d_size = -0.5 * s**-1.5 * ds
        dd_size = 0.75 * s**-2.5 * ds**2 - 0.5 * s**-1.5 * dds
        sine, cosine = np.sin(angle), np.cos(angle)
        velocity = d_size * sine + size * omega * cosine
        acceleration = dd_size * sine + 2.0 * d_size * omega * cosine + size * (rate * omega * cosine - omega**2 * sine)
        return Points(size * sine, velocity, acceleration)

    return Windowed(wave, duration, values["ramp"])


EXCITATION = Excitation(
    id="chirp",
    title="exponential sweep",
    shows="inertia, and resonances of the structure",
    parameters=(
        Parameter("duration", "T", "s", "length", lower=0.1, upper=1e5, default=20.0),
        Parameter("frequency_low", "f_1", "1/s", "frequency at the start", lower=1e-4, upper=1e4, default=0.2),
        Parameter("frequency_high", "f_2", "1/s", "frequency at the end", lower=1e-4, upper=1e4, default=20.0),
        Parameter("amplitude", "q_max", "x", "largest position", default=0.05, positive=True, upper=1e4),
        Parameter("speed", "v_max", "x/s", "largest velocity", default=0.2, positive=True, upper=1e4),
        Parameter("acceleration", "a_max", "x/s^2", "largest acceleration", default=5.0, positive=True, upper=1e5),
        Parameter("ramp", "T_r", "s", "time to fade in, and out", lower=0.0, upper=1e4, default=1.0),
    ),
    plan=plan,
)
