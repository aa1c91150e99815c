"""Settings of an excitation worth trying, from the declarations of its parameters and the limits alone.

No excitation is named here, so that a new one takes part by being there. A parameter's range follows from its dimension: a
length lies between what the position signal resolves, or what the model's own pre-sliding needs, and the travel there is; a
speed between the slowest that gets anywhere and the limit; an acceleration up to what the force gives the inertia. Numbers of
cycles and times go from a quarter to four times their default, lengths of whole runs (``duration``) take what there is.
Settings are drawn by a scrambled Sobol sequence over the logarithms, sorted where two are the ends of one range, and kept when
they can be planned within the limits.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from ...errors import InputError
from ...excitation_kind import Excitation
from ...model import Model
from ...parameter import Parameter
from ...record import Array
from .limits import Limits, Rig
from .trial import Choice

__all__ = ["Ranges", "draw", "moved", "ranges_of", "usable"]

_RESOLVED = 8.0  # times the noise of the position signal: the shortest motion worth planning
_MARGIN = 0.98  # of the limits that a plan may use: following it takes a little more
_LEAST_SHARE = 0.1  # of the time there is: shorter than that, a part is hardly worth a pause
_MOST_TRIES = 40  # draws per settings kept


@dataclass(frozen=True)
class Ranges:
    """Lowest and highest value worth trying, by dimension; see the module."""

    by_dimension: Mapping[str, tuple[float, float]]
    duration: float

    def of(self, parameter: Parameter) -> tuple[float, float] | None:
        """Range of a parameter, or None where its default is all there is."""
        default = float(parameter.default or 0.0)
        if parameter.name == "duration":
            return (self.duration, self.duration)
        if parameter.dimension == "1":
            if not _counts(parameter):
                return None
            low, high = max(parameter.lower, 0.25 * default), min(parameter.upper, 4.0 * default)
            return (max(low, 1.0), high)
        if parameter.dimension == "s":
            return (0.25 * default, 4.0 * default) if default > 0.0 else None
        low, high = self.by_dimension.get(parameter.dimension, (math.nan, math.nan))
        low, high = max(low, parameter.lower), min(high, parameter.upper)
        return (low, high) if low < high else None


def _counts(parameter: Parameter) -> bool:
    """True for a number of cycles and the like, which has no unit and starts at one."""
    return parameter.lower >= 1.0 and parameter.default is not None and float(parameter.default).is_integer()


def ranges_of(model: Model, limits: Limits, rig: Rig, duration: float) -> Ranges:
    """The ranges for a part of ``duration`` [s]."""
    resolved = _RESOLVED * max(rig.position_noise, rig.resolution, 1e-9 * limits.way)
    own = {dimension: [p.value for p in model.parameters() if p.declaration.dimension == dimension and p.value > 0.0]
           for dimension in ("F", "F/x", "x", "x/s")}  # fmt: skip
    # The way over which a force of the model builds up in a stiffness of the model, and its own lengths.
    ways = [force / stiffness for force in own["F"] for stiffness in own["F/x"]] + own["x"]
    shortest = max(min([0.3 * way for way in ways] + [1e-2 * limits.way]), resolved)
    slowest = max(min([0.1 * speed for speed in own["x/s"]] + [1e-2 * limits.speed]), shortest / duration)
    strongest = limits.push / model.plant.inertia(*model.plant_values)
    way, speed, push = _MARGIN * limits.way, _MARGIN * limits.speed, _MARGIN * limits.push
    fastest = 0.05 / rig.period
    by_dimension = {
        "x": (min(shortest, way), way),
        "x/s": (min(slowest, speed), speed),
        "x/s^2": (0.02 * strongest, 0.7 * strongest),
        "1/s": (1.0 / duration, fastest),
        "F": (0.05 * push, push),
        "F/x": (0.2 * push / way, 5.0 * push / way),
        "F s/x": (0.02 * push / speed, 0.5 * push / speed),
    }
    return Ranges(by_dimension, duration)


def usable(kind: Excitation) -> bool:
    """True for an excitation that needs nothing but numbers: no file to play from."""
    return all(text.default or text.choices for text in kind.texts)


def _values(kind: Excitation, ranges: Ranges, shares: Array) -> dict[str, float]:
    """Values at ``shares`` between 0 and 1 of the ranges' logarithms, shape ``(n_parameters,)``."""
    values: dict[str, float] = {}
    for parameter, share in zip(kind.parameters, shares.tolist(), strict=True):
        found = ranges.of(parameter)
        if found is None or parameter.default is None:
            values[parameter.name] = float(parameter.default or 0.0)
            continue
        low, high = found
        value = low * (high / low) ** share
        values[parameter.name] = float(round(value)) if _counts(parameter) else float(f"{value:.3g}")
    for name in [name for name in values if name.endswith("_low")]:
        other = name[: -len("low")] + "high"
        if other in values and values[name] > values[other]:
            values[name], values[other] = values[other], values[name]
    for parameter in kind.parameters:
        values[parameter.name] = min(max(values[parameter.name], parameter.lower), parameter.upper)
    return values


def _planned(kind: Excitation, values: Mapping[str, float], limits: Limits, duration: float) -> Choice | None:
    """The choice, when it can be planned within the limits and takes neither too long nor next to no time."""
    try:
        choice = Choice.of(kind, values)
    except (InputError, ZeroDivisionError, OverflowError):
        return None
    if not _LEAST_SHARE * duration <= choice.duration <= duration:
        return None
    if choice.output == "reference" and not hasattr(choice.plan, "force"):
        points = choice.plan.at(np.linspace(0.0, choice.duration, 2000))
        low, high = float(np.min(points.position)), float(np.max(points.position))
        # Some go to the positive side only: the limits, not the smaller side, count.
        fast = float(np.max(np.abs(points.velocity)))
        if low < limits.position[0] or high > limits.position[1] or fast > limits.speed:
            return None
    return choice


def draw(kinds: Sequence[Excitation], ranges: Ranges, limits: Limits, n_each: int, seed: int = 1) -> list[Choice]:
    """About ``n_each`` settings of each of ``kinds``, each planned within ``limits``."""
    found = []
    for number, kind in enumerate(kinds):
        if not usable(kind):
            continue
        sampler = qmc.Sobol(len(kind.parameters), seed=seed + number)
        kept: list[Choice] = []
        for shares in sampler.random_base2(math.ceil(math.log2(n_each * _MOST_TRIES))):
            choice = _planned(kind, _values(kind, ranges, shares), limits, ranges.duration)
            if choice is not None:
                kept.append(choice)
            if len(kept) == n_each:
                break
        found += kept
    return found


def moved(choice: Choice, ranges: Ranges, limits: Limits, steps: Array) -> Choice | None:
    """``choice`` with the logarithms of its values changed by ``steps``, ``(n_parameters,)``; None when not to be planned."""
    values = dict(choice.values)
    for parameter, step in zip(choice.kind.parameters, steps.tolist(), strict=True):
        found = ranges.of(parameter)
        if found is None or found[0] == found[1] or values[parameter.name] <= 0.0:
            continue
        value = min(max(values[parameter.name] * math.exp(step), found[0]), found[1])
        values[parameter.name] = float(round(value)) if _counts(parameter) else float(f"{value:.4g}")
    return _planned(choice.kind, values, limits, ranges.duration)
