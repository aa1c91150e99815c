"""What every effect must offer, and the curve of each, typed here a second time."""

from __future__ import annotations

import importlib
import inspect
import math
import pkgutil
from collections.abc import Callable

import fric_nodes.effects
import numpy as np
import pytest
from fric_nodes.effect import Context, Effect, Place
from fric_nodes.effects import EFFECTS, by_name
from fric_nodes.model import Term, build_model
from fric_nodes.model_file import model_from_text, model_to_text
from fric_nodes.parameter import Parameter
from fric_nodes.record import Units

# Every id that an effect may have.
VOCABULARY = {
    *("coulomb", "viscous", "quadratic_drag", "stribeck", "asymmetry", "presliding", "frictional_lag", "dwell_time"),
    *("load_dependence", "position_dependence", "time_drift", "temperature", "accel_hysteresis", "bias", "ripple"),
    *("backlash", "impact_backlash", "compliance", "stiffness", "nonlinear_stiffness"),
    *("actuator_lag", "delay", "saturation", "input_deadzone", "unknown"),
}
ALL = pytest.mark.parametrize("effect", EFFECTS.values(), ids=list(EFFECTS))
SPEEDS = [sign * speed for speed in (0.0, 1e-12, 1e-6, 1e-3, 0.1, 10.0, 1e3) for sign in (1.0, -1.0)]


def typical(parameter: Parameter) -> float:
    """A value inside the bounds, different for each parameter."""
    value = parameter.default if parameter.default not in (None, 0.0) else 0.37 + 0.01 * len(parameter.name)
    assert value is not None
    return min(max(value, parameter.lower), parameter.upper)


def values(effect: Effect) -> tuple[float, ...]:
    return tuple(typical(parameter) for parameter in effect.parameters)


def context(velocity: float, direction: float | None = None) -> Context:
    return Context(0.1, velocity, direction or math.copysign(1.0, velocity), 2.0, 1.0, 0.0, 0.0, 0.0, np.zeros(0))


def test_every_module_of_the_folder_is_in_the_catalogue() -> None:
    modules = {info.name for info in pkgutil.iter_modules(fric_nodes.effects.__path__)}
    defined = {importlib.import_module(f"fric_nodes.effects.{name}").EFFECT for name in modules}
    assert defined == set(EFFECTS.values())
    assert {"coulomb", "viscous", "stribeck", "asymmetry", "bias", "presliding"} <= {effect.id for effect in EFFECTS.values()}


@ALL
def test_it_is_documented(effect: Effect) -> None:
    assert effect.id in VOCABULARY
    assert "=" in effect.equation
    assert len(effect.source) > 5
    assert effect.title
    assert effect.regime
    for other, experiment in effect.looks_like.items():
        assert other in VOCABULARY
        assert other != effect.id
        assert len(experiment) > 20
    names = [parameter.name for parameter in effect.parameters]
    assert len(set(names)) == len(names)
    for parameter in effect.parameters:
        assert parameter.name.isidentifier()
        assert parameter.name == parameter.name.lower()
        assert parameter.symbol
        assert len(parameter.doc) > 10
        assert set(parameter.dimension) <= set("Fxs1/^2 -"), parameter.dimension
        for units in (Units("m", "N"), Units("rad", "N m"), Units("rad", "A")):
            assert "F" not in parameter.unit(units)
            assert "x" not in parameter.unit(units)


@ALL
def test_its_bounds_and_defaults_are_sound(effect: Effect) -> None:
    for parameter in effect.parameters:
        assert parameter.lower < parameter.upper
        assert parameter.refusal(typical(parameter)) is None
        if parameter.default is not None:
            assert parameter.refusal(parameter.default) is None
        for bad in (math.nan, math.inf, -math.inf):
            assert parameter.refusal(bad) is not None
        if parameter.positive:
            assert parameter.refusal(0.0) is not None
        if parameter.lower > -math.inf:
            assert parameter.refusal(parameter.lower - 1.0) is not None
        if parameter.upper < math.inf:
            assert parameter.refusal(parameter.upper + 1.0) is not None


@ALL
def test_its_functions_take_its_parameters_in_order(effect: Effect) -> None:
    names = [parameter.name for parameter in effect.parameters]
    assert any((effect.level, effect.force, effect.slip))
    for function in (effect.level, effect.force, effect.slip):
        if function is not None:
            signature = list(inspect.signature(getattr(function, "py_func", function)).parameters)
            assert signature[len(signature) - len(names) :] == names
    if effect.slip is not None:
        assert effect.place is Place.SLIP_DYNAMICS
        assert effect.n_states > 0
    else:
        assert effect.n_states == 0
    if effect.rate is not None:
        assert effect.rate(1.5, *values(effect)) >= 0.0


