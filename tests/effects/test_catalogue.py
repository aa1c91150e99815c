"""What every effect must offer, whatever its kind; the curves themselves are in the test of each."""

from __future__ import annotations

import importlib
import inspect
import math
import pkgutil
import re
from collections.abc import Iterator
from typing import Any

import fric.effects
import numpy as np
import pytest
from fric.effect import Context, Effect, Place
from fric.effects import EFFECTS, by_name
from fric.model import Model, Term, build_model
from fric.model_file import model_from_text, model_to_text
from fric.parameter import Parameter
from fric.plants import PLANTS
from fric.record import Units
from fric.simulation import Simulator

# Every id that an effect may have.
VOCABULARY = {
    *("coulomb", "viscous", "quadratic_drag", "stribeck", "asymmetry", "presliding", "frictional_lag", "dwell_time"),
    *("load_dependence", "position_dependence", "time_drift", "temperature", "accel_hysteresis", "bias", "ripple"),
    *("shear_thinning", "gear_friction"),
    *("backlash", "impact_backlash", "compliance", "stiffness", "nonlinear_stiffness"),
    *("actuator_lag", "delay", "saturation", "input_deadzone", "gain_ripple", "unknown"),
}
ALL = pytest.mark.parametrize("effect", EFFECTS.values(), ids=list(EFFECTS))
SPEEDS = [sign * speed for speed in (0.0, 1e-12, 1e-6, 1e-3, 0.1, 10.0, 1e3) for sign in (1.0, -1.0)]
STEPS = (1e-7, 1e-3, 0.1, 100.0)
# What the compiled functions take before the parameters, without the offsets of memory and constants.
FIRST = {"level": 2, "force": 1, "slip": 6, "command": 4, "uncommand": 1, "play": 0, "link": 4, "remember": 3, "prepare": 2}
# What may act at each place.
ROLES = {
    Place.COMMAND_PATH: {"command", "force"},
    Place.TRANSMISSION: {"link", "play", "force"},
    Place.SLIP_LEVEL: {"level", "force"},
    Place.SLIP_DYNAMICS: {"slip", "level"},
    Place.FORCE: {"force"},
}
OFFSET = 3  # where the states of the effect under test begin; before and after them belongs to others
GUARD = 1234.5


def typical(parameter: Parameter) -> float:
    """A value inside the bounds, different for each parameter."""
    value = parameter.default if parameter.default not in (None, 0.0) else 0.37 + 0.01 * len(parameter.name)
    assert value is not None
    return min(max(value, parameter.lower), parameter.upper)


def values(effect: Effect) -> tuple[float, ...]:
    return tuple(typical(parameter) for parameter in effect.parameters)


def guarded(states: np.ndarray) -> np.ndarray:
    """``states`` at the offset of an array in which everything else must stay as it is."""
    return np.concatenate([np.full(OFFSET, GUARD), states, np.full(4, GUARD)])


def inner(array: np.ndarray, n: int) -> np.ndarray:
    assert np.all(array[:OFFSET] == GUARD)
    assert np.all(array[OFFSET + n :] == GUARD)
    return array[OFFSET : OFFSET + n]


def context(velocity: float, step: float = 0.0, memory: Any = None, direction: float | None = None) -> Context:
    memory = np.zeros(0) if memory is None else memory
    return Context(0.1, velocity, direction or math.copysign(1.0, velocity), 2.0, 1.3, 5.0, 0.0, step, memory, 0.0)


def offset(effect: Effect) -> tuple[int, ...]:
    return (OFFSET,) if effect.n_memory else ()


def level(effect: Effect, c: Context, base: float, p: tuple[float, ...]) -> float:
    return 0.0 if effect.level is None else effect.level(c, base, *offset(effect), *p)


def force(effect: Effect, c: Context, p: tuple[float, ...]) -> float:
    return 0.0 if effect.force is None else effect.force(c, *offset(effect), *p)


