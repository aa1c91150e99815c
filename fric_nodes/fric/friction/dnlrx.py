"""DNLRX: dynamic nonlinear regression with direct application of excitation, an inverse model of an axis with friction.

Equations, with x(k) the displacement at sample k, T the sample time and delta(k) the deformations of M Maxwell-slip springs:

    (11)  delta_i(k) = sgn(s) min(|s|, Delta_i),  s = x(k) - x(k-1) + delta_i(k-1)
    (14)  u(k) = sum_{j=0..n} g_j x(k-j) + sum_{j=0..n_delta} Theta_j' delta(k-j) + b

One FIR filter over the displacement holds mass, damper, spring and whatever else is linear; a second one over the deformations
holds the friction, with its memory of reversal points; b is an offset (Eq. 17).
Source: Amthor, Hausotte, Ament, Li, Jaeger, IFAC 2008, Eqs. 8-14, 17, 18; Rizos and Fassois 2005.

What is printed and what is meant:

- Eq. 13 has ``u - sum r_j x + sum Theta_j' delta`` on its right. From Eq. 8, m a + d v + c x = u - f, with f of Eq. 12, both
  sums are subtracted; brackets were lost. Only so does Eq. 14, whose Theta is positive, follow from it.
- Below Eq. 14, g_j = m q_j + d p_j + c + r_j adds the spring to every coefficient. Eq. 13 has c x(k) alone: c belongs to g_0.
- Eqs. 9 and 10 sum over j and index p and q by i; Eqs. 14 and 17 name the same order n_delta and n_s.
- (M, n_x, n_delta) as in "DNLRX (M=5, n_x=3, n_s=3)" can't be the order in "(10, 0, 3)": its n_x = 0 would leave nothing for
  mass and damper, and its n_delta = 3 would keep the filter that the text says was taken away. It is (M, n_delta, n_x).

**Simulator.** Given u(k) and the past, Eq. 14 is one equation in x(k), piecewise linear with corners where a spring begins to
slide. Its slope is g_0 plus the Theta_0 of the springs that stick. Away from x(k-1) those are the springs with more room than
what has been travelled; room Delta - delta never falls with Delta, since stop operators on a common displacement differ by no
more than their thresholds do, so the springs that stick are always those above some threshold. The equation therefore has one
solution for every u exactly when g_0 and every sum of g_0 and the Theta_0 above a threshold are positive, which is checked; it
is found exactly by going from corner to corner, at most M + 1 of them.

**Steps.** While spring i follows a motion of velocity v, sum_j Theta_ji delta_i(k-j) = (sum_j Theta_ji) delta_i(k) -
v T sum_j j Theta_ji; once it slides the last part is gone. With n_delta > 0 the force therefore steps by v T sum_j j Theta_ji,
within n_delta samples, whenever a spring begins to slide (and back when it sticks again at a reversal without rest);
for a spring with a damper in parallel, Theta_0 = k + sigma/T and Theta_1 = -sigma/T, it is the damper's force sigma v that
goes. :func:`step_at_slip` gives the factor of v. This is what made the (5,3,3) of the paper useless as a feedforward, and
n_delta = 0 cures it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..record import Array
from . import dnlrx_loops

__all__ = [
    "DnlrxError",
    "DnlrxModel",
    "DnlrxPredictor",
    "DnlrxSimulator",
    "derivative_filter",
    "from_mechanics",
    "poles",
    "step_at_slip",
]


class DnlrxError(InputError):
    """A DNLRX, or data for one, that cannot be used."""


@dataclass(frozen=True, eq=False)
class DnlrxModel:
    """A DNLRX with its values; the order is ``(M, n_delta, n)``.

    Attributes:
        sample_time: T, the only one at which the filters mean what they do [s].
        thresholds: Delta, the deformations at which the springs slide [x], shape ``(M,)``; M may be 0.
        position_filter: g_0 to g_n [F/x], shape ``(n + 1,)``.
        deformation_filter: Theta_0 to Theta_n_delta [F/x], shape ``(n_delta + 1, M)``.
        offset: b [F].

    Raises:
        DnlrxError: shapes that don't match, numbers that aren't finite, a threshold or sample time that isn't positive.
    """

    sample_time: float
    thresholds: Array
    position_filter: Array
    deformation_filter: Array
    offset: float = 0.0

    def __post_init__(self) -> None:
        for name, dimensions in (("thresholds", 1), ("position_filter", 1), ("deformation_filter", 2)):
            values = np.array(getattr(self, name), dtype=np.float64)
            if values.ndim != dimensions or not np.all(np.isfinite(values)):
                raise DnlrxError(f"DNLRX {name}", "is not an array of finite numbers", f"give {dimensions} dimension(s)")
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        if self.position_filter.shape[0] == 0:
            raise DnlrxError("DNLRX position_filter", "is empty", "give at least g_0")
        if self.deformation_filter.shape[0] == 0 or self.deformation_filter.shape[1] != self.thresholds.shape[0]:
            problem = f"has the shape {self.deformation_filter.shape} for {self.thresholds.shape[0]} thresholds"
            raise DnlrxError("DNLRX deformation_filter", problem, "give one row per delay with one number per threshold")
        if np.any(self.thresholds <= 0.0):
            raise DnlrxError("DNLRX thresholds", f"{self.thresholds.min():g} is not positive", "leave such an element out")
        if not (self.sample_time > 0.0 and math.isfinite(self.sample_time) and math.isfinite(self.offset)):
            raise DnlrxError("DNLRX", "sample_time isn't positive or offset isn't finite", "give finite numbers")

    @property
    def order(self) -> tuple[int, int, int]:
        """``(M, n_delta, n)``."""
        return self.thresholds.shape[0], self.deformation_filter.shape[0] - 1, self.position_filter.shape[0] - 1

    @property
    def first_predicted(self) -> int:
        """lambda, the first sample with all its past in the record when the record starts at sample 0."""
        return max(self.order[1:])

    @property
    def slopes(self) -> Array:
        """du(k)/dx(k) [F/x] with all springs sticking, then without one after the other in the order in which they slide."""
        by_threshold = np.argsort(self.thresholds, kind="stable")
        sticking = np.append(np.cumsum(self.deformation_filter[0][by_threshold][::-1])[::-1], 0.0)
        # Springs with the same threshold slide together: what lies between them isn't met.
        sorted_thresholds = self.thresholds[by_threshold]
        met = np.append(True, np.append(np.diff(sorted_thresholds) > 0.0, True)[: self.thresholds.shape[0]])
        return np.asarray(self.position_filter[0] + sticking[met])


def _reachable(deformation: Array, thresholds: Array) -> Array:
    """``deformation`` where a motion can lead there: springs differ by no more than their thresholds do."""
    by_threshold = np.argsort(thresholds, kind="stable")
    if deformation.shape != thresholds.shape:
        raise DnlrxError("DNLRX deformation", f"has the shape {deformation.shape}", f"give shape {thresholds.shape}")
    rise = np.diff(deformation[by_threshold], prepend=0.0)
    if np.any(np.abs(rise) > np.diff(thresholds[by_threshold], prepend=0.0) * (1.0 + 1e-9) + 1e-12 * np.max(thresholds)):
        problem = "holds what no motion leads to: two springs differ by more than their thresholds"
        raise DnlrxError("DNLRX deformation", problem, "take it from deformations() or a running predictor")
    return np.clip(deformation, -thresholds, thresholds)


class _Running:
    """What predictor and simulator share: a model and its past.

    Args:
        model: the DNLRX.
        position: where the body has been at rest before the first sample [x].
        deformation: of the springs before the first sample [x], shape ``(M,)``; None: none.

    Raises:
        DnlrxError: deformations that no motion leads to.

    Attributes:
        positions: the past, latest first, shape ``(max(n, 1),)``.
        deformations: the past, latest first, shape ``(max(n_delta, 1), M)``.
    """

    def __init__(self, model: DnlrxModel, position: float = 0.0, deformation: Array | None = None) -> None:
        n_springs, n_delta, n = model.order
        self.model = model
        self.positions = np.full(max(n, 1), float(position))
        self.deformations = np.zeros((max(n_delta, 1), n_springs))
        if deformation is not None:
            self.deformations[:] = _reachable(np.asarray(deformation, dtype=np.float64), model.thresholds)
        self._work = np.zeros(n_springs)

    def _values(self) -> tuple[Array, Array, Array, float]:
        model = self.model
        return model.thresholds, model.position_filter, model.deformation_filter, float(model.offset)


class DnlrxPredictor(_Running):
    """Force from motion, sample by sample or in blocks; the past is kept from call to call. Arguments as of the simulator."""

    def run(self, position: Array) -> Array:
        """Force [F] at every sample of ``position`` [x], both of shape ``(n_samples,)``."""
        effort = np.empty(position.shape[0])
        x = np.ascontiguousarray(position, dtype=np.float64)
        dnlrx_loops.predict(*self._values(), x, self.positions, self.deformations, self._work, effort)
        return effort

    def step(self, position: float) -> float:
        """Force [F] at the next sample."""
        return float(self.run(np.array([position]))[0])


class DnlrxSimulator(_Running):
    """Motion from force, sample by sample or in blocks; the past is kept from call to call.

    A DNLRX whose prediction is good may still be useless here: the filters of a fit need not be a stable recursion, see
    :func:`poles`.

    Args:
        model: the DNLRX.
        position: where the body has been at rest before the first sample [x].
        deformation: of the springs before the first sample [x], shape ``(M,)``; None: none.

    Raises:
        DnlrxError: the force doesn't determine the motion, or no motion leads to the deformations.
    """

    def __init__(self, model: DnlrxModel, position: float = 0.0, deformation: Array | None = None) -> None:
        super().__init__(model, position, deformation)
        lowest = float(model.slopes.min())
        if lowest <= 0.0:
            problem = (
                f"the force doesn't determine the motion: g_0 and the Theta_0 of the springs that stick add up to {lowest:g}"
            )
            raise DnlrxError("DNLRX", problem, "use it as a predictor only, or fit it with another order")

    def run(self, effort: Array) -> Array:
        """Position [x] at every sample of ``effort`` [F], both of shape ``(n_samples,)``."""
        position = np.empty(effort.shape[0])
        u = np.ascontiguousarray(effort, dtype=np.float64)
        dnlrx_loops.simulate(*self._values(), u, self.positions, self.deformations, self._work, position)
        return position

    def step(self, effort: float) -> float:
        """Position [x] at the next sample."""
        return float(self.run(np.array([effort]))[0])


def poles(model: DnlrxModel) -> tuple[Array, Array]:
    """Poles of the motion under a given force, while all springs slide and while all stick; stable inside the unit circle.

    Returns:
        Magnitudes, largest first, shapes ``(n,)`` and ``(max(n, n_delta),)``.
    """
    sticking = np.zeros(1 + max(model.order[1:]))
    sticking[: model.position_filter.shape[0]] += model.position_filter
    sticking[: model.deformation_filter.shape[0]] += model.deformation_filter.sum(axis=1)
    sliding = np.abs(np.roots(model.position_filter))
    return np.sort(sliding)[::-1], np.sort(np.abs(np.roots(sticking)))[::-1]


def step_at_slip(model: DnlrxModel) -> Array:
    """By how much the force rises, per velocity, when a spring begins to slide: T sum_j j Theta_ji [F s/x], shape ``(M,)``."""
    return np.asarray(model.sample_time * (np.arange(model.deformation_filter.shape[0]) @ model.deformation_filter))


def derivative_filter(derivative: int, order: int, sample_time: float) -> Array:
    """p_j or q_j of Eqs. 9 and 10, shape ``(order + 1,)``: exact for every polynomial of degree ``order``.

    Args:
        derivative: 1 for the velocity, 2 for the acceleration.
        order: n_v or n_a, not below ``derivative``.
        sample_time: [s].

    Raises:
        DnlrxError: the order is below the derivative.
    """
    if order < derivative:
        raise DnlrxError("DNLRX", f"order {order} can't give derivative {derivative}", f"use an order of at least {derivative}")
    powers = np.vander(-np.arange(order + 1, dtype=np.float64), increasing=True).T  # of -j, one row for each power
    wanted = np.zeros(order + 1)
    wanted[derivative] = math.factorial(derivative)
    return np.asarray(np.linalg.solve(powers, wanted)) / sample_time**derivative


def from_mechanics(
    mass: float,
    damping: float,
    stiffness: float,
    springs: Sequence[float],
    thresholds: Sequence[float],
    sample_time: float,
    *,
    order: int = 2,
    spring_damping: Sequence[float] | None = None,
    offset: float = 0.0,
) -> DnlrxModel:
    """The DNLRX of a mass with damper, spring and Maxwell-slip friction (Eqs. 8 to 14).

    Args:
        mass: m [F s^2/x].
        damping: d [F s/x].
        stiffness: c [F/x].
        springs: k_i of the Maxwell-slip elements [F/x].
        thresholds: Delta_i [x].
        sample_time: T [s].
        order: n_a = n_v, 2 or more; up to 7 the motion of a free mass under a given force is stable.
        spring_damping: sigma_i of Eq. 5, in parallel to the springs [F s/x]; None: none.
        offset: b [F].

    Raises:
        DnlrxError: lists of different lengths, or values that make no DNLRX.
    """
    g = mass * derivative_filter(2, order, sample_time) + damping * derivative_filter(1, order, sample_time)
    g[0] += stiffness
    theta = np.array([springs], dtype=np.float64)
    if spring_damping is not None:
        rate = np.array([spring_damping], dtype=np.float64) / sample_time
        if rate.shape != theta.shape:
            raise DnlrxError("DNLRX spring_damping", "has another length than springs", "give one number for each spring")
        theta = np.vstack([theta + rate, -rate])
    return DnlrxModel(sample_time, np.array(thresholds, dtype=np.float64), g, theta, offset)