@ALL
def test_its_force_is_finite_at_every_speed(effect: Effect) -> None:
    p = values(effect)
    for v in SPEEDS:
        for function in (effect.level, effect.force):
            if function is not None:
                base = (2.0,) if function is effect.level else ()
                assert math.isfinite(function(context(v), *base, *p)), v
        if effect.slip is not None:
            for level in (0.0, 1e-9, 2.0, 1e6):
                z, z_next = np.full(effect.n_states, 1e-6), np.empty(effect.n_states)
                assert math.isfinite(effect.slip(z, z_next, 0, v, 1e-3, level, *p)), (v, level)
                assert np.all(np.isfinite(z_next))


@ALL
def test_what_it_calls_linear_is_linear(effect: Effect) -> None:
    p = np.array(values(effect))
    linear = np.array([parameter.linear for parameter in effect.parameters])

    def total(values: np.ndarray, v: float) -> float:
        force = effect.force(context(v), *values) if effect.force is not None else 0.0
        level = effect.level(context(v), 2.0, *values) - 2.0 if effect.level is not None else 0.0
        return force + math.copysign(1.0, v) * level

    if effect.slip is not None:
        assert not np.any(linear)  # the slip states depend on the past: nothing about them is linear
        return
    for v in (-0.3, -0.004, 0.004, 0.3):
        zero = np.where(linear, 0.0, p)
        assert total(zero, v) == 0.0
        parts = 0.0
        for number in np.flatnonzero(linear):
            one = zero.copy()
            one[number] = 1.0
            parts += p[number] * total(one, v)
            one[number] = -3.0
            assert total(one, v) == pytest.approx(-3.0 * total(np.where(np.arange(p.size) == number, 1.0, zero), v), rel=1e-12)
        assert total(p, v) == pytest.approx(parts, rel=1e-12)


@ALL
def test_a_model_file_brings_it_back(effect: Effect) -> None:
    model = build_model("rigid", {"mass": 1.25}, [Term(effect, values(effect))])
    text = model_to_text(model)
    again = model_from_text(text)
    assert again == model
    assert again.terms[0].effect is effect
    for parameter in effect.parameters:
        assert f"{parameter.symbol} [{parameter.unit(model.units)}]" in text


@ALL
def test_it_is_found_by_name(effect: Effect) -> None:
    assert by_name(effect.id, effect.law) is effect
    assert by_name(effect.id, "no such law") is None


# --- the curves, each typed a second time; positive opposes positive motion ---


def _level(name: str) -> Callable[..., float]:
    effect = by_name(name)
    assert effect is not None
    return lambda v, *p: effect.level(context(v), 0.0, *p)  # type: ignore[misc]


def _force(name: str) -> Callable[..., float]:
    effect = by_name(name)
    assert effect is not None
    return lambda v, *p: effect.force(context(v), *p)  # type: ignore[misc]


@pytest.mark.parametrize("v", [-2.0, -0.01, 1e-9, 0.003, 0.7])
def test_curves(v: float) -> None:
    s = -1.0 if v < 0 else 1.0
    assert _level("coulomb")(v, 4.0) == 4.0
    assert _force("viscous")(v, 10.0) == pytest.approx(10.0 * v)
    assert _force("bias")(v, -3.0) == -3.0
    assert _level("asymmetry")(v, 0.5, 3.0) == 0.5 * s
    assert _force("asymmetry")(v, 0.5, 3.0) == pytest.approx(3.0 * abs(v))
    for delta in (0.5, 1.0, 2.0, 3.7):
        assert _level("stribeck")(v, 2.0, 0.01, delta) == pytest.approx(
            2.0 * np.exp(-((abs(v) / 0.01) ** delta)), rel=1e-12, abs=1e-30
        )


def test_landmarks_of_the_stribeck_curve() -> None:
    level = _level("stribeck")
    assert level(0.0, 2.0, 0.01, 2.0) == 2.0
    assert level(0.01, 2.0, 0.01, 2.0) == pytest.approx(2.0 * 0.36787944117144233)
    assert level(0.01, 2.0, 0.01, 0.7) == pytest.approx(2.0 * 0.36787944117144233)
    assert level(1e6, 2.0, 0.01, 2.0) == 0.0
