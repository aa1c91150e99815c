"""What the examiner can conceal: every effect of the vocabulary, in more than one form, with a knob for its strength.

An entry says what the nominal structure must know for the effect to have a meaning (a lag needs a Stribeck curve to lag
behind), what it must not know, which signals are recorded with it, and how its numbers follow from the axis, chance and the
knob ``s``; ``s`` = 1 is a first guess, and strength grows with it. ``form`` 0 is the form in which fric's own candidate
writes the law, others are of the same mechanism in another form, and ``foreign`` ones in a form that none of fric's laws has.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from .axis import Setting

__all__ = ["CONCEALED", "Changes", "Concealed", "clash"]

Changes = Mapping[str, "float | tuple[tuple[float, float], ...]"]
Maker = Callable[[Setting, np.random.Generator, int], Callable[[float], Changes]]


@dataclass(frozen=True)
class Concealed:
    """One effect that a case can conceal.

    Attributes:
        effect: id of the vocabulary.
        make: from the axis, chance and a form to the numbers as a function of the knob; everything random is drawn once.
        forms: number of forms.
        foreign: forms, beyond these or among them, for which fric has no law.
        needs: parts that the nominal structure must have.
        lacks: parts that neither it nor the axis may have.
        signals: recorded besides (``normal_load``, ``temperature``).
        group: effects of one group can't be in one pair: they take the same place or hide each other on any motion.
        largest: of the knob.
    """

    effect: str
    make: Maker
    forms: int = 1
    foreign: tuple[int, ...] = ()
    needs: frozenset[str] = frozenset()
    lacks: frozenset[str] = frozenset()
    signals: tuple[str, ...] = ()
    group: str = ""
    largest: float = 30.0


def clash(first: Concealed, second: Concealed) -> bool:
    """True where the two can't be concealed together."""
    return bool(
        first.effect == second.effect
        or (first.group and first.group == second.group)
        or first.needs & second.lacks
        or second.needs & first.lacks
        or (first.effect == "coulomb" and _on_coulomb(second))
        or (second.effect == "coulomb" and _on_coulomb(first))
        or {first.effect, second.effect} == {"bias", "stiffness"}  # which are one spring with another neutral position
    )


def _on_coulomb(entry: Concealed) -> bool:
    """True for what changes a Coulomb friction, and alone is nothing."""
    return entry.group in ("low speed", "scale", "slip") or entry.effect in ("position_dependence", "time_drift")


def _sign(random: np.random.Generator) -> float:
    return 1.0 if random.random() < 0.5 else -1.0


def _spread(random: np.random.Generator, low: float, high: float) -> float:
    return float(math.exp(random.uniform(math.log(low), math.log(high))))


