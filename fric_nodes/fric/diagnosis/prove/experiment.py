"""Running an examiner's axis: recordings drawn from a seed, and the knob turned until the concealed has its strength.

A recording is drawn once (reference, loads, disturbances, noise); only the physics changes while the knob is turned, so
that the strength is a smooth function of it. The remainder of the refitted nominal structure (:mod:`.reckoning`) goes
nearly with the square of the knob, so that a few secant steps in logarithms find it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ...record import Array
from .axis import Setting
from .course import Course, Run, Unreachable
from .excitation import Axis, Piece, drawn_reference
from .physics import Physics
from .reckoning import Nominal, Remainder, balance, floor_of, refit
from .truth import Loop, integrate

__all__ = ["Bench", "Recording", "draw_recording"]

_TRIALS = 9
_KEPT = 4
_WARM = 9.0  # [K], usual deviation of the temperature
_LOADED = 0.3  # usual relative deviation of the normal load
_SHARE_OF_ENCODER = 0.3  # of the noise floor


@dataclass(frozen=True, eq=False)
class Recording:
    """What leads one recording, before its noise has a size; arrays of shape ``(n_samples,)``.

    Attributes:
        course: for the axis.
        white: unit noise for the force signal.
        shift: of the time at which a payload joins [s].
    """

    course: Course
    white: Array
    shift: float


def draw_recording(
    setting: Setting, known: Physics, duration: float, signals: frozenset[str], windows: bool, random: np.random.Generator,
    drawn: Callable[[Axis, float, np.random.Generator], Piece] = drawn_reference,
) -> Recording:  # fmt: skip
    """A recording of ``duration`` [s] whose feedforward believes the physics ``known``; its motions are ``drawn``."""
    h = setting.sample_time
    reference, push = drawn(setting.axis(setting.friction), duration, random)
    n = reference.shape[0]
    t = np.arange(n, dtype=np.float64) * h
    rate = np.gradient(reference, h)
    feedforward: Array = known.mass * np.gradient(rate, h) + 0.7 * known.coulomb * np.sign(rate) + known.viscous * rate
    load = 1.0 + _LOADED * _slow(t, random, 0.06, 0.35) if "normal_load" in signals else np.ones(n)
    warmer = _WARM * _slow(t, random, 0.02, 0.09) if "temperature" in signals else np.zeros(n)
    spans = np.zeros((0, 2))
    if windows:
        count = int(random.integers(4, 7))
        begin = np.sort(random.uniform(0.05, 0.9, count)) * duration
        spans = np.column_stack([begin, begin + random.uniform(0.5, 1.6, count)])
    course = Course(reference, feedforward + known.bias + push, load, warmer, spans, np.zeros(n))
    white: Array = random.standard_normal((n,))
    return Recording(course, white, float(random.uniform(-0.1, 0.15)) * duration)


def _slow(t: Array, random: np.random.Generator, lowest: float, highest: float) -> Array:
    """A slow random signal of about unit size, shape ``(n_samples,)``, never beyond 2.5."""
    tones, phase = random.uniform(lowest, highest, 3), random.uniform(0, 2 * np.pi, 3)
    return np.asarray(np.sum(np.sin(2 * np.pi * np.outer(t, tones) + phase), axis=1) / math.sqrt(1.5))


@dataclass(frozen=True, eq=False)
class Bench:
    """An axis with its recordings: physics in, motion and remainder out.

    Attributes:
        setting: the axis.
        train: recordings to fit.
        validation: the recording held back.
        resolution: of the encoder [m].
        force_noise: standard deviation [N].
        led: another hand that leads the axis, from physics, course, step of the encoder [m] and sampling time [s]; the usual
            loop if None.
    """

    setting: Setting
    train: tuple[Recording, ...]
    validation: Recording
    resolution: float
    force_noise: float = 0.0
    led: Callable[[Physics, Course, float, float], Run] | None = None
    _kept: dict[tuple[Physics, int], Run] = field(default_factory=dict, init=False, repr=False)

    def run(self, physics: Physics, recording: Recording) -> Run:
        """The axis with this physics on this recording; the last few are kept."""
        key = (physics, id(recording))
        if key not in self._kept:
            if len(self._kept) >= _KEPT:
                self._kept.pop(next(iter(self._kept)))
            self._kept[key] = self._new_run(physics, recording)
        return self._kept[key]

    def _new_run(self, physics: Physics, recording: Recording) -> Run:
        if physics.payload_time > 0.0:
            physics = physics.using({"payload_time": physics.payload_time + recording.shift})
        if self.led is None:
            found = integrate(physics, self._loop(), recording.course)
        else:
            found = self.led(physics, recording.course, self.resolution, self.setting.sample_time)
        if not np.all(np.isfinite(found.command)) or not np.ptp(found.seen) <= 3.0 * self.setting.travel:
            raise Unreachable("the axis escapes")
        if np.quantile(np.abs(np.diff(found.seen)), 0.99) == 0.0:
            raise Unreachable("the axis hardly moves")
        return found

    def _loop(self) -> Loop:
        at = self.setting
        proportional = at.physics.mass * at.bandwidth**2
        usual = at.friction + at.physics.mass * at.acceleration
        return Loop(proportional, 1.6 * at.physics.mass * at.bandwidth, 20.0 * usual, at.sample_time, self.resolution)

    def noise(self, recording: Recording) -> Array:
        """Of the recording's force signal [N]."""
        return self.force_noise * recording.white

    def remainder(self, physics: Physics, nominal: Nominal) -> Remainder:
        """What the refitted nominal structure leaves of the validation, without noise."""
        h = self.setting.sample_time
        train = [balance(self.run(physics, each), h, self.resolution) for each in self.train]
        return refit(nominal, train, balance(self.run(physics, self.validation), h, self.resolution))

    def floor(self, physics: Physics) -> float:
        """NOE of the noise alone on the validation [%]."""
        found = self.run(physics, self.validation)
        held = balance(found, self.setting.sample_time, self.resolution)
        return floor_of(found, held, self.noise(self.validation)[:-1], physics.mass, physics.viscous)

    def with_noise(self, physics: Physics, target: float) -> Bench:
        """The same bench with an encoder and a force noise that make a floor of about ``target`` [%]."""
        found = self.floor(physics)
        resolution = self.resolution * min(math.sqrt(_SHARE_OF_ENCODER * target / max(found, 1e-12)), 8.0)
        finer = replace(self, resolution=resolution)
        left = target - finer.floor(physics)
        if left <= 0.2 * target:
            raise Unreachable("the encoder alone is too noisy")
        once = replace(finer, force_noise=1.0)
        per_unit = once.floor(physics) - finer.floor(physics)
        return replace(finer, force_noise=math.sqrt(left / max(per_unit, 1e-300)))


def turned(
    strength: Callable[[float], float], target: float, tolerance: float, largest: float, enough: float = math.inf
) -> float:
    """The knob at which ``strength`` is within a factor ``tolerance`` of ``target``; at its end ``enough`` will do.

    Raises:
        Unreachable: no such knob was found.
    """
    knob, slope = 1.0, 2.0
    last: tuple[float, float] | None = None
    for _ in range(_TRIALS):
        try:
            found = math.log(max(strength(knob), 1e-9))
        except Unreachable:
            found = math.inf
        off = math.log(target) - found
        if abs(off) < math.log(tolerance):
            return knob
        if math.isinf(found):
            knob *= 0.4
            continue
        if last is not None and abs(math.log(knob) - last[0]) > 1e-9:
            measured = (found - last[1]) / (math.log(knob) - last[0])
            slope = min(max(measured, 0.4), 4.0)
        last = (math.log(knob), found)
        step = min(max(off / slope, -2.0), 2.0)
        wanted = min(knob * math.exp(step), largest)
        if wanted == knob:
            if found >= math.log(enough):
                return knob
            raise Unreachable("the knob is at its end")
        knob = wanted
    raise Unreachable("the strength wanted was not met")
