"""A tensor-product controller from an identified model: the fastest decay rate whose gains keep margins in the sampled loop.

The design of :mod:`.design` holds in continuous time and knows no delay. With y and its filtered difference each vertex's gains
(K_xi, K_e, K_v) are those of a PID controller, k_i = -K_xi, k_p = -K_e, k_d = -K_v, so that the margins of
:mod:`fric.control.loop` hold for it in the loop as it is sampled and delayed. The decay rate falls from an eighth of the
crossover of the tuned PID, and the domains of error and velocity grow, which makes the gains smaller, until the margins of
:class:`fric.control.autotune.Required` are kept on the friction that the vertex stands for. The tolerance of the integral
grows while the axis hunts in simulation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ...friction.tensor_product import from_law, velocity_grid
from ...model import Model
from ...record import Array
from ..autotune import Required, Timing, resting_width, stuck_stiffness
from ..controller import Controller
from ..feedbacks.tensor_product import designed_by
from ..feedforward import refuse_impossible
from ..loop import LinearPlant, margins, pid_polynomials
from ..tuning import tune
from .design import Requirements, TensorProductController, design
from .polytope import Polytope, polytope
from .quasi_lpv import TensorProductControlError, mass_on_friction

__all__ = ["TunedTensorProduct", "tuned_tensor_product"]

_SLOWER = 2.0  # numerical: factor between two decay rates
_TRIES = 6
_WIDER = (1.0, 2.0, 4.0, 8.0, 16.0)  # numerical: domains of the error over the first
_FASTER = (2.0, 8.0, 32.0)  # numerical: domains of the velocity over the fastest motion's
_POINTS = 200  # numerical: of the curve of friction
_FIRST = 0.125  # numerical: of the crossover of the PID, where the search begins
_RATIO = 30.0  # physical: largest speed over the one below which friction counts as viscous
_CALMER = 3  # numerical: times that the tolerance grows, by four each
_CYCLE = 3.0  # physical: encoder steps
_SIMULATED = 8  # numerical: designs that are simulated before the least hunting is given, with a note


@dataclass(frozen=True, eq=False)
class TunedTensorProduct:
    """A design and what it keeps.

    Attributes:
        controller: kind of controller that holds the design.
        values: its parameters by name.
        design: with its proof.
        width: of the motion that goes on at rest in simulation [x].
        notes: what a user should know.
    """

    controller: Controller
    values: dict[str, float]
    design: TensorProductController
    width: float
    notes: tuple[str, ...] = ()


def _plant(model: Model, fastest: float, error: float) -> Polytope:
    held = {parameter.name: parameter.value for parameter in model.parameters()}
    coulomb, viscous = held.get("coulomb.force", 0.0), max(held.get("viscous.coefficient", 0.0), 0.0)

    def law(v: Array) -> Array:
        return np.asarray(coulomb * np.sign(v) + viscous * v)

    friction = from_law(law, law, model.total_inertia, velocity_grid(fastest, _POINTS))
    return polytope(mass_on_friction(friction, slowest=fastest / _RATIO, fastest=fastest, error=error, units=model.units))


def _keeps(
    made: TensorProductController, model: Model, timing: Timing, required: Required, filter_time: float, stuck: float
) -> bool:
    """Whether each vertex's gains keep the margins on its friction, and are stable on the spring of pre-sliding."""
    mass = model.total_inertia
    for gains, vertex in zip(made.physical_gains, made.a, strict=True):
        form = pid_polynomials(-gains[1], -gains[0], -gains[2], filter_time, timing.period)
        damping = [max(-mass * float(variant[2, 2]), 0.0) for variant in vertex]
        for each in (min(damping), max(damping)):
            plant = LinearPlant(mass, each, timing.period, timing.delay)
            if not required.kept(margins(plant, form), timing.period):
                return False
        free = LinearPlant(mass, min(damping), timing.period, timing.delay)
        if stuck > 0.0 and not margins(replace(free, stiffness=stuck), form).stable:
            return False
    return True


def tuned_tensor_product(
    model: Model, timing: Timing, *, fastest: float, sticking: Model | None = None, required: Required | None = None
) -> TunedTensorProduct:
    """The tensor-product controller for ``model``.

    Args:
        model: identified; its mass, Coulomb and viscous friction count.
        timing: of the loop, with a finite force limit.
        fastest: speed of the motions wanted [x/s].
        sticking: the same axis with its pre-sliding, where that is identified: the loop has to be stable on its springs, and to
            rest in its simulation.
        required: margins.

    Raises:
        TensorProductControlError: no design keeps what is required.
    """
    refuse_impossible(model)
    required = Required() if required is None else required
    if not math.isfinite(timing.force_limit):
        raise TensorProductControlError("tensor-product controller", "the force has no limit", "give the timing one")
    held = {parameter.name: parameter.value for parameter in model.parameters()}
    filter_time = timing.period if timing.filter_time is None else timing.filter_time
    viscous = max(held.get("viscous.coefficient", 0.0), 0.0)
    pid, margin = tune(model.total_inertia, viscous, timing.period, delay=timing.delay, filter_time=filter_time)
    first = 2.0 * math.pi * margin.crossover * _FIRST
    # The largest error of the domain bounds the gains: the first is that at which a PID's proportional part reaches the limit.
    error = timing.force_limit / pid.proportional
    plants = [_plant(model, faster * fastest, wider * error) for faster in _FASTER for wider in _WIDER]
    stuck = 0.0 if sticking is None else stuck_stiffness(sticking)
    refused, simulated, hunting = "", 0, None
    for decay in (first / _SLOWER**k for k in range(_TRIES)):
        for plant in plants:
            try:
                made = design(plant, Requirements(decay=decay, limit=timing.force_limit))
            except TensorProductControlError as why:
                refused = why.problem
                continue
            if _keeps(made, model, timing, required, filter_time, stuck):
                found = _calmed(model if sticking is None else sticking, timing, made, filter_time)
                if not found.notes:
                    return found
                hunting = found if hunting is None or found.width < hunting.width else hunting
                simulated += 1
                if simulated == _SIMULATED:
                    return hunting
            refused = f"the gains for a decay rate of {decay:.3g} 1/s don't keep the margins in the sampled loop"
    raise TensorProductControlError(
        "tensor-product controller", refused, "shorten period or delay, or identify mass and damping"
    )


def _calmed(model: Model, timing: Timing, made: TensorProductController, filter_time: float) -> TunedTensorProduct:
    """The controller with a tolerance at which it rests in simulation."""
    kind = designed_by(made)
    values = {"filter_time": filter_time, "tolerance": 2.0 * timing.resolution, "velocity_weight": 1.0}
    found = TunedTensorProduct(kind, values, made, math.nan)
    for number in range(_CALMER + 1):
        width = resting_width(model, kind, found.values, timing)
        cycles = width > _CYCLE * timing.resolution and width > 0.0
        notes = (f"hunts at rest by {width:.3g} in simulation",) if cycles else ()
        found = replace(found, width=width, notes=notes)
        if not cycles or number == _CALMER:
            break
        found = replace(found, values={**found.values, "tolerance": 4.0 * found.values["tolerance"]})
    return found
