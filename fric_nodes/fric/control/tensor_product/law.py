"""A tensor-product controller at work.

Equation, at sample k with the error e_k = y_k - r_k, the measured velocity v_k and, where the design has it, the force f_k:

    v_k  = (T_f v_(k-1) + y_k - y_(k-1)) / (T_f + h)
    xi_k = xi_(k-1) + h e_k      while |e_k| > tolerance
    u_k  = clip(sum_i w_i(v_k, y_k) K_i [xi_k, e_k, v_k - w_k, f_k] + forward),   w_k the velocity wanted

The integral stands still where it would drive a limited output further beyond its limit. Within the tolerance it stands still
too: an integral that never rests makes any body stick and slip for ever whose static friction is larger than its sliding
friction.
"""

from __future__ import annotations

import math
from bisect import bisect_right

import numpy as np

from ..controller import Setpoint
from .design import TensorProductController
from .quasi_lpv import TensorProductControlError

__all__ = ["TensorProductLaw"]


def _at_grid(controller: TensorProductController) -> list[list[list[float]]]:
    """Gains at each velocity and position of the grid: weights are linear between its points, and so are gains."""
    sizes = [weights.shape[1] for _, _, weights in controller.tables]
    gains = controller.physical_gains.reshape(*sizes, -1)
    gains = np.tensordot(controller.tables[0][2], gains, axes=1)
    gains = gains[:, None] if len(sizes) == 1 else np.einsum("xj,vjn->vxn", controller.tables[1][2], gains)
    held: list[list[list[float]]] = gains.tolist()
    return held


def _between(grid: list[float], at: float) -> tuple[int, float]:
    """The interval of ``grid`` that holds ``at``, and how far along it; beyond an end, that end."""
    k = min(max(bisect_right(grid, at) - 1, 0), len(grid) - 2)
    return k, min(max((at - grid[k]) / (grid[k + 1] - grid[k]), 0.0), 1.0)


class TensorProductLaw:
    """A tensor-product controller with its state.

    Args:
        controller: its design.
        limit: largest output; the smaller one of this and the design's counts.
        filter_time: time constant T_f of the velocity [s].
        tolerance: error of the position within which the integral stands still [x].
        velocity_weight: share of the velocity wanted that counts [1].

    Attributes:
        limit: largest output.
        saturated: number of samples at which the limit took something away.
    """

    def __init__(
        self,
        controller: TensorProductController,
        limit: float = math.inf,
        *,
        filter_time: float = 0.0,
        tolerance: float = 0.0,
        velocity_weight: float = 1.0,
    ) -> None:
        self.controller = controller
        self.limit = min(limit, controller.limit)
        self.filter_time = filter_time
        self.tolerance = tolerance
        self.velocity_weight = velocity_weight
        self.saturated = 0
        self.takes_force = "force" in controller.states
        grids = {name: grid.tolist() for name, grid, _ in controller.tables}
        self._velocities: list[float] = grids["velocity"]
        self._positions: list[float] | None = grids.get("position")
        self._gains = _at_grid(controller)
        self.reset()

    def reset(self) -> None:
        """Start anew, at rest."""
        self._integral = 0.0
        self._velocity = 0.0
        self._before: float | None = None

    def begin(self, wanted: Setpoint, state: tuple[float, float], force: float, duration: float) -> None:
        """Start in motion, see :meth:`fric.control.controller.Law.begin`."""
        self._velocity = state[1]
        self._before = state[0] - duration * state[1]
        gains = self.gains(state[1], state[0])
        rest = force - gains[1] * (state[0] - wanted.position)
        rest -= gains[2] * (state[1] - self.velocity_weight * wanted.velocity)
        self._integral = 0.0 if self.takes_force or gains[0] == 0.0 else rest / gains[0]

    def gains(self, velocity: float, position: float) -> list[float]:
        """The interpolated gains, in the order of the states."""
        v, along = _between(self._velocities, velocity)
        x, across = _between(self._positions, position) if self._positions else (0, 0.0)
        low, high = self._gains[v], self._gains[v + 1]
        here = [a + along * (b - a) for a, b in zip(low[x], high[x], strict=True)]
        if across == 0.0:
            return here
        other = [a + along * (b - a) for a, b in zip(low[x + 1], high[x + 1], strict=True)]
        return [a + across * (b - a) for a, b in zip(here, other, strict=True)]

    def step(self, wanted: Setpoint, measured: float, duration: float, force: float = 0.0, feedforward: float = 0.0) -> float:
        """Output for one sample that comes ``duration`` [s] after the last.

        Args:
            wanted: motion wanted.
            measured: position [x].
            duration: time since the last sample [s].
            force: the measured force of the actuator [F], where the design has it.
            feedforward: added inside the limit.

        Raises:
            TensorProductControlError: an input isn't finite, or the duration isn't positive; the state is left as it was.
        """
        if not all(map(math.isfinite, (*wanted, measured, force, feedforward))) or not 0.0 < duration < math.inf:
            given = (
                f"measured {measured}, force {force}, feedforward {feedforward}, duration {duration}, wanted {tuple(wanted)}"
            )
            raise TensorProductControlError("tensor-product controller", f"an input can't be used ({given})", "leave it out")
        before = measured if self._before is None else self._before
        self._velocity = (self.filter_time * self._velocity + measured - before) / (self.filter_time + duration)
        self._before = measured
        gains = self.gains(self._velocity, measured)
        error = measured - wanted.position
        integral = self._integral + (duration * error if abs(error) > self.tolerance else 0.0)
        answer = gains[0] * integral + gains[1] * error + gains[2] * (self._velocity - self.velocity_weight * wanted.velocity)
        answer += feedforward + (gains[3] * force if self.takes_force else 0.0)
        output = min(max(answer, -self.limit), self.limit)
        if output != answer:
            self.saturated += 1
        if (answer - output) * gains[0] * error <= 0.0:
            self._integral = integral
        return output

    def answer(self, wanted: Setpoint, measured: float, duration: float, feedforward: float = 0.0) -> float:
        """:meth:`step` of a design without measured force."""
        return self.step(wanted, measured, duration, 0.0, feedforward)
