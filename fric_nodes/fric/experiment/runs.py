"""The runs of an experiment: lead the axis to a deflection and let it go under feedback, or shake it by a sinusoidal force.

Equation of both: u = P (r - q) - D v + B sin(w t), with the reference r at the origin while it counts. Before a free
oscillation the axis is led away under the placing gains: the reference moves until the axis has come to the deflection, or the
force to the share of its limit that placing may take; a spring of its own holds against it, how hard isn't known beforehand.
Source: de Marchi 1998 (parametric harmonic oscillation, forced harmonic oscillation).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from .motion import REST, Drive, Limits, Motion, Quiet, Sample, SwingWatch

__all__ = ["FORCED", "FREE", "Placing", "Setting", "Timing", "decay", "force_run", "settle"]

FREE = "free oscillation"
FORCED = "forced run"
_SHARE = 0.9  # of the force limit that placing may take
_PATIENCE = 20.0  # times the time of placing, after which it is given up
_LEAP = 0.02  # [s] most that the reference moves on from one sample to the next
_LEVEL = 0.02  # of the deflection: the axis rests when it moves by less


@dataclass(frozen=True)
class Setting:
    """What is chosen from run to run.

    Attributes:
        kind: :data:`FREE` or :data:`FORCED`.
        proportional: P [F/x].
        derivative: D [F s/x].
        deflection: from which it is let go; the amplitude wanted of a forced run [x]. The sign is the side.
        frequency: of the force [rad/s]; 0 in a free oscillation.
        force: amplitude B of the force [F]; 0 in a free oscillation.
    """

    kind: str
    proportional: float
    derivative: float
    deflection: float
    frequency: float = 0.0
    force: float = 0.0


@dataclass(frozen=True)
class Placing:
    """Gains under which the axis is led to its deflection: P [F/x] and D [F s/x]."""

    proportional: float
    derivative: float = 0.0


@dataclass(frozen=True)
class Timing:
    """How long things take.

    Attributes:
        place: to lead the axis to its deflection, at first [s].
        settle: most that it gets to come to rest [s].
        quiet: stillness that counts as rest [s].
        oscillation: most that it gets to oscillate [s].
        periods: of a forced run that are kept; as many again may pass before it is steady.
    """

    place: float = 1.0
    settle: float = 5.0
    quiet: float = 0.5
    oscillation: float = 10.0
    periods: int = 12


def settle(
    sample: Sample, tolerance: float, timing: Timing, drive: Drive = REST, watch: Callable[[Sample], None] | None = None
) -> Motion[Sample]:
    """Hold ``drive`` until the axis rests, or its time is over; the last sample. ``watch`` looks at each while a force acts."""
    quiet, end = Quiet(timing.quiet, tolerance), sample.time + timing.settle
    while not quiet.see(sample) and sample.time < end:
        if watch is not None:
            watch(sample)
        sample = yield drive
    return sample


def _place(
    sample: Sample, origin: float, setting: Setting, placing: Placing, limits: Limits, timing: Timing
) -> Motion[tuple[Sample, float]]:
    """Lead the axis to the deflection; the last sample, and the reference that holds it there."""
    start, passed, waited = sample.position, 0.0, 0.0
    side = math.copysign(1.0, setting.deflection)
    target = origin + setting.deflection
    reference = start
    while side * (sample.position - target) < -_LEVEL * abs(setting.deflection) and passed < _PATIENCE * timing.place:
        limits.watch(sample, origin)
        if placing.proportional * abs(reference - sample.position) < _SHARE * limits.force:
            # By the time of the samples, but without a leap where some are missing.
            s = passed / timing.place
            part = s**3 * (10.0 + s * (-15.0 + 6.0 * s)) if s < 1.0 else 1.0 + 0.5 * (s - 1.0)
            reference = start + (target - start) * part
            waited = 0.0
        elif waited > timing.quiet:
            break  # no farther: a swing about here will have to do
        last = sample.time
        sample = yield Drive(reference, placing.proportional, placing.derivative)
        step = min(sample.time - last, _LEAP)
        passed, waited = passed + step, waited + step
    return sample, reference


def decay(
    sample: Sample, origin: float, setting: Setting, placing: Placing, limits: Limits, timing: Timing
) -> Motion[tuple[float, float]]:
    """Place the axis, let it go and wait until it rests; when the release began and when it ended [s].

    Raises:
        Cut: it left its limits; the force is zero from the next sample on if the caller yields :data:`REST`.
    """
    tolerance = _LEVEL * abs(setting.deflection)
    sample, reference = yield from _place(sample, origin, setting, placing, limits, timing)
    held = Drive(reference, placing.proportional, placing.derivative)
    sample = yield from settle(sample, tolerance, timing, held, lambda seen: limits.watch(seen, origin))
    free = Drive(origin, setting.proportional, setting.derivative)
    sample = yield free
    began, size = sample.time, abs(sample.position - origin)
    swing, quiet = SwingWatch(size, limits.growth, origin), Quiet(timing.quiet, 0.5 * tolerance)
    while sample.time - began < timing.oscillation:
        limits.watch(sample, origin)
        swing.see(sample.position)
        # At a release from under friction it rests at once, which is a result too.
        if quiet.see(sample):
            break
        sample = yield free
    return began, sample.time


def force_run(sample: Sample, origin: float, setting: Setting, limits: Limits, timing: Timing) -> Motion[tuple[float, float]]:
    """Shake the axis by a sine that fades in, until it is steady, and for the periods wanted; begin and end of these [s].

    Raises:
        Cut: it left its limits.
    """
    begin = sample.time
    period = 2.0 * math.pi / setting.frequency
    fade, end = 3.0 * period, 2.0 * timing.periods * period
    while sample.time - begin < end:
        limits.watch(sample, origin)
        passed = sample.time - begin
        size = setting.force * min(passed / fade, 1.0)
        sample = yield Drive(origin, setting.proportional, setting.derivative, size * math.sin(setting.frequency * passed))
    return begin + timing.periods * period, sample.time
