"""Pseudo-random binary sequence of maximum length, its edges rounded off so that velocity and acceleration are finite.

Equation: b_k = b_(k-n) xor b_(k-m) (Fibonacci shift register of n stages, primitive trinomial or pentanomial), period 2^n - 1;
q = A (1 - 2 b_k) over one clock period each, with a minimum-jerk move within the edge time where it changes. Largest velocity
3.75 A/T_e, largest acceleration 11.547 A/T_e^2. The spectrum is flat from 1/(T_c (2^n - 1)) to about 0.4/T_c; the edges leave
it alone below 0.5/T_e. Published as a force, an edge time of 0 makes it jump.
Source: Golomb 1967; Ljung 1999, System Identification, section 13.3. The taps are those of primitive polynomials.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..excitation_kind import Excitation, ExcitationError, Trajectory
from ..parameter import Parameter
from .piecewise import Piecewise

__all__ = ["EXCITATION", "maximum_length_sequence"]

_TAPS: Mapping[int, tuple[int, ...]] = {
    2: (2, 1),
    3: (3, 2),
    4: (4, 3),
    5: (5, 3),
    6: (6, 5),
    7: (7, 6),
    8: (8, 6, 5, 4),
    9: (9, 5),
    10: (10, 7),
    11: (11, 9),
    12: (12, 11, 10, 4),
    13: (13, 12, 11, 8),
    14: (14, 13, 12, 2),
    15: (15, 14),
    16: (16, 15, 13, 4),
}
"""Stages that feed back, by the number of stages."""


def maximum_length_sequence(stages: int, start: int) -> NDArray[np.int64]:
    """One period of the bits, shape ``(2^stages - 1,)``, from the register's content ``start`` in ``[1, 2^stages - 1]``."""
    register = start
    bits = np.empty(2**stages - 1, dtype=np.int64)
    for k in range(bits.shape[0]):
        bits[k] = (register >> (stages - 1)) & 1
        fed = 0
        for tap in _TAPS[stages]:
            fed ^= register >> (tap - 1)
        register = ((register << 1) | (fed & 1)) & (2**stages - 1)
    return bits


def plan(values: Mapping[str, float], random: np.random.Generator) -> Trajectory:
    clock, edge, stages = values["clock"], values["edge_time"], int(values["stages"])
    if edge > clock:
        raise ExcitationError("prbs", f"edge_time {edge:g} s is longer than clock {clock:g} s", "shorten it")
    sequence = maximum_length_sequence(stages, int(random.integers(1, 2**stages)))
    levels = values["amplitude"] * (1.0 - 2.0 * np.tile(sequence, int(values["periods"])))
    motion = Piecewise()
    for level in (*levels.tolist(), 0.0):
        changes = level != motion.position
        if changes:
            motion.move(level, edge)
        motion.hold(clock - edge if changes else clock)
    return motion


EXCITATION = Excitation(
    id="prbs",
    title="pseudo-random binary sequence",
    shows="the linear dynamics over a wide band: inertia, resonances, delay and lag of the drive",
    parameters=(
        Parameter("amplitude", "A", "x", "it changes between +A and -A", default=0.001, positive=True, upper=1e9),
        Parameter("stages", "n", "1", "stages of the shift register; 2^n - 1 clock periods", lower=2, upper=16, default=8),
        Parameter("clock", "T_c", "s", "clock period, the shortest time at one level", default=0.05, positive=True, upper=1e4),
        Parameter("edge_time", "T_e", "s", "time of a change; 0: at once", lower=0.0, upper=1e4, default=0.03),
        Parameter("periods", "p", "1", "number of periods of the sequence", lower=1, upper=1000, default=1),
    ),
    plan=plan,
)
