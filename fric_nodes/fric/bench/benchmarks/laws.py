"""The compiled simulation step of a model beside a C loop of the same equations, law by law.

What is measured is the step that a simulation makes: one body under a given force, led by the implicit midpoint rule with exact
stick or with slip dynamics. The C texts in ``laws_c/`` hold the same algorithm (equations, trial velocities, tolerances), each
written for its one law with its states in local variables, as one would write it if this law were all there is. They are
compiled with ``cc -O3`` when the benchmark runs and measured in turns with the compiled loops, best of several, since the speed
of a shared processor changes from second to second. Both write position, velocity, friction and applied force of every step
into arrays that were there before. A ratio is given only where both come to the same motion; with gcc on x86-64 they agree to
the last bit.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...figure import Figure
from ...model import Model, Term, build_model, term
from ...record import Array
from ..benchmark import Benchmark
from ..compiled_c import compile_loop, compiler

__all__ = ["BENCHMARK", "CASES", "Case", "Run", "ours", "theirs"]

_TURNS = 25
_SAME = 1e-9  # largest difference of the two motions, of their range
_GOAL = ">= 0.8"
_MASS = 1.2
_LOAD, _TEMPERATURE = 1.1, 5.0


@dataclass(frozen=True)
class Case:
    """One law.

    Attributes:
        name: in words.
        terms: the model on a rigid axis; the C text takes their values in this order.
        source: C text.
        law: what it is compiled with.
        step: [s].
        n_steps: of one measurement.
        goal: of the throughput relative to C.
    """

    name: str
    terms: tuple[Term, ...]
    source: str
    law: str
    step: float = 1e-3
    n_steps: int = 50_000
    goal: str = _GOAL

    @property
    def model(self) -> Model:
        """The model that is measured."""
        return build_model("rigid", {"mass": _MASS}, self.terms)

    @property
    def effort(self) -> Array:
        """Force [N] at every step, ``(n_steps,)``: motion both ways, reversals, and rests of a few per cent of the time."""
        t = self.step * np.arange(self.n_steps)
        return np.asarray(9.0 * np.sin(2 * np.pi * 3.0 * t) + 3.0 * np.sin(2 * np.pi * 7.3 * t))


_COULOMB = term("coulomb", force=4.0)
_VISCOUS = term("viscous", coefficient=10.0)
_STRIBECK = term("stribeck", "exponential", force=2.0, velocity=0.01)


def _level(name: str, law: str, *terms: Term, goal: str = _GOAL) -> Case:
    return Case(name, (_COULOMB, *terms, _VISCOUS), "algebraic.c", law, goal=goal)


def _dwell(law: str, **values: float) -> Case:
    held = term("dwell_time", law, force=2.0, length=1e-4, **values)
    return _level(f"dwell time, {law.replace('_', ' ')}", f"DWELL_{law.upper()}", held, goal="")


def _force(name: str, law: str, held: Term, goal: str = "") -> Case:
    return Case(name, (_COULOMB, held), "algebraic.c", law, goal=goal)


def _presliding(name: str, law: str, source: str, held: Term, goal: str = "") -> Case:
    return Case(name, (_COULOMB, _STRIBECK, held, _VISCOUS), source, law, 1e-4, 20_000, goal)


def _springs() -> dict[str, float]:
    return {f"stiffness_{i}": 1e5 / i**2 for i in range(1, 11)} | {f"limit_{i}": 1e-5 * i for i in range(1, 11)}


CASES = (
    _level("Coulomb, viscous", "COULOMB_VISCOUS"),
    _level("Stribeck exponential", "STRIBECK", _STRIBECK),
    _level("Stribeck after Hess and Soom", "HESS_SOOM", term("stribeck", "hess_soom", force=2.0, velocity=0.01)),
    _level("static friction", "STATIC", term("stribeck", "static", force=2.0)),
    _level("acceleration-dependent hysteresis", "ACCEL_HYSTERESIS", term("accel_hysteresis", force=2.0, velocity=0.01)),
    _force("quadratic drag", "QUADRATIC", term("quadratic_drag", coefficient=40.0), _GOAL),
    _level("asymmetry", "ASYMMETRY", term("asymmetry", force=0.5, coefficient=1.0)),
    _force("bias", "BIAS", term("bias", force=0.5)),
    _force("ripple", "RIPPLE", term("ripple", cosine=0.5, sine=0.3, period=0.01)),
    _force("stiffness", "STIFFNESS", term("stiffness", stiffness=200.0)),
    _force("hardening stiffness", "NONLINEAR_STIFFNESS", term("nonlinear_stiffness", stiffness=1e4)),
    _level("load dependence", "LOAD", term("load_dependence", "scaling", coefficient=0.5)),
    _level("load in proportion", "LOAD_PROPORTIONAL", term("load_dependence", "proportional", force=1.0)),
    _level(
        "periodic position dependence",
        "POSITION_PERIODIC",
        term("position_dependence", "periodic", cosine=0.3, sine=0.1, period=0.05),
    ),
    _level(
        "local position dependence",
        "POSITION_LOCAL",
        term("position_dependence", "local", amplitude=0.5, position=0.02, width=0.01),
    ),
    _level("temperature", "TEMPERATURE", term("temperature", level_change=0.01, viscous_change=0.02)),
    _level("linear drift", "DRIFT_LINEAR", term("time_drift", "linear", rate=1e-3)),
    _level("exponential drift", "DRIFT_EXPONENTIAL", term("time_drift", "exponential", change=0.2, time=30.0)),
    _level("frictional lag", "LAG", _STRIBECK, term("frictional_lag", "first_order", time=5e-3), goal=""),
    _dwell("exponential", initial=0.5, time=0.1, exponent=0.7),
    _dwell("exponential_power", time=0.1, exponent=0.7, power=0.5),
    _dwell("hyperbolic", initial=0.5, time=0.1),
    _dwell("root", ratio=3.0, time=0.1),
    _dwell("logarithmic", initial=0.5, time=0.1),
    _dwell("power", exponent=0.3),
    _presliding("LuGre", "LUGRE", "one_state.c", term("presliding", "lugre", stiffness=1e5, damping=100.0), _GOAL),
    _presliding("Dahl, n = 1", "DAHL", "one_state.c", term("presliding", "dahl", stiffness=1e5)),
    _presliding(
        "elasto-plastic",
        "ELASTO_PLASTIC",
        "one_state.c",
        term("presliding", "elasto_plastic", stiffness=1e5, damping=100.0, breakaway=0.7),
    ),
    _presliding(
        "GMS, M = 10", "GMS", "many_states.c", term("presliding", "gms", stiffness=1e5, attraction=100.0, damping=100.0), _GOAL
    ),
    _presliding("Maxwell slip, M = 10", "MAXWELL_SLIP", "many_states.c", term("presliding", "maxwell_slip", **_springs())),
)
"""Every law that is measured: algebraic friction laws, LuGre and GMS with a goal; forces other than friction, laws with
memory and the other pre-sliding laws without. Frictional lag as a pure delay is left out: its delay line is no equation."""


class Run:
    """One loop over a case with the arrays that it reads and writes; call it to lead the axis from rest through all steps.

    Args:
        case: what is run.
        loop: ``(p, u, h, x, z, memory, x_out, friction_out, applied_out)``.
    """

    def __init__(self, case: Case, loop: Callable[..., None]) -> None:
        model = case.model
        self._start = model.inner_states()
        self._loop = loop
        self._values = model.values
        self._effort = case.effort
        self._step = case.step
        self._x, self._z, self._memory = np.zeros(2), self._start[0].copy(), self._start[1].copy()
        self.motion = np.zeros((case.n_steps, 2))
        self.friction = np.zeros(case.n_steps)
        self._applied = np.zeros(case.n_steps)

    def __call__(self) -> float:
        """Time that the run took [s]."""
        self._x[:] = 0.0
        self._z[:], self._memory[:] = self._start
        inner = self._z, self._memory
        start = time.perf_counter()
        self._loop(self._values, self._effort, self._step, self._x, *inner, self.motion, self.friction, self._applied)
        return time.perf_counter() - start


def ours(case: Case) -> Run:
    """The loop that fric compiles for the case."""
    simulate = case.model.loops.simulate
    load, temperature = np.array([_LOAD]), np.array([_TEMPERATURE])

    def loop(p: Array, u: Array, h: float, x: Array, z: Array, memory: Array, *out: Array) -> None:
        simulate(p, u, h, 1, 0.0, load, temperature, x, z, memory, *out)

    return Run(case, loop)


def theirs(case: Case, folder: Path) -> Run:
    """The C loop of the case, compiled into ``folder``.

    Raises:
        InputError: there is no compiler, or it doesn't compile.
    """
    run = compile_loop(case.source, case.law, folder)

    def loop(p: Array, u: Array, h: float, x: Array, z: Array, memory: Array, *out: Array) -> None:
        run(p, u, h, _LOAD, _TEMPERATURE, x, z if z.size else memory, *out)

    return Run(case, loop)


def difference(a: Run, b: Run) -> float:
    """Largest difference of two motions, positions and velocities each by their range."""
    return float(np.max(np.abs(a.motion - b.motion) / np.ptp(a.motion, axis=0)))


def _best(runs: list[Callable[[], float]], turns: int) -> list[float]:
    """Shortest time of each, taken in turns."""
    spent = [[run() for run in runs] for _ in range(turns)]
    return [min(times) for times in zip(*spent, strict=True)]


def measure(case: Case, folder: Path | None, turns: int = _TURNS) -> list[Figure]:
    """Figures of one case; without ``folder`` those of fric alone."""
    mine = ours(case)
    mine()
    if folder is None:
        return [Figure(f"{case.name}: step", 1e9 * _best([mine], turns)[0] / case.n_steps, "ns")]
    other = theirs(case, folder)
    other()
    off = difference(mine, other)
    if off > _SAME:
        return [Figure(f"{case.name}: motion against that of the C loop, of the range", off, "1", f"<= {_SAME}")]
    here, there = _best([mine, other], turns)
    return [
        Figure(f"{case.name}: step", 1e9 * here / case.n_steps, "ns"),
        Figure(f"{case.name}: step in C", 1e9 * there / case.n_steps, "ns"),
        Figure(f"{case.name}: throughput relative to C", there / here, "1", case.goal),
    ]


def run() -> list[Figure]:
    """Nanoseconds per step of fric and of C, and the ratio of their throughputs."""
    if compiler() is None:
        figures = [Figure("C compiler found", 0.0, "1")]
        return figures + [figure for case in CASES for figure in measure(case, None)]
    with tempfile.TemporaryDirectory() as folder:
        return [figure for case in CASES for figure in measure(case, Path(folder))]


BENCHMARK = Benchmark("laws", "compiled steps against C", run)
