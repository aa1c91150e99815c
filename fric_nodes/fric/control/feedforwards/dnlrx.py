"""Force of a DNLRX along the reference, as Amthor and others use it on a guideway.

Equation: u(k) = sum_j g_j r(k - j) + sum_j Theta_j' delta(k - j) + b, with r(k) the reference's position a preview later,
extrapolated with its velocity and acceleration. The force holds inertia, damping, friction with its memory of reversals, and
the offset; no derivative of the reference is formed outside the filters.

A DNLRX means something at its own sample time only, so another period is refused.
Source: Amthor, Hausotte, Ament, Li, Jaeger, IFAC 2008, Eq. 14 and Fig. 7.
"""

from __future__ import annotations

import math

import numpy as np

from ...friction import dnlrx_loops
from ...friction.dnlrx import DnlrxModel
from ...friction.dnlrx_file import read_dnlrx
from ...parameter import Parameter
from ..feedforward_kind import FeedforwardKind, FeedforwardKindError, Force, Setting, Text, checked_units

__all__ = ["FEEDFORWARD", "DnlrxForce"]

_TOLERANCE = 1e-6  # numerical: of the sample time, for one that is written with few digits


class DnlrxForce:
    """A DNLRX along the reference.

    Args:
        model: the DNLRX, identified at ``period``.
        period: between two references [s].
        preview: how far the reference is extrapolated [s].

    Raises:
        FeedforwardKindError: the sample time isn't the period.

    Attributes:
        friction: force of the springs at the last sample [F].
    """

    def __init__(self, model: DnlrxModel, period: float, preview: float = 0.0) -> None:
        if abs(model.sample_time - period) > _TOLERANCE * period:
            problem = f"has a sample time of {model.sample_time:g} s, the controller a period of {period:g} s"
            raise FeedforwardKindError("DNLRX", problem, "identify it at the controller's period")
        self.model = model
        self.preview = preview
        n_springs, n_delta, n = model.order
        self._values = model.thresholds, model.position_filter, model.deformation_filter, float(model.offset)
        self._positions = np.zeros(max(n, 1))
        self._deformations = np.zeros((max(n_delta, 1), n_springs))
        self._work, self._in, self._out = np.zeros(n_springs), np.zeros(1), np.zeros(1)
        self.reset()
        self._predict(0.0)  # compiles, or takes from the cache, before the loop runs
        self.reset()

    def reset(self) -> None:
        """Start anew, at rest where the next reference is, with all springs relaxed."""
        self._begun = False
        self._deformations[:] = 0.0
        self.friction = 0.0

    def _predict(self, position: float) -> float:
        self._in[0] = position
        dnlrx_loops.predict(*self._values, self._in, self._positions, self._deformations, self._work, self._out)
        return float(self._out[0])

    def step(self, time: float, position: float, velocity: float, acceleration: float) -> float:
        """See :meth:`fric.control.feedforward_kind.Force.step`.

        Raises:
            FeedforwardKindError: a value isn't finite; the state is left as it was.
        """
        if not math.isfinite(position + velocity + acceleration):
            raise FeedforwardKindError("reference", "a value is not finite", "leave the sample out")
        ahead = self.preview
        position += ahead * (velocity + 0.5 * ahead * acceleration)
        if not self._begun:
            self._positions[:] = position
            self._begun = True
        force = self._predict(position)
        self.friction = float(self._values[2][0] @ self._deformations[0]) if self._deformations.size else 0.0
        return force


def _build(setting: Setting) -> Force:
    model, units = read_dnlrx(setting.texts["file"])
    checked_units(units, setting, setting.texts["file"])
    return DnlrxForce(model, setting.period, setting.preview + setting.values["advance"])


FEEDFORWARD = FeedforwardKind(
    id="dnlrx",
    title="DNLRX along the reference",
    build=_build,
    parameters=(Parameter("advance", "T_a", "s", "time by which the reference is looked ahead besides", default=0.0),),
    texts=(Text("file", "a fric-dnlrx/1 file", is_file=True),),
    source="Amthor et al. 2008, Eq. 14 and Fig. 7",
)