def constants(effect: Effect, p: tuple[float, ...]) -> tuple[Any, ...]:
    if effect.prepare is None:
        return ()
    k = guarded(np.zeros(effect.constants(p)))
    effect.prepare(k, OFFSET, *p)
    assert np.all(np.isfinite(inner(k, effect.constants(p))))
    return k, OFFSET


def lived(effect: Effect, base: float, p: tuple[float, ...]) -> np.ndarray:
    """Memory after a few steps of motion."""
    memory = guarded(np.zeros(effect.n_memory))
    if effect.remember is not None:
        for number in range(5):
            effect.remember(context(0.02 * math.sin(number), 0.01, memory), base, OFFSET, *p)
    assert np.all(np.isfinite(inner(memory, effect.n_memory)))
    return memory


def memories(effect: Effect, base: float = 2.0) -> Iterator[np.ndarray]:
    yield guarded(np.zeros(effect.n_memory))
    yield lived(effect, base, values(effect))


def test_every_module_of_the_folder_is_in_the_catalogue() -> None:
    modules = {info.name for info in pkgutil.iter_modules(fric.effects.__path__)}
    defined = {importlib.import_module(f"fric.effects.{name}").EFFECT for name in modules}
    assert defined == set(EFFECTS.values())
    # All that the contract names but for ``unknown``, which is a finding and not an effect.
    assert {effect.id for effect in EFFECTS.values()} == VOCABULARY - {"unknown"}


@ALL
def test_it_is_documented(effect: Effect) -> None:
    assert effect.id in VOCABULARY
    assert "=" in effect.equation
    assert len(effect.source) > 5
    assert effect.title
    assert effect.regime
    assert effect.looks_like
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
        factor = r"[FxsK](\^\d(\.\d)?)?"
        assert re.fullmatch(rf"(1|{factor})([ /]{factor})*", parameter.dimension), parameter.dimension
        for units in (Units("m", "N"), Units("rad", "N m"), Units("rad", "A")):
            assert "F" not in parameter.unit(units)
            assert "x" not in parameter.unit(units)


@ALL
def test_the_laws_of_an_effect_have_names(effect: Effect) -> None:
    laws = [other.law for other in EFFECTS.values() if other.id == effect.id]
    assert len(laws) == 1 or all(laws)
    assert sum(other.usual for other in EFFECTS.values() if other.id == effect.id) <= 1
    assert len({other.repeatable for other in EFFECTS.values() if other.id == effect.id}) == 1


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
    assert effect.functions
    for role, function in effect.functions.items():
        signature = list(inspect.signature(getattr(function, "py_func", function)).parameters)
        first = FIRST[role]
        if role in ("level", "force") and effect.n_memory:
            first += 1
        if role == "slip" and effect.prepare is not None:
            first += 2
        assert len(signature) == first + len(names), role
        assert signature[first:] == names, role
    if effect.rate is not None:
        fast, slow = effect.rate(1.5, *values(effect)), effect.rate(1e6, *values(effect))
        assert 0.0 <= slow <= fast < math.inf


@ALL
def test_it_acts_at_its_place(effect: Effect) -> None:
    roles = set(effect.functions)
    assert roles & ROLES[effect.place]
    for role, place in (
        *(("slip", Place.SLIP_DYNAMICS), ("prepare", Place.SLIP_DYNAMICS)),
        *(("command", Place.COMMAND_PATH), ("uncommand", Place.COMMAND_PATH)),
        *(("link", Place.TRANSMISSION), ("play", Place.TRANSMISSION)),
    ):
        assert role not in roles or effect.place is place, role
    states = effect.start(values(effect))
    assert states.dtype == np.float64
    assert (states.shape[0] > 0) == (effect.slip is not None)
    assert (effect.constants(values(effect)) > 0) == (effect.prepare is not None)
    assert effect.prepare is None or effect.slip is not None
    assert (effect.n_memory > 0) >= (effect.remember is not None)
    assert effect.remember is not None or effect.command is not None or effect.n_memory == 0
    if effect.command is not None:
        assert (effect.uncommand is None) == (effect.n_memory > 0)


