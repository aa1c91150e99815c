"""Plants with friction as quasi-LPV systems: linear in the state, with matrices that depend on what moves.

Equation: x' = A(p) x + B(p) u with the state x = (xi, e, v, ...), e = q - r the error of a position that is to stay at r, and
xi' = e. Friction is the element a_22(p) = -F(v)/(v m) of Szell's Eq. 18. Its hysteresis (Eq. 23) is a parameter g from g_min
to 1:

    a_22(v, g) = a_0 + g (a_top(v) - a_0),

a_top the branch with more damping, a_0 less damping than either has anywhere. Each branch is such a g at each velocity, g_min
is the least of them. So two weights over the velocity serve both branches; from the branches themselves it would take three.

- Mass on friction: v' = a_22 v + u/m, the command u a force.
- Pneumatic cylinder: v' = a_22 v + f/m with the force of the air f = A (p_a - p_b), of which Eqs. 13, 14 make
  f' = -k(x, p) v + b(x, p) u, k = kappa A^2 p (1/V_a + 1/V_b), for both chambers about the mean pressure p;
  b u is the change by both mass flows, b the mean over u > 0 and u < 0, without the valve's overlap.

A parameter is scheduled when the gains may follow it at run time. The others are only known to lie in their range: speeding up
isn't told from slowing down by a noisy velocity, and the mean pressure isn't measured. One set of gains serves all their
values.

A constant load shifts the equilibrium in xi and f. Gains of these states that changed with p would turn the shift into a
disturbance, so they are the same at every vertex (``common``).
Source: Szell, Eqs. 12-23.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ...errors import InputError
from ...friction.tensor_product import TensorProductFriction
from ...model import Model
from ...plants.pneumatic import flow
from ...record import Array, Units

__all__ = ["QuasiLpvPlant", "Scheduling", "TensorProductControlError", "mass_on_friction", "pneumatic_cylinder"]

_POINTS = 30  # velocities in each direction, at equal ratios: 1/v between two of them is a line to 0.4 % over two decades
_POSITIONS = 9
_LESS = 0.9  # a_0 over the least damping: numerical, so that the share g is finite where that is


class TensorProductControlError(InputError):
    """A tensor-product controller that can't be designed, read or used."""


@dataclass(frozen=True, eq=False)
class Scheduling:
    """One parameter of a quasi-LPV plant.

    Attributes:
        name: ``velocity``, ``position``, ``hysteresis`` or ``pressure``.
        grid: where the plant is sampled, strictly increasing, ``(n,)``.
        scheduled: whether the gains follow it at run time.
    """

    name: str
    grid: Array
    scheduled: bool


@dataclass(frozen=True, eq=False)
class QuasiLpvPlant:
    """What a tensor-product controller is designed for.

    Attributes:
        states: their names, the integral of the error first.
        domain: largest magnitude of each state, which scales it too, ``(n_states,)``.
        parameters: of the matrices.
        matrix: A and B beside each other, ``(n_states, n_states + 1)``, at a point ``(n_parameters,)``.
        common: numbers of the states whose gain is the same at every vertex.
        input_unit: dimension of the command, ``F`` or ``1``.
        units: of position and force.
    """

    states: tuple[str, ...]
    domain: Array
    parameters: tuple[Scheduling, ...]
    matrix: Callable[[Array], Array] = field(repr=False)
    common: tuple[int, ...]
    input_unit: str = "F"
    units: Units = field(default_factory=Units)


def _velocities(slowest: float, fastest: float) -> Array:
    if not 0.0 < slowest < fastest < np.inf:
        problem = f"velocities from {slowest:g} to {fastest:g}"
        raise TensorProductControlError("quasi-LPV plant", problem, "give 0 < slowest < fastest")
    speed = np.geomspace(slowest, fastest, _POINTS)
    return np.concatenate([-speed[::-1], speed])


def _friction_part(
    friction: TensorProductFriction, slowest: float, fastest: float
) -> tuple[tuple[Scheduling, ...], Callable[[Array], float]]:
    """The parameters of friction, and a_22 [1/s] at a point of all, of which they are the first."""
    velocity = Scheduling("velocity", _velocities(slowest, fastest), True)
    branches = np.stack([friction.damping(velocity.grid, up) for up in (True, False)])
    top, least = np.min(branches, axis=0), float(np.max(branches))
    if not least < 0.0:
        problem = f"friction drives the motion (a_22 up to {least:.3g} 1/s)"
        raise TensorProductControlError("quasi-LPV plant", problem, "give velocities at which friction opposes it")
    base = _LESS * least
    share = float(np.min((branches - base) / (top - base)))

    def damping(p: Array) -> float:
        most = float(np.interp(p[0], velocity.grid, top))
        return most if share == 1.0 else base + float(p[1]) * (most - base)

    return (velocity,) if share == 1.0 else (velocity, Scheduling("hysteresis", np.array([share, 1.0]), False)), damping


