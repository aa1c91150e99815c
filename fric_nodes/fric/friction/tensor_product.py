"""Friction as a tensor-product model: a damping that varies with velocity, between two constant ones.

Equation: a_22(v) = -F(v)/(v m) = w_1(v) a_1 + w_2(v) a_2, the element of the system matrix that friction makes (Szell Eq. 18),
once for speeding up and once for slowing down (Eq. 23). The vertices a_1 and a_2 are the largest and the least damping on the
grid: a_1 is about -F_S/(v_1 m) speeding up and -F_C/(v_1 m) slowing down, v_1 the innermost grid velocity (Eqs. 24-27).

- Indirect method, Model C (:func:`from_law`, :func:`from_model`): from a law.
- Direct method, Model D (:func:`from_data`): from measured velocity, acceleration and friction, averaged over intervals of
  speed, which keeps 1/v of a noisy v out of the average. No law is fitted.

Between grid points v w(v) is interpolated linearly, not w(v): a_22 goes as 1/v, so this makes friction itself a straight
line from node to node; Coulomb and viscous friction come out exactly between them too. The weights still sum to one and don't
change sign.

Inside the innermost grid velocity the polytope ends. There the weights stay what they are, which makes friction a stiff viscous
force that no body sticks on. That is what a controller is designed with; to simulate, :meth:`TensorProductFriction.force` keeps
the innermost friction force, and :meth:`TensorProductFriction.simulate` sticks exactly.

The second vertices of both branches are equal, as printed, because each polytope is made to hold the least damping of both
(``shared``); the system then has three vertices instead of four.
Source: Szell, Secs. 2 and 5.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..model import Model
from ..record import Array, Mask
from ..simulation import Motion, predict_force
from .tensor_product_transformation import TensorProduct, TensorProductError, transform
from .two_branches import Tables, simulate_mass

__all__ = ["TensorProductFriction", "from_data", "from_law", "from_model", "from_points", "velocity_grid"]

Law = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class TensorProductFriction:
    """Friction with hysteresis over the sign of the acceleration, in polytopic form.

    Attributes:
        mass: that a_22 refers to [F s^2/x].
        speeding_up: a_22(v) as a matrix of one element; largest damping first.
        slowing_down: the same for the other branch.
    """

    mass: float
    speeding_up: TensorProduct
    slowing_down: TensorProduct

    def weights(self, velocity: ArrayLike, speeding_up: bool = True) -> Array:
        """Weights of the vertices, ``(n, 2)``, at the velocities [x/s], ``(n,)``."""
        branch = self.speeding_up if speeding_up else self.slowing_down
        grid, weights = branch.grids[0], branch.weights[0]
        v = np.atleast_1d(np.asarray(velocity, dtype=np.float64))
        result = np.empty((v.shape[0], weights.shape[1]))
        for side in (1.0, -1.0):
            own, at = _side(grid, side), v * side >= 0.0
            speed, held = side * grid[own], weights[own]
            if side < 0.0:
                speed, held = speed[::-1], held[::-1]
            x = np.clip(v[at] * side, speed[0], speed[-1])
            result[at] = np.stack([np.interp(x, speed, column * speed) / x for column in held.T], axis=1)
        return result

    def damping(self, velocity: ArrayLike, speeding_up: bool = True) -> Array:
        """a_22 [1/s] at the velocities [x/s], ``(n,)``: within the polytope everywhere."""
        branch = self.speeding_up if speeding_up else self.slowing_down
        return np.asarray(self.weights(velocity, speeding_up) @ branch.vertices[:, 0, 0])

    def force(self, velocity: ArrayLike, speeding_up: bool | Mask = True) -> Array:
        """Friction force [F] at the velocities [x/s], ``(n,)``, positive against positive motion; 0 at rest.

        Args:
            velocity: ``(n,)``.
            speeding_up: for all, or for each, ``(n,)``.
        """
        v = np.atleast_1d(np.asarray(velocity, dtype=np.float64))
        result = np.empty(v.shape[0])
        up = np.broadcast_to(np.asarray(speeding_up, dtype=np.bool_), v.shape)
        for branch, chosen in ((True, up), (False, ~up)):
            grid = (self.speeding_up if branch else self.slowing_down).grids[0]
            least = np.where(v[chosen] > 0.0, _innermost(grid, 1.0), _innermost(grid, -1.0))
            # Not inside the innermost grid velocity, where the polytope ends.
            at = np.sign(v[chosen]) * np.maximum(np.abs(v[chosen]), least)
            result[chosen] = -self.mass * self.damping(at, branch) * at
        return result

    def break_away(self, direction: float = 1.0) -> float:
        """Force [F] beyond which a body at rest begins to move towards ``direction``."""
        return float(abs(self.force(direction * 1e-300)[0]))

    def tables(self) -> Tables:
        """The same as tables, for the compiled simulation."""
        speeds, forces = [], []
        for side in (1.0, -1.0):
            for branch in (self.speeding_up, self.slowing_down):
                v = branch.grids[0][_side(branch.grids[0], side)]
                damping = branch.at_grid()[_side(branch.grids[0], side), 0, 0]
                order = np.argsort(np.abs(v))
                speeds.append(np.abs(v)[order])
                forces.append((-self.mass * damping * np.abs(v))[order])
        first = np.cumsum([0, *(len(each) for each in speeds)])
        return Tables(np.concatenate(speeds), np.concatenate(forces), first)

    def simulate(
        self,
        effort: Array,
        sample_time: float,
        *,
        position: float = 0.0,
        velocity: float = 0.0,
        hold: str = "following",
        n_substeps: int = 1,
    ) -> Motion:
        """Free run of the mass under the forces ``effort`` [F].

        Sticking is exact; arguments as of :func:`fric.simulation.simulate`.
        """
        return simulate_mass(
            self.tables(), self.mass, effort, sample_time,
            position=position, velocity=velocity, hold=hold, n_substeps=n_substeps,
        )  # fmt: skip


def _side(grid: Array, side: float) -> Mask:
    return np.asarray(grid * side > 0.0)


def _innermost(grid: Array, side: float) -> float:
    return float(np.min(np.abs(grid[_side(grid, side)])))


def velocity_grid(largest: float, size: int) -> Array:
    """``size`` velocities from ``-largest`` to ``largest`` [x/s] at equal distances; even, so that 0 isn't among them.

    Raises:
        TensorProductError: ``size`` is odd or below 4.
    """
    if size < 4 or size % 2:
        raise TensorProductError("velocity grid", f"{size} points", "take an even number of at least 4: F/v has no value at 0")
    return np.linspace(-largest, largest, size)


def from_law(
    speeding_up: Law, slowing_down: Law, mass: float, velocity: Array, *, shared: bool = True
) -> TensorProductFriction:
    """Model C: the tensor-product form of a law, by the indirect method.

    Args:
        speeding_up: friction force [F], ``(n,)``, at the velocities ``(n,)``, while speeding up.
        slowing_down: the same while slowing down.
        mass: [F s^2/x].
        velocity: grid [x/s], increasing, on both sides of 0, which isn't part of it.
        shared: let both branches have the same second vertex.

    Raises:
        TensorProductError: the grid can't be used, or the law gives something not finite.
    """
    return _built(mass, (velocity, speeding_up(velocity)), (velocity, slowing_down(velocity)), shared)


def from_model(model: Model, velocity: Array, *, shared: bool = True) -> TensorProductFriction:
    """Model C of all terms of ``model`` at nominal load; for plants whose mass is what the contact feels.

    Raises:
        TensorProductError: the grid can't be used, or the model has slip dynamics, whose friction isn't a curve.
    """
    if model.has_slip_dynamics:
        raise TensorProductError("tensor product", "the model has slip dynamics", "take that term out")
    mass = model.plant.inertia(*model.plant_values)
    bare = model.with_terms(())

    def law(sign: float) -> Law:
        def force(v: Array) -> Array:
            none, change = np.zeros_like(v), sign * np.sign(v)
            return predict_force(model, none, none, v, change, 1e-3) - predict_force(bare, none, none, v, change, 1e-3)

        return force

    return from_law(law(1.0), law(-1.0), mass, velocity, shared=shared)


def from_data(
    velocity: Array,
    acceleration: Array,
    friction: Array,
    mass: float,
    *,
    largest: float,
    size: int = 1000,
    least_speed: float = 0.0,
    least_acceleration: float = 0.0,
    least_count: int = 1,
    symmetric: bool = True,
    shared: bool = True,
) -> TensorProductFriction:
    """Model D: the tensor-product form of measured friction, by the direct method.

    Samples are sorted into intervals of speed, speeding up (v dv/dt > 0) and slowing down apart, and each interval's mean speed
    and mean friction make one grid point. An interval without samples is no grid point.

    Args:
        velocity: measured [x/s], ``(n_samples,)``.
        acceleration: its sign decides on the branch, ``(n_samples,)``.
        friction: measured force against positive motion [F], ``(n_samples,)``.
        mass: that a_22 is to refer to [F s^2/x].
        largest: end of the grid [x/s]; samples beyond it are left out.
        size: intervals between ``-largest`` and ``largest``.
        least_speed: samples below it are left out: where the noise of v is as large as v there is no F/v.
        least_acceleration: samples with less are left out: within the noise of the acceleration there is no telling the branch.
        least_count: intervals with fewer samples are left out.
        symmetric: friction is taken to be the same in both directions, and samples of both are put together.
        shared: let both branches have the same second vertex.

    Raises:
        TensorProductError: a branch has fewer than two grid points in a direction.
    """
    edges = np.linspace(0.0, largest, size // 2 + 1)
    branches = []
    for name, up in (("speeding up", True), ("slowing down", False)):
        halves = []
        for side in (1.0, -1.0):
            used = (velocity * acceleration > 0.0) if up else (velocity * acceleration < 0.0)
            used &= (np.abs(acceleration) >= least_acceleration) & (np.abs(velocity) >= least_speed)
            used &= np.abs(velocity) <= largest
            if not symmetric:
                used &= velocity * side > 0.0
            speed, force = np.abs(velocity[used]), np.sign(velocity[used]) * friction[used]
            points = _interval_means(speed, force, edges, least_count)
            if points.shape[1] < 2:
                problem = f"{points.shape[1]} grid point(s) {name} towards {side:+.0f}"
                raise TensorProductError("tensor product", problem, "record more, or take fewer and larger intervals")
            halves.append(points)
        v = np.concatenate([-halves[1][0, ::-1], halves[0][0]])
        branches.append((v, np.concatenate([-halves[1][1, ::-1], halves[0][1]])))
    return _built(mass, branches[0], branches[1], shared)


def from_points(
    speeding_up: tuple[Array, Array], slowing_down: tuple[Array, Array], mass: float, *, shared: bool = True
) -> TensorProductFriction:
    """The tensor-product form of friction that is known at some velocities.

    Args:
        speeding_up: velocities [x/s], increasing, on both sides of 0, and the friction force [F] there, each ``(n,)``.
        slowing_down: the same of the other branch.
        mass: that a_22 is to refer to [F s^2/x].
        shared: let both branches have the same second vertex.

    Raises:
        TensorProductError: the velocities can't be a grid.
    """
    return _built(mass, speeding_up, slowing_down, shared)


def _interval_means(speed: Array, force: Array, edges: Array, least_count: int) -> Array:
    """Mean speed and mean force of each interval that has samples, ``(2, n_points)``."""
    number = np.clip(np.searchsorted(edges, speed, side="right") - 1, 0, edges.shape[0] - 2)
    count = np.bincount(number, minlength=edges.shape[0] - 1)
    held = count >= max(least_count, 1)
    sums = [np.bincount(number, weights=values, minlength=edges.shape[0] - 1)[held] for values in (speed, force)]
    return np.asarray(np.stack(sums) / count[held])


def _built(mass: float, up: tuple[Array, Array], down: tuple[Array, Array], shared: bool) -> TensorProductFriction:
    samples = []
    for v, force in (up, down):
        if not (np.any(v > 0.0) and np.any(v < 0.0)) or np.any(v == 0.0):
            raise TensorProductError("tensor product", "velocity grid", "take velocities on both sides of 0, and not 0 itself")
        samples.append((-np.asarray(force) / (v * mass))[:, None, None])
    least = max(float(np.max(each)) for each in samples)
    enclosed = np.array([[[least]]]) if shared else None
    return TensorProductFriction(
        mass, *(_ordered(transform(each, [v], enclosed=enclosed)) for each, (v, _) in zip(samples, (up, down), strict=True))
    )


def _ordered(model: TensorProduct) -> TensorProduct:
    """The same with the largest damping first."""
    order = np.argsort(model.vertices[:, 0, 0])
    return replace(model, weights=(model.weights[0][:, order],), vertices=model.vertices[order])
