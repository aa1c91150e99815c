"""The next setting: what is tried when a run shows nothing, and otherwise the gain that most reduces what is least known.

While the axis doesn't oscillate enough to be analysed, P rises, up to what the force allows at the deflection; then D falls
below zero, where that is allowed, and takes viscous friction away, but leaves the axis stable: dry friction F_C keeps a swing
of amplitude A from growing while the damping coefficient left is above -4 F_C/(pi w A), of which a share is used. Once runs are
usable, the covariance that inertia, damping and stiffness would have after one more run is predicted for each candidate from

    w = sqrt((k + P)/m),  c = 2 m w zeta - D

with the relative errors of w and zeta seen so far, and the candidate with the smallest largest relative error is taken.
Source: de Marchi 1998 (parametric harmonic oscillation); the choice derived here (D- and E-optimal design are its relatives).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from .knowledge import Expectation, Knowledge, Run
from .motion import Limits
from .runs import FORCED, FREE, Setting

__all__ = ["Bounds", "Done", "next_forced", "next_setting"]

_SHARE = 0.9  # of the force limit that a feedback takes at the deflection
_GROWTH = 0.7  # of what dry friction damps that a negative D may use up
_REVERSALS = 9  # wanted of a free oscillation, and
_FEWEST = 6  # without which it is not worth a run
_FINEST = 0.3  # w h at most: twenty samples in a period
_CANDIDATES = 12
_MILDER_DERIVATIVE = 0.9  # of a D that was cut off: what may be tried after it, and
_MILDER_PROPORTIONAL = 0.5  # of a P
_REPEATED = 0.1  # by which a gain that was tried before must say more
_FADING = 0.2  # of the largest deflection: a shorter one isn't worth a run
_FORCED_REVERSALS = 1.6  # amplitude of the force over dry friction, at least


@dataclass(frozen=True)
class Bounds:
    """What settings may be chosen from.

    Attributes:
        limits: of force and travel.
        deflection: largest deflection to let go from, and amplitude of forced runs [x].
        proportional: smallest and largest P [F/x].
        derivative: smallest D [F s/x]; below zero where damping may be taken away.
        frequency: smallest and largest frequency of forced runs [rad/s].
        sample_time: [s].
        first: P of the first run [F/x]; 0: the smallest.
        wanted: relative standard error of inertia, damping and stiffness.
        fewest: runs made in any case.
        most: runs made at most.
    """

    limits: Limits
    deflection: float
    proportional: tuple[float, float]
    derivative: float
    frequency: tuple[float, float]
    sample_time: float
    first: float = 0.0
    wanted: float = 0.005
    fewest: int = 4
    most: int = 12


@dataclass(frozen=True)
class Done:
    """No further run, and why; ``reached`` when all is known as well as was wanted."""

    reason: str
    reached: bool = False
    sticks: bool = False


def _deflection(bounds: Bounds, proportional: float, derivative: float, expected: Expectation | None) -> float:
    """From where the force of the feedback stays within its share [x]."""
    w = expected.frequency(proportional) if expected is not None else 0.0
    stiffness = math.hypot(proportional, derivative * w)
    return min(bounds.deflection, _SHARE * bounds.limits.force / stiffness) if stiffness > 0.0 else bounds.deflection


def _derivative(bounds: Bounds, proportional: float, expected: Expectation) -> tuple[float, float, int]:
    """The D nearest to zero with which it turns often enough, its deflection, and how often it turns."""
    best = (0.0, _deflection(bounds, proportional, 0.0, expected), 0)
    w = expected.frequency(proportional)
    for share in np.linspace(0.0, 1.0, 21):
        derivative = float(share) * bounds.derivative
        size = _deflection(bounds, proportional, derivative, expected)
        least = -_GROWTH * 4.0 * expected.coulomb / (math.pi * w * size)
        if share > 0.0 and expected.damping(proportional, derivative) < least:
            break
        turns = expected.reversals(proportional, derivative, size)
        if turns > best[2]:
            best = (derivative, size, turns)
        if turns >= _REVERSALS:
            break
    return best


def _candidates(bounds: Bounds, knowledge: Knowledge) -> list[Setting]:
    """Free oscillations that can be expected to be analysable, by rising P."""
    expected = knowledge.expectation
    assert expected is not None
    low, high = bounds.proportional
    tried = [run.setting.proportional for run in knowledge.runs]
    high = min(high, 4.0 * max(tried)) if max(tried) > 0.0 else high
    start = max(low, 1e-3 * high)
    grid = sorted({low, *np.geomspace(start, high, _CANDIDATES).tolist()})
    cuts = [run.setting for run in knowledge.runs if run.problem.startswith("cut")]
    found = []
    for proportional in grid:
        if proportional + expected.stiffness <= 0.0 or expected.frequency(proportional) * bounds.sample_time > _FINEST:
            continue
        derivative, size, turns = _derivative(bounds, proportional, expected)
        if any(_as_bold(cut, proportional, derivative) for cut in cuts):
            continue
        if turns >= _FEWEST and size >= _FADING * bounds.deflection:
            found.append(Setting(FREE, proportional, derivative, size))
    return found


def _as_bold(cut: Setting, proportional: float, derivative: float) -> bool:
    """True when a setting is too much like one that was cut off: a delay or a friction isn't what it was taken for."""
    if cut.derivative < 0.0:
        return derivative < _MILDER_DERIVATIVE * cut.derivative
    return proportional > _MILDER_PROPORTIONAL * cut.proportional


