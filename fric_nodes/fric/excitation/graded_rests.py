"""Rests of graded length: after each rest one slow stroke, so that break-away can be seen over dwell time.

Equation: strokes to and fro at constant speed, with corners v(s) = v_0 + (v_1 - v_0)(3 s^2 - 2 s^3); before them rests T_k from
the shortest to the longest in equal ratios, each as often as asked for before strokes in either direction. The rests come in
random order, so that a drift in time can't pass for an effect of dwell time.
Source: break-away over dwell time, Al-Bender, Lampaert, Swevers 2004, Appendix I and the experiments quoted there; Armstrong-
Helouvry, Dupont, Canudas de Wit 1994, section 5.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..excitation_kind import Excitation, ExcitationError
from ..parameter import Parameter
from .piecewise import Piecewise

__all__ = ["EXCITATION", "Strokes"]


class Strokes(Piecewise):
    """The motion; ``rests`` are the lengths of its graded rests with their ends, ``(length, end)`` [s], in order."""

    def __init__(self) -> None:
        super().__init__()
        self.rests: list[tuple[float, float]] = []


def plan(values: Mapping[str, float], random: np.random.Generator) -> Strokes:
    short, long, speed, corner, stroke = (values[n] for n in ("rest_low", "rest_high", "speed", "corner_time", "stroke"))
    if short > long:
        raise ExcitationError("graded_rests", f"rest_low {short:g} exceeds rest_high {long:g}", "swap them")
    if speed * corner > stroke:
        problem = f"{speed:g} is not reached within a stroke of {stroke:g} and corners of {corner:g} s"
        raise ExcitationError("graded_rests", problem, "lengthen stroke, shorten corner_time or lower speed")
    # Both directions go through the same rests, each in an order of its own.
    lengths = np.repeat(np.geomspace(short, long, int(values["rests"])), int(values["repeats"]))
    orders = [random.permutation(lengths) if values["shuffle"] >= 1.0 else lengths for _ in range(2)]
    motion = Strokes()
    for pair in zip(*orders, strict=True):
        for rest, velocity, goal in zip(pair, (speed, -speed), (stroke, 0.0), strict=True):
            motion.hold(float(rest))
            motion.rests.append((float(rest), motion.duration))
            motion.change_velocity(velocity, corner)
            motion.cruise(stroke / speed - corner)
            motion.change_velocity(0.0, corner)
            motion.position = goal  # rounding of many pieces must not add up
    return motion


EXCITATION = Excitation(
    id="graded_rests",
    title="strokes after rests of graded length",
    shows="static friction over dwell time",
    parameters=(
        Parameter("rest_low", "T_1", "s", "shortest rest", default=0.05, positive=True, upper=1e5),
        Parameter("rest_high", "T_2", "s", "longest rest", default=5.0, positive=True, upper=1e6),
        Parameter("rests", "n", "1", "number of lengths, in equal ratios", lower=1, upper=1000, default=5),
        Parameter("repeats", "m", "1", "how often each length comes, in each direction", lower=1, upper=1000, default=2),
        Parameter("shuffle", "k", "1", "1: in random order; 0: from the shortest on", lower=0, upper=1, default=1),
        Parameter("speed", "v", "x/s", "speed of a stroke", default=0.005, positive=True, upper=1e4),
        Parameter("stroke", "s", "x", "length of a stroke", default=0.002, positive=True, upper=1e4),
        Parameter("corner_time", "T_c", "s", "time from rest to the speed, and back", default=0.05, positive=True, upper=100.0),
    ),
    plan=plan,
)
