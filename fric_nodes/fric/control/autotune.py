"""Gains of any controller of the catalogue from an identified model, robust over its intervals, without a limit cycle.

1. :func:`fric.control.tuning.tune` gives the PID with the most integral action at a sensitivity, for the identified mass and
   damping and the timing of the loop; the controller makes its own gains from that (:mod:`fric.control.tunable`).
2. Plants are drawn from the intervals of mass and damping (normal with their standard errors, or uniform within ``spread``
   where there are none) and every linear form of the controller is tested on each: stable on all, margins kept on 95 % of
   them, on the free mass. On the mass that sticks to its pre-sliding spring it has to be stable. Otherwise the loop is made
   slower, by a delay that it is tuned to bear, and step 1 is taken again.
3. The loop comes to rest under simulation against the identified friction. Where the axis goes on moving by more than three
   steps of the encoder, or harmonic balance (:mod:`fric.control.describing_function`) foretells that it does, the controller is
   asked for calmer gains, three times at most; what is left is reported.

Margins hold for linear loops: between them stands the friction, which adds damping on average, and a spring in pre-sliding.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from ..axis import SimulatedAxis
from ..errors import InputError
from ..model import Model
from .controller import Controller
from .describing_function import LimitCycle, limit_cycles
from .feedforward import refuse_impossible
from .loop import LinearPlant, LoopMargins, margins
from .trial import follow, point_to_point
from .tunable import Basis
from .tuning import tune

__all__ = ["AutotuneError", "Autotuned", "Required", "Timing", "autotune", "plants_around", "resting_width", "stuck_stiffness"]

_SLOWER = 1.4  # numerical: factor between two tries of the loop's own time
_TRIES = 12
_CALMER = 3
_CYCLE = 3.0  # physical: encoder steps; a position that flickers between two of them is at rest


class AutotuneError(InputError):
    """A model or controller for which no gains are found."""


@dataclass(frozen=True)
class Timing:
    """The loop around the axis.

    Attributes:
        period: [s].
        delay: from a reading until the force that answers it acts, whole periods and parts of them [s].
        resolution: step of the encoder [x].
        force_limit: largest force [F].
        filter_time: of the derivative [s]; None: one period.
    """

    period: float
    delay: float = 0.0
    resolution: float = 0.0
    force_limit: float = math.inf
    filter_time: float | None = None


@dataclass(frozen=True)
class Required:
    """What a tuned loop must keep.

    Attributes:
        gain: margin [1].
        phase: margin [deg].
        delay: margin, in periods [1].
        share: of the plants drawn that keep all three [1].
        sensitivity: M_s and M_t of the nominal loop [1].
    """

    gain: float = 2.0
    phase: float = 30.0
    delay: float = 2.0
    share: float = 0.95
    sensitivity: float = 1.7

    def kept(self, found: LoopMargins, period: float) -> bool:
        """Whether ``found`` keeps them."""
        return (
            found.stable
            and found.gain_margin >= self.gain
            and abs(found.phase_margin) >= self.phase
            and found.delay_margin >= self.delay * period
        )


@dataclass(frozen=True)
class Autotuned:
    """Gains and what they keep.

    Attributes:
        controller: kind of controller.
        gains: all its parameters by name.
        nominal: margins of the identified plant, the worst over the linear forms.
        kept: share of the plants drawn that keep the margins [1].
        stable: share of them that are stable [1].
        width: of the motion that goes on at rest in simulation [x].
        cycles: whether that is a limit cycle, or one is foretold.
        foretold: limit cycles in which the axis would end, by harmonic balance.
        notes: what a user should know.
    """

    controller: Controller
    gains: Mapping[str, float]
    nominal: LoopMargins
    kept: float
    stable: float
    width: float
    cycles: bool
    foretold: tuple[LimitCycle, ...] = ()
    notes: tuple[str, ...] = field(default=())


def stuck_stiffness(model: Model) -> float:
    """Stiffness of all pre-sliding springs together [F/x]; 0: rigid friction."""
    return sum(p.value for p in model.parameters() if p.name.startswith("presliding.stiffness"))


def plants_around(model: Model, timing: Timing, n: int, seed: int, spread: float = 0.2) -> list[LinearPlant]:
    """``n`` plants from the intervals of a model.

    Args:
        model: identified.
        timing: of the loop.
        n: how many.
        seed: of the draws.
        spread: half width of a uniform draw where a value has no standard error, of the value [1].
    """
    random = np.random.default_rng(seed)
    names = [p.name for p in model.parameters()]
    masses = [name for name in names if "." not in name and name.endswith("mass")]
    free = sum(model.value(name) for name in masses) if masses else 0.0
    fixed = model.total_inertia - free

    def drawn(name: str) -> float:
        value = model.value(name)
        error = model.standard_errors.get(name, math.nan)
        if math.isfinite(error) and error > 0.0:
            return float(max(value + error * random.standard_normal(), 0.05 * value))
        return float(value * random.uniform(1.0 - spread, 1.0 + spread))

    plants = []
    for _ in range(n):
        mass = (
            fixed + sum(drawn(name) for name in masses)
            if masses
            else model.total_inertia * random.uniform(1 - spread, 1 + spread)
        )
        damping = max(drawn("viscous.coefficient"), 0.0) if "viscous.coefficient" in names else 0.0
        plants.append(LinearPlant(mass, damping, timing.period, timing.delay))
    return plants


def _worst(found: list[LoopMargins]) -> LoopMargins:
    return min(found, key=lambda each: (each.stable, abs(each.phase_margin)))


def autotune(
    model: Model,
    controller: Controller,
    timing: Timing,
    *,
    required: Required | None = None,
    draws: int = 100,
    spread: float = 0.2,
    seed: int = 0,
    calm: bool = True,
) -> Autotuned:
    """Gains of ``controller`` for ``model``.

    Args:
        model: identified, with standard errors where there are.
        controller: kind of controller.
        timing: of the loop.
        required: what must be kept.
        draws: number of plants.
        spread: of values without standard error, see :func:`plants_around`.
        seed: of the draws.
        calm: False leaves step 3 at its finding.

    Raises:
        InputError: the controller can't be tuned, a value of the model can't be, or no gains keep what is required.
    """
    refuse_impossible(model)
    required = Required() if required is None else required
    if controller.tunable is None:
        raise AutotuneError(f"controller '{controller.id}'", "doesn't say how it is tuned", "give its gains by hand")
    plants = plants_around(model, timing, draws, seed, spread)
    slower = 0.0
    for _ in range(_TRIES):
        found = _tried(model, controller, timing, required, plants, slower)
        if found is not None and found.kept >= required.share and found.stable == 1.0:
            return _calmed(model, controller, timing, required, plants, slower, found, calm)
        slower = max(_SLOWER * slower, 0.5 * (timing.period + timing.delay))
    problem = (
        f"no gains keep a gain margin of {required.gain:g} and {required.phase:g} deg on {100 * required.share:g} % of plants"
    )
    raise AutotuneError(f"controller '{controller.id}'", problem, "identify mass and damping better, or require less")


@lru_cache(maxsize=64)
def _pid_for(
    mass: float, damping: float, period: float, delay: float, filter_time: float, sensitivity: float
) -> tuple[dict[str, float], float]:
    """Gains of :func:`tune` by name, and the crossover [rad/s]; several controllers of one axis begin with the same."""
    pid, found = tune(
        mass, damping, period, delay=delay, filter_time=filter_time, sensitivity=sensitivity, complementary=sensitivity
    )
    names = ("proportional", "integral", "derivative", "filter_time")
    return {name: float(getattr(pid, name)) for name in names}, 2.0 * math.pi * found.crossover


def _basis(
    model: Model,
    controller: Controller,
    timing: Timing,
    required: Required,
    plants: list[LinearPlant],
    slower: float,
    calm: int,
) -> Basis:
    damping = next((p.value for p in model.parameters() if p.name == "viscous.coefficient"), 0.0)
    filter_time = timing.period if timing.filter_time is None else timing.filter_time
    # The delay that is added makes the loop slower; the filter follows, so that noise falls with the bandwidth.
    gains, crossover = _pid_for(
        model.total_inertia,
        damping,
        timing.period,
        timing.delay + slower,
        filter_time + 0.5 * slower,
        required.sensitivity,
    )
    plant = LinearPlant(model.total_inertia, damping, timing.period, timing.delay)
    # What is chosen by its margins keeps them on all corners of the plants, so that none of them lies beyond it.
    masses, dampings = ([getattr(each, name) for each in plants] for name in ("mass", "damping"))
    corners = [(mass, damping) for mass in (min(masses), max(masses)) for damping in (min(dampings), max(dampings))]
    ends = [plant, *(replace(plant, mass=mass, damping=damping) for mass, damping in corners)]
    tunable = controller.tunable
    assert tunable is not None

    def accepted(values: Mapping[str, float]) -> bool:
        forms = tunable.linear(values, timing.period)
        return all(required.kept(margins(end, form), timing.period) for end in ends for form in forms)

    return Basis(model, plant, dict(gains), crossover, timing.resolution, stuck_stiffness(model), calm, accepted)


def _tried(
    model: Model,
    controller: Controller,
    timing: Timing,
    required: Required,
    plants: list[LinearPlant],
    slower: float,
    calm: int = 0,
) -> Autotuned | None:
    """Gains with what they keep on ``plants``; None where the controller's own values are refused."""
    assert controller.tunable is not None
    basis = _basis(model, controller, timing, required, plants, slower, calm)
    gains = controller.tunable.gains(basis)
    if controller.refusal(gains) is not None:
        return None
    forms = controller.tunable.linear(gains, timing.period)
    nominal = _worst([margins(basis.plant, form) for form in forms])
    kept = stable = 0
    for plant in plants:
        each = [margins(plant, form) for form in forms]
        resting = basis.stuck <= 0.0 or all(margins(replace(plant, stiffness=basis.stuck), form).stable for form in forms)
        stable += all(one.stable for one in each) and resting
        kept += all(required.kept(one, timing.period) for one in each)
    return Autotuned(controller, gains, nominal, kept / len(plants), stable / len(plants), math.nan, False)