@ALL
def test_its_force_is_finite_at_every_speed(effect: Effect) -> None:
    p = values(effect)
    for memory in memories(effect):
        for v in SPEEDS:
            for h in (0.0, *STEPS):
                before = memory.copy()
                c = context(v, h, memory)
                assert math.isfinite(level(effect, c, 2.0, p)), (v, h)
                assert math.isfinite(force(effect, c, p)), (v, h)
                # A step evaluates them several times: they only look.
                assert np.array_equal(memory, before)
                assert level(effect, c, 2.0, p) == level(effect, c, 2.0, p)
                if effect.remember is not None and h > 0.0:
                    after = memory.copy()
                    effect.remember(context(v, h, after), 2.0, OFFSET, *p)
                    assert np.all(np.isfinite(inner(after, effect.n_memory))), (v, h)


@ALL
def test_its_slip_dynamics_are_a_pure_function_of_the_step(effect: Effect) -> None:
    if effect.slip is None:
        return
    p = values(effect)
    k = constants(effect, p)
    n = effect.start(p).shape[0]
    for v in SPEEDS:
        for held in (0.0, 1e-9, 2.0, 1e6):
            for h in STEPS:
                z = guarded(effect.start(p))
                z_next, again = guarded(np.zeros(n)), guarded(np.ones(n))
                before = z.copy()
                friction = effect.slip(z, z_next, OFFSET, v, h, held, *k, *p)
                assert math.isfinite(friction), (v, held, h)
                assert np.all(np.isfinite(inner(z_next, n)))
                assert np.array_equal(z, before)
                assert effect.slip(z, again, OFFSET, v, h, held, *k, *p) == friction
                assert np.array_equal(inner(again, n), inner(z_next, n))


@ALL
def test_what_it_calls_linear_is_linear(effect: Effect) -> None:
    p = np.array(values(effect))
    linear = np.array([parameter.linear for parameter in effect.parameters])

    def total(values: np.ndarray, v: float, memory: np.ndarray) -> float:
        # As in a model whose other linear parameters are zero.
        c = context(v, 1e-3, memory)
        return force(effect, c, tuple(values)) + math.copysign(1.0, v) * level(effect, c, 0.0, tuple(values))

    if set(effect.functions) & {"slip", "command", "link"}:
        # These stand between force and motion: the force that a motion needs isn't linear in anything about them.
        assert not np.any(linear)
        return
    for memory in memories(effect, base=0.0):
        for v in (-0.3, -0.004, 0.004, 0.3):
            zero = np.where(linear, 0.0, p)
            assert total(zero, v, memory) == 0.0
            parts = 0.0
            for number in np.flatnonzero(linear):
                one = zero.copy()
                one[number] = 1.0
                unit = total(one, v, memory)
                parts += p[number] * unit
                one[number] = -3.0
                assert total(one, v, memory) == pytest.approx(-3.0 * unit, rel=1e-12)
            assert total(p, v, memory) == pytest.approx(parts, rel=1e-12, abs=1e-300)


@ALL
def test_it_treats_the_terms_before_it_as_its_order_says(effect: Effect) -> None:
    if effect.level is None:
        assert effect.order == 0
        return
    p = values(effect)
    for memory in memories(effect):
        for v in (-0.3, 0.0, 0.004, 0.3):
            c = context(v, 1e-3, memory)
            alone = level(effect, c, 0.0, p)
            shares = [(level(effect, c, base, p) - alone) / base for base in (0.5, 2.0, 7.0)]
            assert shares == pytest.approx([shares[0]] * 3, rel=1e-9, abs=1e-12)  # never more than a share of what comes before
            if effect.order in (0, 20, 40):
                assert shares[0] == pytest.approx(1.0)  # adds up
            elif effect.order == 30:
                assert alone == 0.0  # scales
            else:
                assert effect.order == 10  # lags
                assert effect.n_memory > 0
            other = level(effect, c._replace(direction=-c.direction), 0.0, p)
            if effect.order != 40:  # another contact may ask whether the force acts along the motion
                assert (other != alone) == (effect.order == 20)


