"""The examiner's axis in the words of fric: the nominal model that is handed out, and the structure that would be right.

Only names and values cross over here; what they do is written twice, in ``effects/`` and in
:mod:`fric.diagnosis.prove.laws`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping

import numpy as np

from ...model import Model, Term, build_model, term
from .physics import Physics

__all__ = ["nominal_model", "true_model"]


def _known_terms(physics: Physics, parts: Iterable[str]) -> list[Term]:
    made: dict[str, Callable[[], Term]] = {
        "coulomb": lambda: term("coulomb", force=physics.coulomb),
        "viscous": lambda: term("viscous", coefficient=physics.viscous),
        "bias": lambda: term("bias", force=physics.bias),
        "stribeck": lambda: term("stribeck", force=physics.stribeck, velocity=physics.stribeck_velocity),
        "presliding": lambda: _bristle(physics),
    }
    return [made[part]() for part in parts]


def _bristle(physics: Physics) -> Term:
    return term(
        "presliding", "lugre", stiffness=physics.coulomb / physics.displacement, damping=max(physics.presliding_damping, 0.0)
    )


def nominal_model(
    physics: Physics, parts: tuple[str, ...], nominal: Mapping[str, float], random: np.random.Generator
) -> tuple[Model, Model]:
    """The nominal structure with its true values, and the same with every value off by 5 to 40 %."""
    mass = {"mass": physics.mass + physics.appendage}
    exact = build_model("rigid", mass, _known_terms(physics, parts), nominal=dict(nominal))
    size = random.uniform(0.05, 0.4, exact.values.shape[0]) * random.choice([-1.0, 1.0], exact.values.shape[0])
    values = exact.values * (1.0 + size)
    shapes = np.array([parameter.declaration.shape for parameter in exact.parameters()])
    values[shapes] = exact.values[shapes]
    return exact, exact.with_values(values)


def true_model(physics: Physics, parts: tuple[str, ...], concealed: Iterable[str], nominal: Mapping[str, float]) -> Model:
    """The nominal structure with the concealed effects, in the form of fric's usual law, at the true values.

    Where the truth has another form, the values are those of the law that comes closest.
    """
    p = physics
    terms = _known_terms(p, parts)
    plant = {"mass": p.mass}
    for effect in concealed:
        terms.append(_concealed_term(effect, p))
    if p.load_share > 0.0:
        plant["load_share"] = p.load_share
    return build_model("rigid", plant, terms, nominal=dict(nominal))


def _concealed_term(effect: str, p: Physics) -> Term:
    if effect in ("coulomb", "viscous", "bias", "stribeck"):
        return _known_terms(p, [effect])[0]
    if effect == "presliding":
        return term("presliding", "lugre", stiffness=max(p.coulomb, 1e-9) / p.displacement, damping=p.presliding_damping)
    if effect == "compliance":
        if p.appendage > 0.0:
            return term(effect, "appendage", mass=p.appendage, frequency=p.appendage_frequency, damping=p.appendage_damping)
        return term(effect, "linear", stiffness=p.shaft, damping=p.shaft_damping)
    return _MADE[effect](p)


def _position_dependence(p: Physics) -> Term:
    if p.spot:
        return term("position_dependence", "local", amplitude=p.spot, position=p.spot_position, width=p.spot_width)
    return term("position_dependence", "periodic", cosine=p.wave_cosine, sine=p.wave_sine, period=p.wave_period)


def _time_drift(p: Physics) -> Term:
    if p.drift_time:
        return term("time_drift", "exponential", change=p.drift, time=p.drift_time)
    return term("time_drift", "linear", rate=p.drift)


def _dwell_time(p: Physics) -> Term:
    law = {1.0: "logarithmic", 3.0: "hyperbolic"}.get(p.dwell_form, "exponential")
    return term("dwell_time", law, force=p.dwell, time=p.dwell_time, length=p.dwell_length)


def _shear_thinning(p: Physics) -> Term:
    if p.shear_form == 1.0:
        return term("shear_thinning", "power", force=0.5 * p.shear / p.shear_velocity ** (2.0 / 3.0))
    return term("shear_thinning", force=p.shear, velocity=p.shear_velocity)


def _gear_friction(p: Physics) -> Term:
    if p.gear_form == 1.0:
        return term("gear_friction", "directional", driving=p.gear, driven=p.gear_driven)
    return term("gear_friction", coefficient=p.gear)


_MADE: Mapping[str, Callable[[Physics], Term]] = {
    "quadratic_drag": lambda p: term("quadratic_drag", coefficient=p.drag),
    "shear_thinning": _shear_thinning,
    "gear_friction": _gear_friction,
    "asymmetry": lambda p: term("asymmetry", force=p.asymmetry, coefficient=p.asymmetry_viscous),
    "frictional_lag": lambda p: term("frictional_lag", "delay" if p.lag == 3.0 else "first_order", time=p.lag_time),
    "dwell_time": _dwell_time,
    "load_dependence": lambda p: term("load_dependence", "scaling", coefficient=p.load),
    "position_dependence": _position_dependence,
    "time_drift": _time_drift,
    "temperature": lambda p: term("temperature", level_change=p.temperature, viscous_change=p.temperature_viscous),
    "accel_hysteresis": lambda p: term("accel_hysteresis", force=p.acceleration, velocity=p.acceleration_velocity),
    "ripple": lambda p: term("ripple", cosine=p.ripple_cosine, sine=p.ripple_sine, period=p.ripple_period),
    "backlash": lambda p: term("backlash", gap=p.gap),
    "impact_backlash": lambda p: term("impact_backlash", gap=p.gap, stiffness=p.stop_stiffness, damping=p.stop_damping),
    "stiffness": lambda p: term("stiffness", stiffness=p.stiffness, position=p.stiffness_position),
    "nonlinear_stiffness": lambda p: term("nonlinear_stiffness", stiffness=p.cubic, position=p.cubic_position),
    "actuator_lag": lambda p: term("actuator_lag", time=p.actuator_time),
    "delay": lambda p: term("delay", time=p.delay),
    "saturation": lambda p: term("saturation", limit=p.limit),
    "input_deadzone": lambda p: term("input_deadzone", width=p.dead_zone),
    "gain_ripple": lambda p: term("gain_ripple", sine=p.gain_ripple, period=p.gain_ripple_period),
}


def relative_errors(exact: Model, given: Model) -> dict[str, float]:
    """By how much each nominal value is off [%]."""
    pairs = zip(exact.names, exact.values.tolist(), given.values.tolist(), strict=True)
    return {name: 100.0 * (value / true - 1.0) if true else math.nan for name, true, value in pairs}