def _errors(knowledge: Knowledge) -> tuple[float, float]:
    """Relative error of a frequency and absolute one of a damping coefficient [F s/x], from the fit so far."""
    found, expected = knowledge.oscillation, knowledge.expectation
    if found is None or expected is None:
        return 1e-3, 1e-2
    n = max(len(knowledge.usable), 1)
    errors = found.model.standard_errors
    mass = errors.get("mass", 0.0) / expected.mass
    return max(0.5 * mass, 1e-5), max(errors.get("viscous.coefficient", 0.0) * math.sqrt(n), 1e-9)


def _worst(settings: list[Setting], expected: Expectation, spring: bool, errors: tuple[float, float]) -> float:
    """Largest relative standard error of inertia, damping and stiffness after runs with these settings."""
    rows = []
    for setting in settings:
        w = expected.frequency(setting.proportional)
        noise = errors[0] * w
        row = [-0.5 * w / expected.mass / noise, 0.5 / (expected.mass * w) / noise]
        rows.append(row[: 2 if spring else 1])
    information = np.array(rows).T @ np.array(rows)
    scale = np.array([expected.mass, max(abs(expected.stiffness), 1e-300)])[: 2 if spring else 1]
    scaled = information * np.outer(scale, scale)
    if np.linalg.cond(scaled) > 1e12:
        return math.inf
    return float(np.sqrt(np.max(np.diag(np.linalg.inv(scaled)))))


def _alternate(setting: Setting, runs: tuple[Run, ...]) -> Setting:
    """From one side and the other in turn."""
    return replace(setting, deflection=setting.deflection * (-1.0) ** len(runs))


def next_setting(bounds: Bounds, knowledge: Knowledge) -> Setting | Done:
    """What to try next, for free oscillations."""
    runs = knowledge.runs
    if not runs:
        low = bounds.first or bounds.proportional[0]
        return Setting(FREE, low, 0.0, _deflection(bounds, low, 0.0, None))
    errors = knowledge.relative_errors()
    if len(knowledge.usable) >= bounds.fewest and errors and max(errors.values()) <= bounds.wanted:
        return Done(f"inertia, damping and stiffness are known to {100 * max(errors.values()):.2g} %", reached=True)
    if len(runs) >= bounds.most:
        worst = f"{100 * max(errors.values()):.2g} %" if errors else "not at all"
        return Done(f"{len(runs)} runs are made; the least known is known to {worst}")
    if knowledge.expectation is None:
        return _harder(bounds, runs)
    choices = _candidates(bounds, knowledge)
    if not choices:
        last = runs[-1].setting.proportional
        if not knowledge.usable and last < 0.9 * _stiffest(bounds):
            return _harder(bounds, runs)
        return Done(
            f"friction is too high for a free oscillation within {bounds.limits.force:g} of force and a deflection of"
            f" {bounds.deflection:g}, even with D = {bounds.derivative:g}",
            sticks=True,
        )
    usable = [run.setting for run in knowledge.usable]
    if len(usable) < 2:
        # The ends say most: the softest, then the stiffest that can be had.
        first = usable[0].proportional if usable else math.inf
        far = max(choices, key=lambda c: abs(c.proportional - first)) if usable else choices[0]
        return _alternate(far, runs)
    seen = _errors(knowledge)
    expected, spring = knowledge.expectation, knowledge.spring

    def cost(setting: Setting) -> float:
        # Without a spring of its own every gain tells as much of the mass: then those that haven't been tried come first.
        again = sum(abs(used.proportional - setting.proportional) < 0.2 * setting.proportional for used in usable)
        return _worst([*usable, setting], expected, spring, seen) * (1.0 + _REPEATED * again)

    return _alternate(min(choices, key=cost), runs)


