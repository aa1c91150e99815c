"""A pneumatic cylinder whose valve is moved by a force controller of its own, so that it takes a force like any other axis.

Equation: the force of the air f = A (p_a - p_b) follows f' = -k v + b u (:mod:`fric.control.tensor_product.quasi_lpv`), and the
valve is moved by

    u = (w (F - f) + k v_f)/b + u_0 sgn(.),

F the force wanted, v_f the encoder's velocity behind a lag, u_0 the overlap that the valve's sheet states, and k, b those of
the nominal cylinder in the middle of its stroke. The force therefore comes 1/w late, and is off by what the drawn cylinder
differs from the nominal one.
"""

from __future__ import annotations

import math

import numpy as np

from ...axis import Measurement, SimulatedAxis
from ...control.tensor_product.quasi_lpv import pneumatic_cylinder
from ...friction.tensor_product import from_law
from ...model import Model

__all__ = ["BANDWIDTH", "Cylinder"]

BANDWIDTH = 200.0
"""Of the force controller, w [1/s]: what a valve of some 50 Hz bears (physical)."""

_PRESSURE = 3.5e5  # [Pa], physical: of both chambers at the start, and of the controller's linearisation
_FILTER = 2e-3  # [s], physical: of the velocity
_STEPS = 4  # numerical: of the force controller in a period of the axis's
_SMALL = 1e-3  # numerical: opening below which the overlap is led through in a straight line


class Cylinder:
    """The cylinder in motion; positions count from the middle of its stroke.

    Args:
        truth: model of the cylinder.
        nominal: that its force controller was made for.
        resolution: step of the encoder [x].
        force_noise: of the force from the pressures [F].
        force_limit: largest force wanted [F].
        seed: of the noise.
    """

    def __init__(
        self, truth: Model, nominal: Model, resolution: float, force_noise: float, force_limit: float, seed: int
    ) -> None:
        self._middle = 0.5 * truth.value("stroke")
        self._axis = SimulatedAxis(
            truth, resolution=resolution, force_noise=force_noise, force_limit=1.0, seed=seed, position=self._middle
        )
        self._axis.set_states((self._middle, 0.0, _PRESSURE, _PRESSURE))
        self._area, self._limit = truth.value("area"), force_limit
        self._resolution = resolution
        self._stiffness, self._gain = _linearised(nominal)
        self._overlap = 0.5 * (nominal.value("supply_overlap") + nominal.value("exhaust_overlap"))
        self._velocity, self._before = 0.0, self._middle

    @property
    def position(self) -> float:
        """True position [x]."""
        return self._axis.position - self._middle

    def measure(self) -> Measurement:
        """What the sensors say; the effort is the force of the air."""
        said = self._axis.measure()
        return said._replace(position=said.position - self._middle)

    def advance(self, force: float, duration: float) -> None:
        """Lead it over ``duration`` [s] with ``force`` [F] wanted."""
        wanted, piece = min(max(force, -self._limit), self._limit), duration / _STEPS
        for _ in range(_STEPS):
            seen = self._resolution * round(self._axis.position / self._resolution)
            self._velocity += piece / (_FILTER + piece) * ((seen - self._before) / piece - self._velocity)
            self._before = seen
            one, other = self._axis.signals()
            error = wanted - self._area * (one - other)
            opening = (BANDWIDTH * error + self._stiffness * self._velocity) / self._gain
            opening += self._overlap * min(max(opening / _SMALL, -1.0), 1.0)
            self._axis.advance(opening, piece)


def _linearised(nominal: Model) -> tuple[float, float]:
    """Stiffness k [F/x] and gain b [F/s] of the cylinder in the middle of its stroke."""
    stroke = nominal.value("stroke")
    viscous = from_law(lambda v: v, lambda v: v, nominal.value("mass"), np.array([-1.0, -0.5, 0.5, 1.0]))
    held = pneumatic_cylinder(
        nominal, viscous, slowest=0.6, fastest=0.9, error=stroke, force=1.0,
        positions=(0.0, stroke), pressures=(_PRESSURE, _PRESSURE),
    )  # fmt: skip
    at = [0.75 if each.name == "velocity" else 0.5 * stroke if each.name == "position" else 1.0 for each in held.parameters]
    matrix = held.matrix(np.array(at))
    stiffness, gain = float(-matrix[3, 2]), float(matrix[3, 4])
    assert math.isfinite(stiffness)
    assert gain > 0.0
    return stiffness, gain
