"""Tensor-product control of Szell's cylinder against a PID controller, and random designs against their own claims.

Stick-slip: the piston of ``config/pneumatic_model.yaml`` is to go to a position and stay there, under a constant load. Start,
target, load and the pressures at the start are drawn at random. Both controllers move the valve once a millisecond and read
an encoder of 1 um; the tensor-product controller reads the two pressure sensors too. A controller hunts when the piston still
moves in the last second of five. The PID controller's gains are those of a loop without friction: proportional at 0.4 of the
gain at which that loop oscillates, integral over 0.25 s, derivative over 12.5 ms. So that the comparison isn't one of
integrals that rest, a PID whose integral rests within the same tolerance stands beside it; and so that it isn't one of
sensors either, the same state feedback without scheduling.

Random designs: masses on friction with a Stribeck curve and hysteresis, drawn over two decades. Of each that is accepted the
vertices' eigenvalues are calculated anew by numpy from the saved file's text, and the plant with its own friction law, not
the polytope, is integrated from the edge of the guaranteed ellipsoid: V has to fall at least as fast as designed.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.integrate import solve_ivp

from ...control.controller import Setpoint
from ...control.feedbacks.pid import Pid, PidGains
from ...control.tensor_product.design import Requirements, TensorProductController, design
from ...control.tensor_product.design_file import controller_from_text, controller_to_text
from ...control.tensor_product.law import TensorProductLaw
from ...control.tensor_product.polytope import Polytope, polytope
from ...control.tensor_product.quasi_lpv import QuasiLpvPlant, TensorProductControlError, mass_on_friction, pneumatic_cylinder
from ...figure import Figure
from ...friction.tensor_product import from_law, from_model, velocity_grid
from ...model import Model, term
from ...model_file import read_model
from ...record import Array
from ...shared_files import config_file
from ...simulation import Simulator
from ..benchmark import Benchmark

__all__ = ["BENCHMARK", "cylinder_design", "decay_found", "design_time", "positioned", "random_design", "random_plant"]

TOLERANCE = 5e-5  # [m], of positioning: a physical scale, 0.05 % of the stroke
PERIOD, ENCODER, DURATION = 1e-3, 1e-6, 5.0
N_STARTS, N_DESIGNS = 1000, 1170  # of which a thousand designs are accepted
_PID = PidGains(proportional=40.0, integral=160.0, derivative=0.5, filter_time=5e-3)

Valve = Callable[[float, float, float], float]
"""Opening from the position wanted, the position read [m] and the force of the air [N]."""


@lru_cache(maxsize=1)
def _cylinder() -> Model:
    return read_model(config_file("pneumatic_model.yaml"))


def _plant(model: Model, pressures: tuple[float, float]) -> QuasiLpvPlant:
    return pneumatic_cylinder(
        model, from_model(model, velocity_grid(0.5, 1000)),
        slowest=5e-3, fastest=0.5, error=0.02, force=60.0, positions=(0.02, 0.08), pressures=pressures,
    )  # fmt: skip


@lru_cache(maxsize=1)
def cylinder_design() -> TensorProductController:
    """For the cylinder, over mean pressures from 2.5 to 4.5 bar."""
    return design(polytope(_plant(_cylinder(), (2.5e5, 4.5e5))), Requirements(decay=2.0, limit=1.0))


def _valve(controller: TensorProductController, tolerance: float) -> Valve:
    law = TensorProductLaw(controller, filter_time=2e-3, tolerance=tolerance)
    return lambda wanted, position, force: law.step(Setpoint(wanted), position, PERIOD, force)


def tensor_product(tolerance: float = TOLERANCE) -> Valve:
    """The tensor-product controller, new."""
    return _valve(cylinder_design(), tolerance)


def unscheduled(tolerance: float = TOLERANCE) -> Valve:
    """The same with the mean of its gains at every vertex, new."""
    made = cylinder_design()
    return _valve(replace(made, gains=np.tile(np.mean(made.gains, axis=0), (made.gains.shape[0], 1))), tolerance)


def pid(tolerance: float = 0.0) -> Valve:
    """The PID controller, new; its integral rests within ``tolerance``."""
    law = Pid(_PID, limit=1.0)
    resting = replace(_PID, integral=0.0)

    def valve(wanted: float, position: float, force: float) -> float:
        law.set_gains(resting if abs(position - wanted) <= tolerance else _PID)
        return law.step(wanted, position, PERIOD)

    return valve


def positioned(valve: Valve, seed: int) -> tuple[float, float]:
    """Range of the piston's position in the last second, and its error at the end [m], of the start and load ``seed``."""
    random = np.random.default_rng(seed)
    load, pressure = random.uniform(-15.0, 15.0), random.uniform(3e5, 4e5)
    start, target = random.uniform(0.02, 0.08), random.uniform(0.025, 0.075)
    model = _cylinder()
    simulator = Simulator(model.with_terms((*model.terms, term("bias", force=load))), start)
    simulator.states[2:] = pressure
    area = model.value("area")
    n = round(DURATION / PERIOD)
    last = np.empty(round(1.0 / PERIOD))
    for k in range(n):
        read = ENCODER * round(simulator.position / ENCODER)
        opening = valve(target, read, area * (simulator.states[2] - simulator.states[3]))
        simulator.run(np.array([opening]), PERIOD)
        if k >= n - last.shape[0]:
            last[k - n] = simulator.position
    return float(np.ptp(last)), float(abs(last[-1] - target))