def _coulomb(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    return lambda s: {"coulomb": 0.3 * s * at.friction}


def _viscous(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    return lambda s: {"viscous": 0.4 * s * at.friction / at.top_speed}


def _bias(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    sign = _sign(random)
    return lambda s: {"bias": 0.3 * s * sign * at.friction}


def _quadratic_drag(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    return lambda s: {"drag": 1.5 * s * at.friction / at.top_speed**2, "drag_form": float(form), "drag_velocity": at.top_speed}


def _shear_thinning(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    velocity = at.top_speed * _spread(random, 0.03, 0.15)
    return lambda s: {"shear": 0.5 * s * at.friction, "shear_velocity": velocity, "shear_form": float(form)}


def _gear_friction(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    driven = float(random.uniform(0.2, 0.6))  # of what driving costs
    return lambda s: {"gear": min(0.2 * s, 0.7), "gear_driven": driven * min(0.2 * s, 0.7), "gear_form": float(form)}


def _stribeck(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    velocity = at.top_speed * _spread(random, 0.015, 0.06)
    return lambda s: {"stribeck": 0.5 * s * at.friction, "stribeck_velocity": velocity, "stribeck_form": float(form)}


def _asymmetry(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    level, slope = _sign(random) * 0.12, _sign(random) * float(random.uniform(0.3, 0.5))
    return lambda s: {
        # Kept from turning friction into a drive, also at large knobs.
        "asymmetry": math.copysign(min(abs(level) * s, 0.8), level) * at.friction,
        "asymmetry_viscous": slope * s * at.friction / at.top_speed,
    }


def _presliding(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    frequency = 2.0 * math.pi * float(random.uniform(18.0, 30.0))
    usual = at.friction / (at.physics.mass * frequency**2)
    elements = _elements(form)

    def changes(s: float) -> Changes:
        displacement = usual * s
        damping = 0.3 * math.sqrt(at.physics.mass * at.friction / displacement) if form == 0 else 0.0
        return {
            "presliding": float(form + 1),
            "displacement": displacement,
            "presliding_damping": damping,
            "elements": elements,
        }

    return changes


def _elements(form: int) -> tuple[tuple[float, float], ...]:
    """Shares of level and of stiffness; at rest the contact is as stiff as a bristle, level over displacement."""
    if form == 0:
        return ()
    if form == 1:
        return ((0.2, 0.55), (0.3, 0.25), (0.3, 0.14), (0.2, 0.06))
    # Yield displacements spread evenly over a decade and a half, as of asperities of very different height.
    reach = np.geomspace(0.2, 6.0, 24)
    share = np.full(24, 1.0 / 24)
    stiff = share / reach
    return tuple(zip(share.tolist(), (stiff / np.sum(stiff)).tolist(), strict=True))


def _frictional_lag(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    # Strong and wide: a lag shows only while the level changes, and a narrow fall ends in stick-slip.
    strong, velocity = at.friction * float(random.uniform(1.3, 2.5)), at.top_speed * _spread(random, 0.12, 0.3)
    return lambda s: {
        "stribeck": strong,
        "stribeck_velocity": velocity,
        "lag": (1.0, 2.0, 3.0, 4.0)[form],
        "lag_time": min(0.01 * s, 0.2),
    }


def _dwell_time(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    time, length = _spread(random, 0.05, 0.3), at.travel * _spread(random, 0.0006, 0.002)
    return lambda s: {
        "dwell": 0.3 * s * at.friction,
        "dwell_form": (1.0, 2.0, 3.0, 4.0)[form],
        "dwell_time": time,
        "dwell_length": length,
    }


def _load_dependence(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    return lambda s: {"load": 0.4 * s, "load_form": float(form)}


def _position_dependence(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    if form > 0 or random.random() < 0.5:
        place, width = at.travel * float(random.uniform(-0.25, 0.25)), at.travel * float(random.uniform(0.03, 0.08))
        return lambda s: {"spot": 0.6 * s, "spot_position": place, "spot_width": width, "spot_form": float(form)}
    period, phase = at.travel * _spread(random, 0.15, 0.5), float(random.uniform(0, 2 * math.pi))
    return lambda s: {
        "wave_cosine": min(0.3 * s, 0.95) * math.cos(phase),
        "wave_sine": min(0.3 * s, 0.95) * math.sin(phase),
        "wave_period": period,
    }


def _time_drift(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    sign = _sign(random)
    if random.random() < 0.5:
        most = 0.9 if sign < 0 else 5.0
        return lambda s: {"drift": sign * min(0.5 * s, most) / at.train_time}
    time = at.validation_time * float(random.uniform(0.15, 0.4))
    most = 0.85 if sign < 0 else 5.0
    return lambda s: {"drift": sign * min(0.5 * s, most), "drift_time": time}


def _temperature(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    level, slope = _sign(random) * 0.02, -0.02
    return lambda s: {
        "temperature": math.copysign(min(abs(level) * s, 0.08), level),
        "temperature_viscous": max(slope * s * at.friction / at.top_speed, -0.06 * at.physics.viscous),
        "temperature_form": float(form),
    }


def _accel_hysteresis(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    velocity = at.top_speed * _spread(random, 0.04, 0.15)
    return lambda s: {
        "acceleration": 0.5 * s * at.friction,
        "acceleration_velocity": velocity,
        "acceleration_form": float(form),
    }


def _ripple(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    period, phase = at.travel * _spread(random, 0.04, 0.25), float(random.uniform(0, 2 * math.pi))
    return lambda s: {
        "ripple_cosine": 0.3 * s * at.friction * math.cos(phase),
        "ripple_sine": 0.3 * s * at.friction * math.sin(phase),
        "ripple_period": period,
    }


def _gain_ripple(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    period = at.travel * float(random.uniform(0.08, 0.2))
    return lambda s: {"gain_ripple": min(0.15 * s, 0.6), "gain_ripple_period": period}


def _backlash(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    share = float(random.uniform(0.35, 0.7))
    return lambda s: {"load_share": share, "gap": 0.002 * s * at.travel}


def _impact_backlash(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    share = float(random.uniform(0.35, 0.7))
    usual = 2.0 * math.pi * at.band * float(random.uniform(0.4, 0.7))
    reduced = at.physics.mass * share * (1.0 - share)
    ratio = float(random.uniform(0.03, 0.12))

    def changes(s: float) -> Changes:
        # Soft stops would show as a spring however small the play is.
        frequency = usual * min(max(1.0 / math.sqrt(s), 1.0), 8.0)
        return {
            "load_share": share,
            "gap": 0.002 * s * at.travel,
            "stop_stiffness": reduced * frequency**2,
            "stop_damping": 2.0 * ratio * reduced * frequency,
        }

    return changes


def _compliance(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    share = float(random.uniform(0.3, 0.7))
    ratio = float(random.uniform(0.02, 0.08))
    usual = at.band * float(random.uniform(0.3, 0.45))
    if form == 0 and random.random() < 0.4:
        hanging = share * at.physics.mass
        return lambda s: {
            "mass": at.physics.mass - hanging,
            "appendage": hanging,
            "appendage_frequency": min(max(usual / math.sqrt(s), 3.0), at.band),
            "appendage_damping": ratio,
        }
    reduced = at.physics.mass * share * (1.0 - share)

    def changes(s: float) -> Changes:
        frequency = 2.0 * math.pi * min(max(usual / math.sqrt(s), 3.0), at.band)
        stiffness = reduced * frequency**2
        found = {"load_share": share, "shaft": stiffness, "shaft_damping": 2.0 * ratio * reduced * frequency}
        deflection = at.physics.mass * share * at.acceleration / stiffness
        if form == 1:
            found["shaft_cubic"] = 0.3 * stiffness / deflection**2
        elif form == 2:
            found["shaft_square"] = 0.4 * stiffness / deflection
        return found

    return changes


def _stiffness(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    place = at.travel * float(random.uniform(-0.1, 0.1)) if "bias" in at.parts else 0.0
    return lambda s: {"stiffness": 0.6 * s * at.friction / at.travel, "stiffness_position": place}


def _nonlinear_stiffness(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    return lambda s: {"cubic": 0.7 * s * at.friction / (0.4 * at.travel) ** 3}


def _actuator_lag(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    return lambda s: {"actuator": float(form + 1), "actuator_time": min(0.004 * s, 0.5 / at.bandwidth)}


def _delay(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    return lambda s: {"delay": min(0.004 * s, 0.5 / at.bandwidth)}


def _saturation(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    usual = at.friction + at.physics.viscous * at.top_speed + at.physics.mass * at.acceleration + abs(at.physics.bias)
    return lambda s: {"limit": usual / (1.0 + 0.3 * s), "limit_form": float(form)}


def _input_deadzone(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    return lambda s: {"dead_zone": 0.25 * s * at.friction, "dead_zone_form": float(form)}


_CATALOGUE = (
    Concealed("coulomb", _coulomb, lacks=frozenset({"coulomb", "stribeck", "presliding"})),
    Concealed("viscous", _viscous, lacks=frozenset({"viscous"}), group="speed"),
    Concealed("bias", _bias, lacks=frozenset({"bias"}), group="constant"),
    Concealed("quadratic_drag", _quadratic_drag, forms=2, foreign=(2,), group="speed"),
    Concealed("shear_thinning", _shear_thinning, forms=2, foreign=(2,), group="speed"),
    Concealed("gear_friction", _gear_friction, forms=2),
    Concealed("stribeck", _stribeck, forms=3, foreign=(3,), lacks=frozenset({"stribeck"}), group="low speed", largest=2.5),
    Concealed("asymmetry", _asymmetry, group="constant"),
    Concealed(
        "presliding", _presliding, forms=3, foreign=(1, 2), needs=frozenset({"coulomb"}), lacks=frozenset({"presliding"}),
        group="slip",
    ),
    Concealed(
        "frictional_lag", _frictional_lag, forms=3, foreign=(3,), needs=frozenset({"stribeck"}),
        lacks=frozenset({"presliding"}), group="low speed",
    ),
    Concealed("dwell_time", _dwell_time, forms=3, foreign=(3,), group="low speed", largest=4.0),
    Concealed("load_dependence", _load_dependence, forms=2, foreign=(2,), signals=("normal_load",), group="scale"),
    Concealed("position_dependence", _position_dependence, forms=2, foreign=(2,), group="place"),
    Concealed("time_drift", _time_drift, group="time"),
    Concealed("temperature", _temperature, forms=2, foreign=(1, 2), signals=("temperature",), group="time"),
    Concealed(
        "accel_hysteresis", _accel_hysteresis, forms=2, foreign=(2,), lacks=frozenset({"stribeck"}), group="low speed",
        largest=2.5,
    ),
    Concealed("ripple", _ripple, group="place"),
    Concealed("backlash", _backlash, group="transmission"),
    Concealed("impact_backlash", _impact_backlash, group="transmission"),
    Concealed("compliance", _compliance, forms=2, foreign=(2,), group="transmission"),
    Concealed("stiffness", _stiffness, group="spring"),
    Concealed("nonlinear_stiffness", _nonlinear_stiffness, group="spring"),
    Concealed("actuator_lag", _actuator_lag, forms=2, foreign=(2,), group="command"),
    Concealed("delay", _delay, group="command"),
    Concealed("saturation", _saturation, forms=2, foreign=(1,), group="command", largest=8.0),
    Concealed("input_deadzone", _input_deadzone, forms=2, foreign=(1,), group="command"),
    Concealed("gain_ripple", _gain_ripple, group="place"),
)  # fmt: skip

CONCEALED: dict[str, Concealed] = {each.effect: each for each in _CATALOGUE}
"""By id of the vocabulary; a test holds it against the registry."""