def _calmed(
    model: Model, controller: Controller, timing: Timing, required: Required, plants: list[LinearPlant], slower: float,
    found: Autotuned, calm: bool,
) -> Autotuned:  # fmt: skip
    """``found`` with what the simulation says of it, with calmer gains where it hunts."""
    for number in range(_CALMER + 1):
        if number > 0:
            other = _tried(model, controller, timing, required, plants, slower, number)
            if other is None or other.kept < required.share or other.stable < 1.0:
                break
            found = other
        width = resting_width(model, found.controller, found.gains, timing)
        cycles = width > _CYCLE * max(timing.resolution, 1e-12 * abs(width)) and width > 0.0
        foretold = foretold_cycles(model, found.controller, found.gains, timing, 2.0 * math.pi * found.nominal.crossover)
        notes = () if number == 0 else (f"calmer gains ({number}) since the axis hunted",)
        if cycles:
            notes = (*notes, f"hunts at rest by {width:.3g} in simulation")
        if foretold:
            at = f"{2.0 * foretold[0].amplitude:.3g} at {foretold[0].frequency:.3g} Hz"
            notes = (*notes, f"harmonic balance foretells a limit cycle of {at}")
        cycles = cycles or bool(foretold)
        found = replace(found, width=width, cycles=cycles, foretold=foretold, notes=notes)
        if not cycles or not calm:
            break
    return found


