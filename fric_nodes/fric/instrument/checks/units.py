"""Wrong unit or gear ratio: mass and friction that only fit the model when position or effort is off by a factor.

With the position recorded s times too large, the mass seems s times too small, and the model's friction is to be taken at the
true speed v/s; with the effort g times too large all forces are. The factor is estimated, and not picked from a list: log g is
the mean of the estimates from mass and friction, each weighted by its variance (its standard error, and how well a model's
value is known), with a 95 % interval. A known factor is named only where it lies inside that interval. Mass and friction have
to agree, and the force that the balance leaves unexplained must not be able to make the difference: a limit of the drive, or
friction that follows the force, makes both seem larger, too. A unit is the same while the effort drives the axis and while it
brakes it; friction that follows the force isn't. Without a mass that shows, friction alone must be far off. Without a model, a
reference tells the unit of the position relative to its own: the factor lies between the two regressions, of either signal on
the other.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..check import Check, Correction, Evidence, Finding, each
from ..view import View, balance_on, friction_along
from .position_sign import agreement, turned

__all__ = ["CHECK", "named"]

_FACTORS: dict[str, float] = {
    "milli or kilo, or 0.1 % of a rated value": 1000.0,
    "per cent": 100.0,
    "micro": 1e6,
    "2 pi (turns and radians)": 2.0 * math.pi,
    "180/pi (degrees and radians)": 180.0 / math.pi,
    "60 (minutes and seconds)": 60.0,
    "9.81 (kilogram-force and newton)": 9.80665,
    "60/(2 pi) (1/min and rad/s)": 30.0 / math.pi,
    "4 (quarter counts of an encoder)": 4.0,
}
_WRONG = math.log(2.5)  # a model may be off by this much without a unit being to blame
_AGREE = math.log(1.45)  # mass and friction on the factor
_ALONE = math.log(30.0)  # by which friction alone, without the mass, speaks for a wrong unit
_FOLLOWS = 0.95  # correlation with a reference that is followed
# How well a model's values are known: a mass from drawings to a tenth, friction changes by a third with warmth and lubricant.
_MASS_KNOWN, _FRICTION_KNOWN = 0.1, 0.3
_QUANTILE = 1.96
_OTHERS = {
    "effort": "a current without its torque constant, a gear ratio, or another scale: none of the usual factors fits",
    "position": "counts of an encoder, a gear ratio, or another scale: none of the usual factors fits",
}


class _Factor(NamedTuple):
    """A factor with its 95 % interval, and by how much (log) the evidence for it disagrees."""

    value: float
    low: float
    high: float
    apart: float


def _known(settings: Mapping[str, float]) -> dict[str, float]:
    return _FACTORS | ({"the gear ratio": settings["gear_ratio"]} if "gear_ratio" in settings else {})


def named(low: float, high: float, settings: Mapping[str, float]) -> str:
    """The known factors that, or whose inverse, lie from ``low`` to ``high``, in words; empty when there is none."""
    inside = [name for name, value in _known(settings).items() if low <= value <= high or low <= 1.0 / value <= high]
    return " or ".join(inside)


def _mean(estimates: list[tuple[float, float]]) -> _Factor:
    """Of logarithms with their standard deviations."""
    weights = np.array([1.0 / deviation**2 for _, deviation in estimates])
    logs = np.array([value for value, _ in estimates])
    middle, half = float(weights @ logs / np.sum(weights)), _QUANTILE / math.sqrt(float(np.sum(weights)))
    return _Factor(math.exp(middle), math.exp(middle - half), math.exp(middle + half), float(np.ptp(logs)))


def _judge(view: View, evidence: Evidence) -> Finding:
    if not view.moves:
        return Finding("units", "unknown", "it does not move")
    scale = _reference_scale(view)
    if scale is not None and abs(math.log(scale.value)) > _WRONG:
        return _of("position", scale, evidence, "the reference", view)
    friction, error, speed = friction_along(view)
    if evidence.model is None:
        detail = "the position has the scale of the reference; the effort's can't be judged without a model"
        return Finding("units", "ok" if scale is not None else "unknown", detail if scale is not None else "there is no model")
    if not friction > 4.0 * error:
        return Finding("units", "unknown", "the effort shows no friction to compare with the model")
    if not evidence.friction(speed) > 0.0:
        return Finding("units", "unknown", "the model has no friction to compare with")
    mass, mass_error = view.balance.value("mass"), view.balance.error("mass")
    seen = view.balance.shows("mass")
    by_mass = [(math.log(mass / evidence.inertia), math.hypot(mass_error / mass, _MASS_KNOWN))] if seen else []
    spread = math.hypot(error / friction, _FRICTION_KNOWN)
    effort = _mean([*by_mass, (math.log(friction / evidence.friction(speed)), spread)])
    plain = max(abs(value) for value, _ in (*by_mass, (math.log(friction / evidence.friction(speed)), spread)))
    if plain <= _WRONG:
        detail = f"mass and friction are the model's within a factor of {math.exp(plain):.2g}"
        return Finding("units", "ok", detail, 1.0, "1")
    # Friction alone may well be several times what a model has; a unit is to blame when the mass says the same.
    if seen or plain > _ALONE:
        candidates = [("effort", effort)]
        if seen:
            candidates.append(("position", _position(by_mass[0], friction, speed, evidence)))
        signal, factor = min(candidates, key=lambda each: each[1].apart)
        # What is unexplained may be friction that the balance doesn't have: the factor is known no better than that.
        unexplained = math.log1p(view.balance.residual / friction)
        if max(factor.apart, unexplained, abs(_braking(view))) < min(_AGREE, 0.5 * plain):
            return _of(signal, factor, evidence, "the model", view)
    detail = f"mass or friction differs from the model by a factor of {math.exp(plain):.3g}, and no single factor explains it"
    if _braking(view) > _AGREE:
        detail += (
            f": driving takes {math.exp(_braking(view)):.2g} times the mass that braking takes, as with friction of a gear"
        )
    return Finding(
        "units", "warning", detail, math.exp(plain), "1", remedy="check the model's values, the units and the gear ratio"
    )


def _braking(view: View) -> float:
    """Logarithm of the mass while the effort drives the axis over that while it brakes it; 0 where braking shows no mass.

    A wrong unit is the same both ways.
    """
    power = view.effort * view.velocity
    driving, braking = (balance_on(view, np.flatnonzero(view.sliding & each)) for each in (power > 0.0, power < 0.0))
    if not (driving.shows("mass") and braking.shows("mass")):
        return 0.0
    return math.log(driving.value("mass") / braking.value("mass"))


def _position(by_mass: tuple[float, float], friction: float, speed: float, evidence: Evidence) -> _Factor:
    """The position's factor by the mass, and how far the friction at the true speed is from the model's then."""
    factor = _mean([(-by_mass[0], by_mass[1])])
    expected = evidence.friction(speed / factor.value)
    return factor._replace(apart=abs(math.log(friction / expected)) if expected > 0.0 else math.inf)


def _of(signal: str, factor: _Factor, evidence: Evidence, by: str, view: View) -> Finding:
    name = named(factor.low, factor.high, evidence.settings)
    units = view.record.units
    per = f" ({1.0 / factor.value:.4g} {units.force if signal == 'effort' else units.position} per unit of it)"
    detail = f"the {signal} is {factor.value:.4g} times that of {by}"
    detail += f": a likely reason is {name}" if name else f"{per}: {_OTHERS[signal]}"
    remedy = f"state the unit of the {signal}, or its scale, in the import's mapping"
    exact = _exact(factor, evidence.settings)
    correction = Correction(position_factor=1.0 / exact) if signal == "position" else Correction(effort_factor=1.0 / exact)
    interval = (factor.low, factor.high)
    return Finding("units", "fault", detail, factor.value, "1", interval, remedy, correction=correction)


def _exact(factor: _Factor, settings: Mapping[str, float]) -> float:
    """The known factor in the interval, the nearest where there are several; the estimate itself where there is none."""
    values = [f for value in _known(settings).values() for f in (value, 1.0 / value) if factor.low <= f <= factor.high]
    return min(values, key=lambda value: abs(math.log(factor.value / value)), default=factor.value)


def _reference_scale(view: View) -> _Factor | None:
    """Position over reference; None where there is none or they don't go together."""
    if view.even.reference is None or turned(view)[0] is not False:
        return None
    rate = np.gradient(view.low_pass(view.even.reference), view.h)
    alike = agreement(view, rate)
    if alike < _FOLLOWS:
        return None
    wanted = rate[view.usable]
    size = float(np.sum(wanted**2))
    if size == 0.0:
        return None
    scale = float(np.sqrt(np.sum(view.velocity[view.usable] ** 2) / size))
    return _Factor(scale, scale * alike, scale / alike, 0.0)


CHECK = Check("units", "units and gear ratio", "a model, or a reference", each(_judge))
