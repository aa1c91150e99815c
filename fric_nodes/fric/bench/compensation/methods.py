"""Methods of compensation: a feedback tuned by its autotune, and feedforwards made from what is identified."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...control.autotune import Autotuned, autotune
from ...control.controller import Law
from ...control.feedbacks import CONTROLLERS
from ...control.feedforward import Feedforward
from ...control.feedforward_kind import Force
from ...control.feedforwards.dnlrx import DnlrxForce
from ...control.feedforwards.iterative_learning import IterativeLearning, learnt
from ...control.feedforwards.quadrant_pulse import QuadrantPulse
from ...control.feedforwards.static_table import StaticTable
from ...control.shaping import Shaped, Shaping, Total
from ...control.tensor_product.tuning import TunedTensorProduct, tuned_tensor_product
from ...control.trial import Course, Reference, follow
from ...model import Model
from ...record import Array
from .axes import BenchAxis, Known

__all__ = ["METHODS", "NEEDS_SPRINGS", "QUICK", "Bench", "Method", "Setup", "peak_at_reversals"]

_PAIRS = 20  # physical: of a commercial table
_PASSES = 8  # physical: of iterative learning
_SHARE = 0.6  # numerical: of the inverse that each pass takes

_REVERSAL = 0.125  # physical: share of the time between reversals in which an error counts as a quadrant peak


def peak_at_reversals(course: Course, first: int) -> float:
    """Mean over the reversals of the largest error after each [x], from sample ``first`` on."""
    velocity = course.reference.velocity
    turns = np.flatnonzero(velocity[1:] * velocity[:-1] < 0.0) + 1
    gap = int(np.median(np.diff(turns))) if turns.size > 1 else velocity.shape[0]
    width = max(round(_REVERSAL * gap), 1)
    peaks = [float(np.max(np.abs(course.error[k : k + width]))) for k in turns if k >= first and k + width <= velocity.shape[0]]
    return float(np.mean(peaks)) if peaks else math.nan


@dataclass(eq=False)
class Bench:
    """One axis of one seed with what is known of it.

    Attributes:
        axis: which.
        truth: at work.
        seed: of the noise.
        known: from the recording.
    """

    axis: BenchAxis
    truth: Model
    seed: int
    known: Known

    def __post_init__(self) -> None:
        self._tuned: dict[str, Autotuned] = {}
        self._tensor_product: TunedTensorProduct | None = None

    @property
    def preview(self) -> float:
        """How much later than its stamp a force acts [s]."""
        return 0.5 * self.axis.timing.period + self.axis.timing.delay

    def tuned(self, feedback: str) -> Autotuned:
        """Gains of a feedback, once for all methods with it."""
        if feedback not in self._tuned:
            # Hunting and stability depend on pre-sliding, where it is known.
            model = self.known.presliding or self.known.rigid
            self._tuned[feedback] = autotune(
                model, CONTROLLERS[feedback], self.axis.timing, draws=40, seed=self.seed, calm=True
            )
        return self._tuned[feedback]

    def tensor_product(self) -> TunedTensorProduct:
        """The design by linear matrix inequalities, once for all methods with it."""
        if self._tensor_product is None:
            fastest = max(float(np.max(np.abs(each.velocity))) for each in (self.axis.reference, self.axis.resting))
            self._tensor_product = tuned_tensor_product(
                self.known.rigid, self.axis.timing, fastest=fastest, sticking=self.known.presliding
            )
        return self._tensor_product

    def law(self, feedback: str, **changed: float) -> Law:
        """A feedback at work."""
        if feedback == "tensor_product":
            made = self.tensor_product()
            return made.controller.build({**made.values, **changed}, self.axis.timing.force_limit)
        gains = {**self.tuned(feedback).gains, **changed}
        return CONTROLLERS[feedback].build(gains, self.axis.timing.force_limit)

    def run(self, law: Law, force: Force | None, reference: Reference | None = None) -> Course:
        """Once along the task, or another reference."""
        along = self.axis.reference if reference is None else reference
        return follow(self.axis.body(self.truth, self.seed + 1000), law, along, force, self.axis.delay, self.axis.age)

    def model_force(self, model: Model, terms: tuple[str, ...] = (), build_up: float = 0.0) -> Force:
        """A model along the reference."""
        made = Feedforward(self.axis.timing.period, preview=self.preview, transition_time=0.0, terms=terms)
        made.set_model(model, at_once=True)
        return Shaped(made, Shaping(build_up=build_up, let_down=0.5 * build_up)) if build_up > 0.0 else made

    def friction_way(self) -> float:
        """Way of pre-sliding [x]: where half the springs slide; without springs the error at which P overcomes friction."""
        model = self.known.presliding
        coulomb = self.known.rigid.value("coulomb.force")
        if model is not None:
            stiffness = sum(p.value for p in model.parameters() if p.name.startswith("presliding.stiffness"))
            return float(3.0 * coulomb / stiffness)
        return float(coulomb / max(self.tuned("pid").gains["proportional"], 1e-300))


@dataclass(frozen=True, eq=False)
class Setup:
    """A method made ready for one axis; each call gives a law or force at its start.

    Attributes:
        law: the feedback.
        force: feedforward along the task.
        elsewhere: feedforward along other motions; None: the same.
    """

    law: Callable[[], Law]
    force: Callable[[], Force | None]
    elsewhere: Callable[[], Force | None] | None = None


Method = Callable[[Bench], Setup]
"""Tunes and learns what it needs on the axis, and gives what then goes to work."""


def _velocity_only(bench: Bench) -> Force:
    return bench.model_force(bench.known.rigid, ("viscous", "bias"))


def _table(bench: Bench) -> Force:
    """Twenty pairs, dense near standstill, of the sliding friction of the identified model."""
    rigid = bench.known.rigid
    fastest = float(np.max(np.abs(bench.axis.reference.velocity)))
    v = np.concatenate([[0.0], np.geomspace(1e-3 * fastest, fastest, _PAIRS - 1)])
    f = rigid.value("coulomb.force") + rigid.value("viscous.coefficient") * v
    return StaticTable(v.tolist(), f.tolist(), rigid.total_inertia, bench.preview)


def _pulse(bench: Bench) -> Setup:
    """Height and decay by trial on the axis itself, for the smallest peak, as a circle test tunes them."""
    rigid = bench.known.rigid
    coulomb, first = rigid.value("coulomb.force"), bench.axis.reference.position.shape[0] // 2
    best: tuple[float, Callable[[], Force]] | None = None
    half = 0.5 / _main_frequency(bench.axis.reference.velocity, bench.axis.timing.period)

    def law() -> Law:
        return bench.law("pid")

    for height, decay in itertools.product((0.5, 1.0, 1.5, 2.0), (0.005 * half, 0.02 * half, 0.1 * half, 0.4 * half)):

        def force(height: float = height, decay: float = decay) -> Force:
            return QuadrantPulse(
                height * coulomb,
                bench.axis.timing.period,
                decay,
                viscous=rigid.value("viscous.coefficient"),
                mass=rigid.total_inertia,
                preview=bench.preview,
            )

        course = bench.run(law(), force())
        peak = peak_at_reversals(course, first) if course.stable else math.inf
        if best is None or peak < best[0]:
            best = peak, force
    assert best is not None
    return Setup(law, best[1])


def _main_frequency(velocity: Array, period: float) -> float:
    """Reversals per second, by two [Hz]."""
    turns = float(np.count_nonzero(velocity[1:] * velocity[:-1] < 0.0))
    return float(max(0.5 * turns / (velocity.shape[0] * period), 1e-9))


def _learning(bench: Bench) -> Setup:
    """PID with the rigid model, and a force that is learnt in the passes before."""
    period, rigid = bench.axis.timing.period, bench.known.rigid
    gains = bench.tuned("pid").gains
    cutoff = 0.1 / (period + bench.axis.timing.delay)  # numerical: below it the nominal loop's inverse is known well
    damping = rigid.value("viscous.coefficient")
    times, force = bench.axis.reference.time, np.zeros(bench.axis.reference.position.shape[0])
    best: tuple[float, list[float]] | None = None

    def law() -> Law:
        return bench.law("pid")

    def learnt_so_far(values: list[float]) -> Force:
        return Total((_velocity_only(bench), IterativeLearning(times.tolist(), values)))

    for _ in range(_PASSES):
        course = bench.run(law(), learnt_so_far(force.tolist()))
        error = bench.axis.reference.position - course.seen
        size = float(np.sqrt(np.mean(error**2)))
        if not course.stable or (best is not None and size > 1.05 * best[0]):
            break
        if best is None or size < best[0]:
            best = size, force.tolist()
        rate = np.gradient(error, period)
        integral = period * np.cumsum(error)
        inverse = rigid.total_inertia * np.gradient(rate, period) + (damping + gains["derivative"]) * rate
        inverse += gains["proportional"] * error + gains["integral"] * integral
        early = 1 + round(bench.axis.timing.delay / period)  # a force of sample k shows in the position from k + early on
        correction = _SHARE * np.concatenate([inverse[early:], np.full(early, inverse[-1])])
        force = learnt(force, error, correction, period, cutoff)
    values = best[1] if best is not None else np.zeros(times.shape[0]).tolist()
    # What is learnt holds for the motion on which it was learnt.
    return Setup(law, lambda: learnt_so_far(values), lambda: _velocity_only(bench))


def _with(feedback: str, force: Callable[[Bench], Force | None] = lambda _: None, **changed: float) -> Method:
    return lambda bench: Setup(lambda: bench.law(feedback, **changed), lambda: force(bench))


def _dnlrx(bench: Bench) -> Force | None:
    model = bench.known.dnlrx
    if model is None:
        return None
    # Its forces are means over the interval before a sample, the command acts over the one that follows.
    return DnlrxForce(model, bench.axis.timing.period, bench.preview + 0.5 * bench.axis.timing.period)


def _rigid(bench: Bench) -> Force:
    return bench.model_force(bench.known.rigid)


def _eased(bench: Bench) -> Force:
    return bench.model_force(bench.known.rigid, build_up=bench.friction_way())


def _presliding(bench: Bench) -> Force | None:
    return None if bench.known.presliding is None else bench.model_force(bench.known.presliding)


METHODS: dict[str, Method] = {
    "pid": _with("pid"),
    "pid + velocity": _with("pid", _velocity_only),
    "pid + table": _with("pid", _table),
    "pid + pulse": _pulse,
    "pid + rigid model": _with("pid", _rigid),
    "pid + rigid model, eased": _with("pid", _eased),
    "pid + pre-sliding model": _with("pid", _presliding),
    "pid + dnlrx": _with("pid", _dnlrx),
    "nonlinear pid + dnlrx": _with("nonlinear_pid", _dnlrx),
    "nonlinear pid + velocity": _with("nonlinear_pid", _velocity_only),
    "cascade + velocity": _with("cascade", _velocity_only),
    "reset integral + velocity": _with("reset_integral", _velocity_only),
    "disturbance observer + velocity": _with("disturbance_observer", _velocity_only),
    "friction observer + velocity": _with("friction_observer", _velocity_only),
    "adaptive": _with("adaptive"),
    "tensor product + velocity": _with("tensor_product", _velocity_only),
    "tensor product + rigid model, eased": _with("tensor_product", _eased),
    "iterative learning": _learning,
}
"""Every method by its name. ``+ velocity`` adds viscous friction, bias and inertia along the reference, but no dry friction."""

NEEDS_SPRINGS = ("pid + pre-sliding model", "pid + dnlrx", "nonlinear pid + dnlrx")
"""Methods that are left out where no pre-sliding is identified."""

QUICK = (
    *("pid", "pid + velocity", "pid + table", "pid + rigid model, eased", "pid + pre-sliding model", "cascade + velocity"),
    *("disturbance observer + velocity", "friction observer + velocity", "adaptive", "tensor product + velocity"),
)
"""Methods of a quick comparison: one of each family."""
