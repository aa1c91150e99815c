"""de Marchi's pendulums, integrated from reversal to reversal, and recorded as an encoder would.

The right side is m x'' = -(c + d sgn v) v - k x - (F + D sgn v) sgn v as it stands, integrated by an explicit Runge-Kutta
method of order 8 to 1e-12 up to each instant at which the velocity is zero; nothing of the closed form is used.

The table of the slides: measured values of omega_0, zeta mean and difference, x_k mean and difference. Data set 2 prints a
damping difference of 0.0086 beside an estimate of 0.0036; the coefficient that the thesis gives for it, 5.853e-4 N m s/rad, is
2 J omega_0 times 0.0036, with J = k_i/omega_0^2 = 0.01161 kg m^2 as in the other three, so 0.0086 is a misprint and 0.0036 is
used. Data set 4 prints zeta 0.009 (estimated 0.0077): its coefficient, 0.0011 N m s/rad, belongs to 0.0077 too (0.009 gives
0.0013), and one digit is missing; 0.0090, as printed, is used, being the measured value.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from ..record import Array, Record, Units

__all__ = ["COUNTS", "INERTIA", "PENDULUMS", "STIFFNESS", "Pendulum", "Swing", "gain", "recorded", "swing"]

INERTIA = 0.01161
"""k_i/omega_0^2 of the table, the same in all four data sets [kg m^2]."""

STIFFNESS = 0.0162
"""Mean of k_i - P_i of the table [N m/rad]."""

COUNTS = 4096
"""Steps of the encoder in a turn: 1024 lines, four edges each."""

_NOISE = 5e-4  # [rad], a third of a step
_RATE = 1000.0  # [Hz]


@dataclass(frozen=True)
class Pendulum:
    """Natural parameters of a pendulum: omega_0 [rad/s], zeta and its difference [1], x_k and its difference [rad]."""

    frequency: float
    damping: float
    damping_difference: float
    offset: float
    offset_difference: float

    @property
    def values(self) -> Array:
        """In this order, shape ``(5,)``."""
        return np.array([self.frequency, self.damping, self.damping_difference, self.offset, self.offset_difference])


PENDULUMS = {
    "#1": Pendulum(7.4337, 0.0160, 0.0028, 0.0780, 0.0351),
    "#2": Pendulum(7.0008, 0.0147, 0.0036, 0.0792, 0.0330),
    "#3": Pendulum(6.7371, 0.0124, 0.0026, 0.0731, 0.0381),
    "#4": Pendulum(6.1495, 0.0090, 0.0067, 0.0660, 0.0380),
}
"""The measured columns of the table."""


def gain(pendulum: Pendulum) -> float:
    """Position feedback [N m/rad] with which the one inertia and stiffness have this pendulum's frequency.

    The printed gains are up to 3 % off it: they, the printed frequencies and one inertia don't go together.
    """
    return INERTIA * pendulum.frequency**2 - STIFFNESS


@dataclass(frozen=True, eq=False)
class Swing:
    """A free oscillation: position [x] at any times [s], and the time [s] at which it stops."""

    position: Callable[[Array], Array]
    stop: float


def swing(pendulum: Pendulum, start: float) -> Swing:
    """Released at rest from ``start`` [x]."""
    spring = pendulum.frequency**2
    dry, dry_difference = spring * pendulum.offset, spring * pendulum.offset_difference
    wet, wet_difference = (2.0 * pendulum.frequency * z for z in (pendulum.damping, pendulum.damping_difference))
    pieces: list[tuple[float, Callable[[Array], Array]]] = []
    time, position = 0.0, start
    while abs(spring * position + dry_difference) > dry:
        s = -1.0 if spring * position + dry_difference > 0 else 1.0

        def right_side(t: float, y: Array, s: float = s) -> list[float]:
            return [y[1], -(wet + s * wet_difference) * y[1] - spring * y[0] - s * (dry + s * dry_difference)]

        def turns(t: float, y: Array, s: float = s, begun: float = time) -> float:
            # It starts from rest: the first instants are no reversal.
            return float(y[1]) if t > begun + 1e-3 * np.pi / np.sqrt(spring) else s

        turns.terminal = True  # type: ignore[attr-defined]
        answer = solve_ivp(
            right_side, (time, time + 4.0 * np.pi / pendulum.frequency), [position, 0.0],
            method="DOP853", rtol=1e-12, atol=1e-14, events=turns, dense_output=True,
        )  # fmt: skip
        pieces.append((time, answer.sol))
        time, position = float(answer.t[-1]), float(answer.y[0, -1])
    begins = np.array([begin for begin, _ in pieces])
    last = position

    def at(times: Array) -> Array:
        number = np.searchsorted(begins, times, side="right") - 1
        found = np.where(times < 0, start, last)
        for k, (_, solution) in enumerate(pieces):
            here = (number == k) & (times < time)
            if np.any(here):
                found[here] = solution(times[here])[0]
        return found

    return Swing(at, time)


def recorded(
    motion: Swing, seed: int, noise: float = _NOISE, step: float = 2.0 * np.pi / COUNTS, rate: float = _RATE
) -> Record:
    """``motion`` as an encoder gives it: held for 0.3 s, released between two samples, until 0.8 s after it stops.

    Args:
        motion: what is recorded.
        seed: of the noise, of the release's time between samples and of the encoder's zero.
        noise: standard deviation before rounding [rad].
        step: of the encoder [rad]; 0: none.
        rate: samples in a second.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(int((motion.stop + 1.1) * rate)) / rate
    position = motion.position(time - 0.3 - rng.uniform(0.0, 1.0 / rate)) + noise * rng.standard_normal(time.shape[0])
    if step:
        zero = rng.uniform(0.0, step)
        position = np.round((position + zero) / step) * step - zero
    return Record(time, position, np.zeros_like(time), units=Units("rad", "N m"), source=f"pendulum, seed {seed}")