def mass_on_friction(
    friction: TensorProductFriction,
    *,
    slowest: float,
    fastest: float,
    error: float,
    integral: float | None = None,
    units: Units | None = None,
) -> QuasiLpvPlant:
    """A mass that a force moves against friction; states xi, e, v.

    Args:
        friction: from a law, a model or data; its mass is what moves.
        slowest: velocity below which friction counts as viscous [x/s]; what the measured velocity resolves.
        fastest: largest velocity [x/s].
        error: largest error of the position [x].
        integral: largest integral of the error [x s]; None: the error over one second.
        units: of position and force; m and N unless given.
    """
    parameters, damping = _friction_part(friction, slowest, fastest)
    mass = friction.mass

    def matrix(p: Array) -> Array:
        return np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, damping(p), 1.0 / mass]])

    domain = np.array([error if integral is None else integral, error, fastest])
    names = ("integral", "error", "velocity")
    return QuasiLpvPlant(names, domain, parameters, matrix, (0,), "F", Units() if units is None else units)


def pneumatic_cylinder(
    model: Model,
    friction: TensorProductFriction,
    *,
    slowest: float,
    fastest: float,
    error: float,
    force: float,
    positions: tuple[float, float],
    pressures: tuple[float, float],
    integral: float | None = None,
) -> QuasiLpvPlant:
    """Szell's cylinder; states xi, e, v and the force of the air f, which two pressure sensors measure.

    Args:
        model: its plant is ``pneumatic``; its terms don't count.
        friction: of the piston.
        slowest: see :func:`mass_on_friction`.
        fastest: likewise.
        error: likewise.
        force: largest magnitude of f [F].
        positions: between which the gains follow the position [x].
        pressures: between which the mean pressure of the chambers lies [F/x^2]; equal: it is that one.
        integral: see :func:`mass_on_friction`.

    Raises:
        TensorProductControlError: the plant is another, or a range can't be used.
    """
    if model.plant.id != "pneumatic":
        raise TensorProductControlError("quasi-LPV plant", f"the plant is {model.plant.id}", "give a model of a pneumatic one")
    values = np.array(model.plant_values)
    if not 0.0 <= positions[0] < positions[1] <= values[2]:
        problem = f"positions from {positions[0]:g} to {positions[1]:g}"
        raise TensorProductControlError("quasi-LPV plant", problem, f"give a range within the stroke, 0 to {values[2]:g}")
    if not values[11] < pressures[0] <= pressures[1] < values[10]:
        problem = f"mean pressures from {pressures[0]:g} to {pressures[1]:g}"
        raise TensorProductControlError("quasi-LPV plant", problem, "give a range between those of exhaust and supply")
    frictional, damping = _friction_part(friction, slowest, fastest)
    parameters = (*frictional, Scheduling("position", np.linspace(*positions, _POSITIONS), True))
    if pressures[0] < pressures[1]:
        parameters += (Scheduling("pressure", np.linspace(*pressures, _POSITIONS), False),)
    at_position = len(frictional)
    mass, area, stroke, dead, ratio = values[:5]

    def matrix(p: Array) -> Array:
        pressure = p[at_position + 1] if len(p) > at_position + 1 else pressures[0]
        inverse = 1.0 / (dead + area * p[at_position]) + 1.0 / (dead + area * (stroke - p[at_position]))
        both = flow(values, values[7], values[10], pressure) + flow(values, values[7], pressure, values[11])
        result = np.zeros((4, 5))
        result[0, 1] = result[1, 2] = 1.0
        result[2, 2], result[2, 3] = damping(p), 1.0 / mass
        result[3, 2], result[3, 4] = -ratio * area**2 * pressure * inverse, 0.5 * ratio * area * both * inverse
        return result

    domain = np.array([error if integral is None else integral, error, fastest, force])
    return QuasiLpvPlant(("integral", "error", "velocity", "force"), domain, parameters, matrix, (0, 3), "1", model.units)