def foretold_cycles(
    model: Model, controller: Controller, gains: Mapping[str, float], timing: Timing, crossover: float
) -> tuple[LimitCycle, ...]:
    """Limit cycles by harmonic balance in which the axis would end, from an encoder step and a half of amplitude on.

    Args:
        model: the axis.
        controller: kind of controller.
        gains: of it.
        timing: of the loop.
        crossover: of the loop [rad/s].
    """
    largest = _way(model, timing)
    smallest = max(0.5 * _CYCLE * timing.resolution, 1e-4 * largest)
    if not 0.0 < smallest < largest or crossover <= 0.0:
        return ()
    found = limit_cycles(
        model, lambda: controller.build(gains, timing.force_limit), timing.period, delay=timing.delay,
        resolution=timing.resolution, smallest=smallest, largest=largest, crossover=crossover,
    )  # fmt: skip
    return tuple(each for each in found if each.stable)


def _way(model: Model, timing: Timing) -> float:
    """A move after which the axis is to rest [x]: hundreds of encoder steps, and of what friction moves in a sample."""
    coulomb = next((p.value for p in model.parameters() if p.name == "coulomb.force"), 0.0)
    return max(300.0 * timing.resolution, 20.0 * coulomb * timing.period**2 / model.total_inertia * 100.0)


def resting_width(model: Model, controller: Controller, gains: Mapping[str, float], timing: Timing, rest: float = 0.0) -> float:
    """Range of the true position in the last part of a rest after a move, simulated [x].

    Args:
        model: the axis.
        controller: kind of controller.
        gains: of it.
        timing: of the loop.
        rest: how long it rests [s]; 0: a thousand time constants of the loop's own time, 4,000 samples at least.
    """
    law = controller.build(gains, timing.force_limit)
    way = _way(model, timing)
    rest = rest if rest > 0.0 else 6000 * timing.period
    move = 400 * timing.period
    reference = point_to_point(timing.period, [0.0, way, 0.37 * way], move, rest)
    axis = SimulatedAxis(model, resolution=timing.resolution, force_limit=timing.force_limit)
    course = follow(axis, law, reference, delay=round(timing.delay / timing.period))
    n = round(0.4 * rest / timing.period)
    return float(np.ptp(course.position[-n:])) if course.stable else math.inf
