"""One raised cosine."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from fric.excitation_kind import Excitation, Points
from fric.parameter import Parameter
from fric.record import Array


class Bump:
    def __init__(self, height: float, duration: float) -> None:
        self.height, self.duration = height, duration

    def at(self, time: Array) -> Points:
        w = 2.0 * np.pi / self.duration
        h = 0.5 * self.height
        return Points(h * (1.0 - np.cos(w * time)), h * w * np.sin(w * time), h * w**2 * np.cos(w * time))


def plan(values: Mapping[str, float], random: np.random.Generator) -> Bump:
    return Bump(values["height"], values["duration"])


EXCITATION = Excitation(
    id="bump",
    title="raised cosine",
    shows="one stroke forward and back",
    parameters=(
        Parameter("height", "s", "x", "stroke", default=0.01, positive=True),
        Parameter("duration", "T", "s", "time for it", default=1.0, positive=True),
    ),
    plan=plan,
)