def _stiffest(bounds: Bounds) -> float:
    """The P that takes its share of the force at the largest deflection."""
    return min(bounds.proportional[1], _SHARE * bounds.limits.force / bounds.deflection)


def _harder(bounds: Bounds, runs: tuple[Run, ...]) -> Setting | Done:
    """A stiffer feedback, while nothing is known."""
    last, most = runs[-1].setting.proportional, _stiffest(bounds)
    if last >= 0.9 * most:
        return Done("the axis doesn't oscillate, and its runs don't tell its friction either", sticks=True)
    stiffer = min(max(3.0 * last, 0.1 * most), most)
    return _alternate(Setting(FREE, stiffer, 0.0, _deflection(bounds, stiffer, 0.0, None)), runs)


def next_forced(bounds: Bounds, knowledge: Knowledge, n_frequencies: int = 4) -> Setting | Done:
    """What to try next, for forced runs: frequencies in equal ratios, each with the force that gives the amplitude wanted."""
    runs = [run for run in knowledge.runs if run.setting.kind == FORCED]
    good = [run for run in runs if not run.problem]
    errors = knowledge.relative_errors() if good else {}
    if len(good) >= max(bounds.fewest, n_frequencies) and errors and max(errors.values()) <= bounds.wanted:
        return Done(f"inertia, damping and stiffness are known to {100 * max(errors.values()):.2g} %", reached=True)
    if len(runs) >= bounds.most:
        worst = f"{100 * max(errors.values()):.2g} %" if errors else "not at all"
        return Done(f"{len(runs)} runs are made; the least known is known to {worst}")
    # From the quick end, where the motion is least, to the slow one; then between these, with other amplitudes.
    at = len(runs) / (n_frequencies - 1.0) if len(runs) < n_frequencies else _between(len(runs) - n_frequencies + 1)
    w = bounds.frequency[1] * (bounds.frequency[0] / bounds.frequency[1]) ** at
    size = bounds.deflection * (1.0 if len(runs) < n_frequencies or len(runs) % 2 == 0 else 0.6)
    centring = max(bounds.proportional[0], 0.1 * bounds.limits.force / bounds.limits.travel)
    most = _SHARE * bounds.limits.force - centring * size
    expected = knowledge.expectation
    if expected is None:
        force = 0.4 * most * 0.5 ** sum(bool(run.problem) for run in runs)
    else:
        stiff = expected.stiffness + centring - expected.mass * w**2
        lossy = w * expected.viscous + 4.0 * expected.coulomb / (math.pi * size)
        force = min(math.hypot(stiff, lossy) * size, most)
        force = min(max(force, _FORCED_REVERSALS * expected.coulomb), most)
        force *= 0.7 ** sum(run.problem.startswith("cut") for run in runs)
    return Setting(FORCED, centring, 0.0, size, w, force)


def _between(number: int) -> float:
    """Number ``number`` (from 1) of a sequence that fills the interval from 0 to 1 evenly (van der Corput, base 2)."""
    found, share = 0.0, 0.5
    while number:
        number, bit = divmod(number, 2)
        found += share * bit
        share *= 0.5
    return found