@ALL
def test_its_command_path_passes_on_what_it_gets(effect: Effect) -> None:
    if effect.command is None:
        return
    p = values(effect)

    def run(commands: list[tuple[float, float]]) -> list[float]:
        y = guarded(np.zeros(effect.n_memory))
        assert effect.command is not None
        forces = [effect.command(u, h, y, OFFSET, *p) for u, h in commands]
        assert np.all(np.isfinite(inner(y, effect.n_memory)))
        return forces

    for u in (-1e6, -0.4, -1e-9, 0.0, 1e-9, 0.4, 1e6):
        for h in STEPS:
            forces = run([(u, h)] * 5)
            assert all(math.isfinite(f) and abs(f) <= abs(u) and f * u >= 0.0 for f in forces)
            halves = run([(u, 0.5 * h)] * 10)
            assert np.mean(np.reshape(halves, (5, 2)), axis=1) == pytest.approx(forces, rel=1e-9, abs=1e-9 * abs(u))
    if effect.uncommand is not None:
        for f in (-0.3, -1e-3, 0.0, 1e-3, 0.3):
            assert run([(effect.uncommand(f, *p), 1e-3)]) == pytest.approx([f], rel=1e-12, abs=0.0)


@ALL
def test_its_link_pulls_back(effect: Effect) -> None:
    p = values(effect)
    free = 0.0
    if effect.play is not None:
        free = effect.play(*p)
        assert 0.0 <= free < math.inf
    if effect.link is None:
        return
    for h in STEPS:
        assert effect.link(0.0, 0.0, h, free, *p) == 0.0
        assert effect.link(0.4 * free, 0.4 * free, h, free, *p) == 0.0
        for e in (free + 1e-6, free + 0.1):
            assert 0.0 < effect.link(e, e, h, free, *p) < math.inf
            assert effect.link(-e, -e, h, free, *p) == pytest.approx(-effect.link(e, e, h, free, *p))


def model_of(effects: list[Effect]) -> Model:
    """A model of these effects, on a plant that can have them."""
    driven = any({"link", "play"} & set(effect.functions) for effect in effects)
    terms = [Term(effect, values(effect)) for effect in effects]
    plant = PLANTS["rigid"]
    if driven and plant.driven is None:
        plant = next(plant for plant in PLANTS.values() if plant.driven is not None)
    return build_model(plant.id, {parameter.name: typical(parameter) for parameter in plant.parameters}, terms)


@ALL
def test_a_model_file_brings_it_back(effect: Effect) -> None:
    model = model_of([effect])
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


def crowds() -> list[list[Effect]]:
    """All effects in as few models as hold them: no two laws of one effect in the same."""
    found: list[list[Effect]] = []
    for effect in EFFECTS.values():
        for crowd in found:
            if all(effect.id != other.id for other in crowd):
                crowd.append(effect)
                break
        else:
            found.append([effect])
    return found


@pytest.mark.parametrize("crowd", crowds(), ids=lambda crowd: f"{len(crowd)}-with-{crowd[-1].key}")
def test_it_runs_among_others_and_picks_up_where_it_stopped(crowd: list[Effect]) -> None:
    model = model_of(crowd)
    wave = 300.0 * np.sin(np.arange(60) * 0.2)  # what passes lag, dead zone and limit still moves it
    whole, parts = Simulator(model), Simulator(model)
    states, friction, applied = whole.follow(wave, 1e-3)
    assert np.all(np.isfinite(states))
    assert np.all(np.isfinite(friction))
    assert np.max(np.abs(states)) > 0.0
    found = [parts.follow(part, 1e-3) for part in np.split(wave, [1, 7, 40])]
    assert np.array_equal(np.concatenate([part[1] for part in found]), friction)
    assert np.array_equal(np.concatenate([part[2] for part in found]), applied)
    assert np.array_equal(parts.states, whole.states)
    assert np.array_equal(parts.memory, whole.memory)
