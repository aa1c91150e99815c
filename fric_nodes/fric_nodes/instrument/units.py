"""Wrong unit or gear ratio: mass and friction that only fit the model when position or effort is off by a known factor.

With the position recorded s times too large, the mass seems s times too small, and the model's friction is to be taken at the
true speed v/s; with the effort g times too large all forces are. Every known factor and its inverse is tried for either
signal; the value is the factor that fits. Without a model, a reference tells the unit of the position relative to its own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from .check import Check, Correction, Evidence, Finding, each
from .position_sign import agreement, turned
from .view import View, friction_along

__all__ = ["CHECK", "name_of"]

_FACTORS: dict[str, float] = {
    "milli or kilo": 1000.0,
    "per cent": 100.0,
    "micro": 1e6,
    "2 pi (turns and radians)": 2.0 * math.pi,
    "180/pi (degrees and radians)": 180.0 / math.pi,
    "60 (minutes and seconds)": 60.0,
    "9.81 (kilogram-force and newton)": 9.80665,
    "60/(2 pi) (1/min and rad/s)": 30.0 / math.pi,
}
_WRONG = math.log(2.5)  # a model may be off by this much without a unit being to blame
_NEAR = math.log(1.45)
_ALONE = math.log(30.0)  # by which friction alone, without the mass, speaks for a wrong unit
_FOLLOWS = 0.95  # correlation with a reference that is followed


def name_of(factor: float, settings: Mapping[str, float]) -> str:
    """The known factors that ``factor`` or its inverse is near to, in words; empty when there is none."""
    known = _FACTORS | ({"the gear ratio": settings["gear_ratio"]} if "gear_ratio" in settings else {})
    near = {name: abs(abs(math.log(factor)) - abs(math.log(value))) for name, value in known.items()}
    best = min(near.values())
    return " or ".join(name for name, off in near.items() if off < min(best + 0.06, _NEAR))


def _judge(view: View, evidence: Evidence) -> Finding:
    if not view.moves:
        return Finding("units", "unknown", "it does not move")
    scale = _reference_scale(view)
    if scale is not None and abs(math.log(scale)) > _WRONG:
        return _of("position", scale, evidence, "the reference")
    friction, error, speed = friction_along(view)
    if evidence.model is None:
        detail = "the position has the scale of the reference; the effort's can't be judged without a model"
        return Finding("units", "ok" if scale is not None else "unknown", detail if scale is not None else "there is no model")
    if not friction > 4.0 * error:
        return Finding("units", "unknown", "the effort shows no friction to hold against the model")
    found = view.balance
    seen = found.value("mass") > 4.0 * found.error("mass") and found.part("mass") > 2.0 * found.residual
    mass = found.value("mass") if seen else math.nan

    def off(position: float, effort: float) -> float:
        """How far the model is from what was seen, were the signals off by these factors."""
        expected = effort * evidence.friction(speed / position)
        parts = [abs(math.log(friction / expected))] if expected > 0.0 else []
        if seen:
            parts.append(abs(math.log(mass * position / (effort * evidence.inertia))))
        return max(parts, default=math.inf)

    plain = off(1.0, 1.0)
    if plain <= _WRONG:
        detail = f"mass and friction are the model's within a factor of {math.exp(plain):.2g}"
        return Finding("units", "ok", detail, 1.0, "1")
    if not math.isfinite(plain):
        return Finding("units", "unknown", "the model has no friction to hold against")
    gear = [evidence.settings["gear_ratio"]] if "gear_ratio" in evidence.settings else []
    tries = [f for value in (*_FACTORS.values(), *gear) for f in (value, 1.0 / value)]
    effort_off = min(off(1.0, g) for g in tries)
    position_off = min(off(s, 1.0) for s in tries) if seen else math.inf
    # Friction alone may well be several times what a model has; a unit is to blame when the mass says the same.
    credible = seen or plain > _ALONE
    if credible and min(effort_off, position_off) < min(_NEAR, 0.5 * plain):
        if effort_off <= position_off:
            return _of("effort", friction / evidence.friction(speed), evidence, "the model")
        return _of("position", evidence.inertia / mass, evidence, "the model")
    detail = f"mass or friction is off the model by a factor of {math.exp(plain):.3g}, and no known unit or ratio explains it"
    return Finding(
        "units", "warning", detail, math.exp(plain), "1", remedy="check the model's values, the units and the gear ratio"
    )


def _of(signal: str, factor: float, evidence: Evidence, by: str) -> Finding:
    name = name_of(factor, evidence.settings)
    detail = f"the {signal} is {factor:.4g} times what {by} expects" + (f": suspected is {name}" if name else "")
    remedy = f"state the unit of the {signal}, or its scale, in the import's mapping"
    exact = _exact(factor, evidence.settings)
    correction = Correction(position_factor=1.0 / exact) if signal == "position" else Correction(effort_factor=1.0 / exact)
    return Finding("units", "fault", detail, factor, "1", remedy=remedy, correction=correction)


def _exact(factor: float, settings: Mapping[str, float]) -> float:
    """The known factor nearest to ``factor``; itself where none is near."""
    values = [*_FACTORS.values(), *([settings["gear_ratio"]] if "gear_ratio" in settings else [])]
    best = min((v for value in values for v in (value, 1.0 / value)), key=lambda v: abs(math.log(factor / v)))
    return best if abs(math.log(factor / best)) < _NEAR else factor


def _reference_scale(view: View) -> float | None:
    """Position over reference; None where there is none or they don't go together."""
    if view.even.reference is None or turned(view)[0] is not False:
        return None
    rate = np.gradient(view.low_pass(view.even.reference), view.h)
    if agreement(view, rate) < _FOLLOWS:
        return None
    wanted = rate[view.usable]
    size = float(np.sum(wanted**2))
    if size == 0.0:
        return None
    return float(np.sqrt(np.sum(view.velocity[view.usable] ** 2) / size))


CHECK = Check("units", "units and gear ratio", "a model, or a reference", each(_judge))
