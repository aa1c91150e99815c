"""Friction from a table of velocities and forces, linear in between: what commercial controllers offer.

Equation: F(v) = sgn(v) T(|v|) with T linear between the pairs and constant beyond the last, plus m a. With ``signed`` pairs of
both directions the table is read at v itself. At rest there is no force. The table knows no past: after a reversal the whole
force is there at the first sample of the new direction.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...parameter import Parameter
from ..feedforward_kind import FeedforwardKind, FeedforwardKindError, Force, Setting, Text

__all__ = ["FEEDFORWARD", "StaticTable", "read_table"]

_MOST = 1000  # numerical: pairs that are searched one after the other; commercial tables hold some 20


class StaticTable:
    """A table of friction forces.

    Args:
        velocities: increasing [x/s].
        forces: at them [F].
        mass: of the inertia force besides [F s^2/x].
        preview: how far the reference is extrapolated [s].

    Raises:
        FeedforwardKindError: the lists don't make a table.
    """

    def __init__(self, velocities: Sequence[float], forces: Sequence[float], mass: float = 0.0, preview: float = 0.0) -> None:
        v, f = np.asarray(velocities, dtype=np.float64), np.asarray(forces, dtype=np.float64)
        if v.ndim != 1 or v.shape != f.shape or v.shape[0] < 1 or not np.all(np.isfinite(v)) or not np.all(np.isfinite(f)):
            raise FeedforwardKindError("static table", "is not made of pairs of finite numbers", "give velocity and force each")
        if np.any(np.diff(v) <= 0.0):
            raise FeedforwardKindError("static table", "velocities don't increase", "sort the pairs, without repetition")
        self._v: list[float] = v.tolist()
        self._f: list[float] = f.tolist()
        self._signed = bool(v[0] < 0.0)
        self._mass, self._preview = mass, preview
        self.friction = 0.0

    def reset(self) -> None:
        """There is no state."""
        self.friction = 0.0

    def _at(self, velocity: float) -> float:
        v, f = self._v, self._f
        if velocity <= v[0]:
            return f[0]
        for k in range(1, len(v)):
            if velocity <= v[k]:
                return f[k - 1] + (f[k] - f[k - 1]) * (velocity - v[k - 1]) / (v[k] - v[k - 1])
        return f[-1]

    def step(self, time: float, position: float, velocity: float, acceleration: float) -> float:
        """See :meth:`fric.control.feedforward_kind.Force.step`."""
        if not math.isfinite(velocity + acceleration):
            raise FeedforwardKindError("reference", "a value is not finite", "leave the sample out")
        velocity += self._preview * acceleration
        if velocity == 0.0:
            self.friction = 0.0
        elif self._signed:
            self.friction = self._at(velocity)
        else:
            self.friction = math.copysign(1.0, velocity) * self._at(abs(velocity))
        return self.friction + self._mass * acceleration


def read_table(path: str, most: int = _MOST) -> tuple[list[float], list[float]]:
    """Velocities [x/s] and forces [F] of a text file with two numbers a line, ``#`` before comments.

    Args:
        path: of the file.
        most: pairs that are allowed.

    Raises:
        FeedforwardKindError: the file can't be read or holds something else.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise FeedforwardKindError(path, f"cannot be read ({error})", "give a text file of velocities and forces") from None
    pairs: list[tuple[float, float]] = []
    for number, line in enumerate(lines, start=1):
        words = line.partition("#")[0].replace(",", " ").split()
        if not words:
            continue
        try:
            velocity, force = (float(word) for word in words)
        except ValueError:
            problem = f"is '{line.strip()[:40]}'"
            raise FeedforwardKindError(f"{path}, line {number}", problem, "give one velocity and one force") from None
        pairs.append((velocity, force))
        if len(pairs) > most:
            raise FeedforwardKindError(path, f"has more than {most} pairs", "give fewer")
    return [pair[0] for pair in pairs], [pair[1] for pair in pairs]


def _build(setting: Setting) -> Force:
    return StaticTable(*read_table(setting.texts["file"]), setting.values["mass"], setting.preview)


FEEDFORWARD = FeedforwardKind(
    id="static_table",
    title="table of velocities and friction forces",
    build=_build,
    parameters=(Parameter("mass", "m", "F s^2/x", "mass of the inertia force besides", lower=0.0, default=0.0),),
    texts=(Text("file", "a text file with a velocity [x/s] and a force [F] in each line", is_file=True),),
)