def random_plant(seed: int) -> tuple[Polytope, Requirements]:
    """A mass on friction, and what is asked of its loop."""
    random = np.random.default_rng(seed)
    mass, coulomb = 10.0 ** random.uniform(-1.0, 1.0), 10.0 ** random.uniform(0.0, 2.0)
    surplus, knee = coulomb * random.uniform(0.0, 1.0), 10.0 ** random.uniform(-2.5, -1.0)
    viscous = 10.0 ** random.uniform(0.0, 2.0)

    def law(share: float) -> Callable[[Array], Array]:
        return lambda v: np.sign(v) * (coulomb + share * surplus / (1.0 + (v / knee) ** 2)) + viscous * v

    friction = from_law(law(1.0), law(random.uniform(0.0, 1.0)), mass, velocity_grid(0.5, 1000))
    plant = mass_on_friction(friction, slowest=10.0 ** random.uniform(-2.7, -2.0), fastest=0.5, error=0.01)
    limit = (coulomb + surplus) * random.uniform(3.0, 30.0)
    return polytope(plant), Requirements(decay=10.0 ** random.uniform(-0.3, 2.0), limit=limit)


def random_design(seed: int) -> tuple[Polytope, TensorProductController] | None:
    """The design for :func:`random_plant`, or None where it is refused."""
    held, requirements = random_plant(seed)
    try:
        return held, design(held, requirements)
    except TensorProductControlError:
        return None


def eigenvalues_hold(controller: TensorProductController) -> bool:
    """Whether every vertex with its own gain decays as designed, by numpy and from the text of the file."""
    saved = controller_from_text(controller_to_text(controller))
    return bool(np.max(saved.eigenvalues().real) < -controller.decay)


def decay_found(held: Polytope, controller: TensorProductController, seed: int) -> float:
    """Smallest decay rate [1/s] of sqrt(V) along a motion of the plant from the edge of the ellipsoid, over three decay times.

    The plant has its own friction law, in which the hysteresis is at one of its ends, drawn at random for the whole motion.
    """
    random = np.random.default_rng(seed)
    law = TensorProductLaw(controller)
    root = np.linalg.inv(np.linalg.cholesky(controller.p).T)
    direction = random.standard_normal(len(controller.states))
    start = controller.domain * (root @ (direction / np.linalg.norm(direction)))
    others = [random.choice(each.grid[[0, -1]]) for each in held.plant.parameters[1:]]

    def rate(t: float, x: Array) -> Array:
        ab = held.plant.matrix(np.array([x[2], *others]))
        u = float(np.dot(law.gains(float(x[2]), 0.0), x))
        return np.asarray(ab[:, :-1] @ x + ab[:, -1] * u)

    times = np.linspace(0.0, 3.0 / controller.decay, 61)
    run = solve_ivp(rate, (0.0, times[-1]), start, method="LSODA", t_eval=times, rtol=1e-8, atol=1e-12 * controller.domain)
    scaled = run.y.T / controller.domain
    level = np.sqrt(np.einsum("ta,ab,tb->t", scaled, controller.p, scaled))
    return float(np.min(-np.log(level[1:] / level[0]) / times[1:]))


def design_time() -> float:
    """Time that one core takes for the design of the cylinder at one mean pressure: 8 vertex systems with 4 states [s]."""
    model = _cylinder()
    held = polytope(_plant(model, (3.5e5, 3.5e5)))
    times = []
    for _ in range(3):
        begin = clock.process_time()
        design(held, Requirements(decay=2.0, limit=1.0))
        times.append(clock.process_time() - begin)
    return min(times)


def run(starts: Sequence[int] = range(N_STARTS), designs: Sequence[int] = range(N_DESIGNS)) -> list[Figure]:
    """Hunting over starts and loads; eigenvalues and decay over random designs; time."""
    few = starts[: max(len(starts) // 10, 1)]
    found = {
        "tensor product": np.array([positioned(tensor_product(), seed) for seed in starts]),
        "PID": np.array([positioned(pid(), seed) for seed in starts]),
        "the mean gains of the tensor product": np.array([positioned(unscheduled(), seed) for seed in few]),
        "PID whose integral rests": np.array([positioned(pid(TOLERANCE), seed) for seed in few]),
    }
    figures = []
    for name, each in found.items():
        share = float(np.mean(each[:, 0] > 0.0))
        goal = "== 0" if name == "tensor product" else ""
        figures += [
            Figure(f"{name}: share of {len(each)} starts and loads at which it hunts", share, "1", goal),
            Figure(f"{name}: range of the position in the last second, median", 1e6 * float(np.median(each[:, 0])), "um"),
            Figure(f"{name}: error at the end, largest", 1e6 * float(np.max(each[:, 1])), "um"),
        ]
    accepted = 0
    failures, slow, least = 0, 0, np.inf
    for seed in designs:
        held = random_design(seed)
        if held is None:
            continue
        accepted += 1
        failures += not eigenvalues_hold(held[1])
        ratio = decay_found(*held, seed) / held[1].decay
        slow += ratio < 1.0
        least = min(least, ratio)
    return [
        *figures,
        Figure(f"random designs accepted, of {len(designs)}", float(accepted), ""),
        Figure("accepted designs that fail the eigenvalues", float(failures), "", "== 0"),
        Figure("accepted designs that decay more slowly than designed in simulation", float(slow), "", "== 0"),
        Figure("decay rate in simulation over that designed, smallest", float(least), "1", ">= 1"),
        Figure("design of 8 vertex systems with 4 states, time of one core, shortest of three", design_time(), "s", "<= 1"),
    ]


BENCHMARK = Benchmark(
    "tensor-product-control", "tensor-product control: hunting against PID, random designs, time", run, long=True
)
