"""What a diagnosis tries: every effect of the registry, with values that the recording makes sensible.

A trial is a term with definite values. Those of its parameters that say how strong it is
(:attr:`fric.effect.Effect.amplitudes`) get a small value when the force is linear in them, so that one column tells their
best value, and a grid otherwise; the others get grids by their dimension: a velocity between rest and the fastest motion, a
stiffness from the friction level over the distances of the travel, or from the frequencies that the recording holds. Nothing
here knows an effect by its name.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..effect import Effect, Place
from ..model import ENCODERS, Model, Term
from ..parameter import Parameter
from ..plants import PLANTS
from ..record import Array
from .motion import smooth
from .track import Track
from .worth_trying import worth_trying

__all__ = [
    "FRICTION",
    "Candidate",
    "Scales",
    "candidates",
    "closer",
    "fewest_cycles",
    "scales_of",
    "trials_of",
    "values_to_try",
]

FRICTION = "guideway friction"
"""The component that rubs."""

_SMALL = 0.1  # of the friction level, the size of a linear effect in a trial
_DAMPED = 0.1  # damping ratio of a mode that fades within a few periods
_MOST_PERIODS = 24.0


@dataclass(frozen=True)
class Scales:
    """What the recording holds, for values to try.

    Attributes:
        level: typical force at motion [F].
        range: of the force [F].
        most: largest force [F].
        speed: fast motion [x/s].
        slow: the slowest motion that is told from rest [x/s].
        low: lowest position [x].
        high: highest position [x].
        duration: of all recordings [s].
        step: between samples [s].
        mass: moving mass [F s^2/x].
        temperature: spread of the temperature [K].
        grain: smallest distance that the sensor tells [x].
        fastest: highest frequency that the observer passes [Hz].
    """

    level: float
    range: float
    most: float
    speed: float
    slow: float
    low: float
    high: float
    duration: float
    step: float
    mass: float
    temperature: float
    grain: float
    fastest: float

    @property
    def travel(self) -> float:
        """From the lowest to the highest position [x]."""
        return max(self.high - self.low, 1e-12)


@lru_cache(maxsize=8)
def scales_of(track: Track) -> Scales:
    """The scales of a track."""
    runs = track.runs
    step = float(np.median(np.concatenate([run.step for run in runs])))
    speed = np.concatenate([np.gradient(smooth(run.position, step, 2.0 * track.bandwidth), step) for run in runs])
    effort = np.concatenate([run.effort for run in runs])
    position = np.concatenate([run.position for run in runs])
    temperature = np.concatenate([run.temperature for run in runs])
    fast = max(float(np.quantile(np.abs(speed), 0.98)), 1e-12)
    noise = max(track.noise)
    moving = np.abs(speed) > 0.02 * fast
    return Scales(
        level=max(float(np.median(np.abs(effort[moving]))), 1e-12),
        range=max(float(np.ptp(effort)), 1e-12),
        most=float(np.quantile(np.abs(effort), 0.999)),
        speed=fast,
        slow=max(1e-3 * fast, noise * track.bandwidth),
        low=float(np.min(position)),
        high=float(np.max(position)),
        duration=float(sum(np.sum(run.step) for run in runs)),
        step=step,
        mass=track.mass,
        temperature=max(float(np.ptp(temperature)), 1e-12),
        grain=max(noise, 1e-6 * float(np.ptp(position))),
        fastest=min(2.0 * track.bandwidth / (2.0 * math.pi) * 2.0, 0.25 / step),
    )


@dataclass(frozen=True, eq=False)
class Candidate:
    """One effect and the terms to try.

    Attributes:
        effect: what may be missing.
        trials: terms with values; for each trial one column per linear amplitude, or one for the whole term.
    """

    effect: Effect
    trials: tuple[Term, ...]


def candidates(model: Model, scales: Scales) -> list[Candidate]:
    """Every effect that ``model`` could get, with terms to try."""
    present = {held.effect.id for held in model.terms}
    play = any(held.effect.play is not None for held in model.terms)
    has_level = any(held.effect.level is not None for held in model.terms)
    found = []
    for effect in worth_trying():
        if effect.id in present and not effect.repeatable:
            continue
        if effect.slip is not None and model.has_slip_dynamics:
            continue
        if (effect.link is not None or effect.play is not None) and PLANTS[model.plant.id].driven is None:
            continue
        if model.plant.led and (effect.place in (Place.COMMAND_PATH, Place.TRANSMISSION) or effect.uses_push):
            continue  # the force is measured behind all of them
        if play and (effect.link is None) != (effect.play is None):
            continue  # a spring beyond a play is the same as elastic stops, and one play is enough
        if effect.level is not None and effect.remember is not None and not has_level:
            continue  # what friction gains at rest, or follows late, is relative to a level
        trials = trials_of(effect, scales)
        if effect.play is not None and model.encoder != ENCODERS[0]:
            trials = tuple(closer(trials))
        if play and effect.link is not None:
            trials = tuple(_stops(trials[0], scales))
        if trials:
            found.append(Candidate(effect, trials))
    return found


def trials_of(effect: Effect, scales: Scales) -> tuple[Term, ...]:
    """Terms of ``effect`` with all the values that a recording of these ``scales`` suggests."""
    return tuple(Term(effect, values) for values in _values(effect, scales))


def closer(trials: Sequence[Term]) -> Iterator[Term]:
    """``trials``, and one in the geometric middle of each two.

    Where the load is measured, the motor crosses a play unseen. When it arrives is all that tells the play: what is a little
    too wide, or too narrow, lacks as much as none. So does a spring that swings at the wrong times.
    """
    yield trials[0]
    for before, after in itertools.pairwise(trials):
        yield Term(after.effect, tuple(math.sqrt(one * other) for one, other in zip(before.values, after.values, strict=True)))
        yield after


def _stops(held: Term, scales: Scales) -> Iterator[Term]:
    """Elastic stops at the ends of a play that the model has already: hardly any more play, from soft to hard."""
    names = [parameter.name for parameter in held.effect.parameters]
    for rate in 2.0 * math.pi * np.geomspace(8.0, 2.0 * scales.fastest, 8):
        values = list(held.values)
        for name, parameter in zip(names, held.effect.parameters, strict=True):
            if parameter.dimension == "x":
                values[names.index(name)] = max(3.0 * scales.grain, 1e-5 * scales.travel)
            if parameter.dimension == "F/x":
                values[names.index(name)] = 0.25 * scales.mass * float(rate) ** 2
        yield Term(held.effect, tuple(_with_damping(held.effect, values, scales)))


def _values(effect: Effect, scales: Scales) -> Iterator[tuple[float, ...]]:
    grids = [values_to_try(effect, parameter, scales) for parameter in effect.parameters]
    for values in itertools.product(*grids):
        yield tuple(_with_damping(effect, values, scales))


def _with_damping(effect: Effect, values: Sequence[float], scales: Scales) -> list[float]:
    """A spring's damper in proportion to it: a bare one would ring for ever.

    Stops that hardly ring let a fit find their stiffness: what rings, rings at the wrong times until that is known.
    """
    result = list(values)
    names = [parameter.dimension for parameter in effect.parameters]
    if "F/x" in names and "F s/x" in names and effect.force is None:
        share = 0.5 if effect.slip is not None else 0.3 if effect.play is not None else 0.05
        result[names.index("F s/x")] = 2.0 * share * math.sqrt(result[names.index("F/x")] * 0.25 * scales.mass)
    return result


def values_to_try(effect: Effect, parameter: Parameter, scales: Scales) -> Sequence[float]:
    """Values of a parameter of ``effect`` that a recording of these ``scales`` suggests; a small one for a linear strength."""
    if parameter.name in effect.amplitudes:
        return _amplitudes(parameter, scales)
    if parameter.name == "damping" and parameter.dimension == "1" and parameter.default is not None:
        # What rings long in a trial soon has another phase than the machine's; what hardly rings tells less where it fits.
        return (parameter.default, _DAMPED)
    if parameter.shape or (parameter.default is not None and parameter.dimension not in ("x", "s")):
        assert parameter.default is not None
        return (parameter.default,)
    return [float(value) for value in _of_dimension(effect, parameter, scales) if parameter.refusal(float(value)) is None]


def _amplitudes(parameter: Parameter, scales: Scales) -> Sequence[float]:
    force = _SMALL * scales.level
    linear = {
        "F": force,
        "F s/x": force / scales.speed,
        "F s^2/x^2": force / scales.speed**2,
        "F/x": force / scales.travel,
        "F/x^3": 8.0 * force / scales.travel**3,
        "F s^2/x": _SMALL * scales.mass,
        "F s/x/K": force / scales.speed / scales.temperature,
        "1": _SMALL,
        "1/s": _SMALL / scales.duration,
        "1/K": _SMALL / scales.temperature,
    }
    if parameter.linear or parameter.dimension not in ("F", "s"):
        return (linear[parameter.dimension],)
    if parameter.dimension == "s":
        return [float(value) for value in np.geomspace(0.5 * scales.step, 40.0 * scales.step, 6)]
    if parameter.positive:
        return [share * scales.most for share in (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.88, 0.95)]  # a limit
    return [share * scales.level for share in (0.05, 0.15, 0.4)]


def _of_dimension(effect: Effect, parameter: Parameter, scales: Scales) -> Array:
    dimension = parameter.dimension
    if dimension == "x/s":
        return np.geomspace(max(3.0 * scales.slow, 3e-3 * scales.speed), scales.speed, 7)
    if dimension == "s":
        return np.geomspace(5.0 * scales.step, 0.5 * scales.duration, 10)
    if dimension == "1/s":
        return np.geomspace(2.5, scales.fastest, 14)
    if dimension == "F/x":
        if effect.slip is not None:
            return np.asarray(scales.level / np.geomspace(max(scales.grain, 1e-5 * scales.travel), 0.3 * scales.travel, 9))
        if effect.play is not None:
            return np.array([0.25 * scales.mass * (4.0 * math.pi * scales.fastest) ** 2])
        return np.asarray(0.25 * scales.mass * (2.0 * math.pi * np.geomspace(4.0, scales.fastest, 6)) ** 2)
    if dimension == "F/x^3":
        return np.asarray([scales.level / (0.01 * scales.travel) ** 3])
    if dimension == "x":
        return _lengths(effect, parameter, scales)
    return np.array([1.0])


def fewest_cycles(effect: Effect) -> float:
    """Cycles over the travel from which on something periodic is what it is called.

    Friction may rise along the travel and no more; a force that isn't seen to repeat is a spring.
    """
    return 0.5 if effect.level is not None else 1.0


def _lengths(effect: Effect, parameter: Parameter, scales: Scales) -> Array:
    if parameter.name == "period":
        # Evenly spaced in cycles over the travel, as near as two can be told apart.
        return np.asarray(scales.travel / np.arange(fewest_cycles(effect), _MOST_PERIODS + 0.25, 0.5))
    if not parameter.positive and parameter.lower < 0.0:
        if parameter.default is not None:
            # Where the sensor counts from may be far from the travel: there a spring would be nothing but an offset.
            within = scales.low <= parameter.default <= scales.high
            return np.array([parameter.default if within else 0.5 * (scales.low + scales.high)])
        return np.linspace(scales.low, scales.high, 13)[1:-1]
    if parameter.name == "gap":
        return np.geomspace(max(3.0 * scales.grain, 1e-5 * scales.travel), 0.03 * scales.travel, 10)
    if parameter.name == "length":
        return np.geomspace(max(10.0 * scales.grain, 1e-4 * scales.travel), 0.03 * scales.travel, 5)  # contacts creep little
    return scales.travel * np.geomspace(0.01, 0.2, 3)


def place_of(effect: Effect) -> str:
    """The component in a technician's words."""
    words = {
        Place.COMMAND_PATH: "command path",
        Place.TRANSMISSION: "transmission",
        Place.SLIP_LEVEL: FRICTION,
        Place.SLIP_DYNAMICS: FRICTION,
        Place.FORCE: "load",
        Place.SENSOR: "sensor",
    }
    return words[effect.place]
