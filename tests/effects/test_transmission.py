"""The links of transmissions, their impacts and vibrating appendages, against closed forms and integrations typed here."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.effect import Context
from fric.effects import EFFECTS
from fric.effects.impact_backlash import damping_for, duration, restitution
from fric.effects.impact_backlash_hunt_crossley import restitution as crossley_restitution
from fric.model import Model, ModelError, Term, build_model, term
from fric.simulation import Simulator
from numpy.typing import NDArray
from scipy.integrate import quad, solve_ivp

Array = NDArray[np.float64]
MOTOR, LOAD = 1.0, 3.0
REDUCED = 0.75
STIFFNESS = 1e5


def bed(*terms: Term, motor_coulomb: float = 0.0, motor_viscous: float = 0.0) -> Model:
    values = {"motor_mass": MOTOR, "load_mass": LOAD, "motor_coulomb": motor_coulomb, "motor_viscous": motor_viscous}
    return build_model("two_mass", values, terms)


def mean_force(law: str, e_0: float, e_1: float, free: float, k: float, k_3: float, c: float, h: float) -> float:
    """Mean over a deflection at constant rate, by numerical integration of the force at each instant."""
    rate = (e_1 - e_0) / h

    def at(e: float) -> float:
        if free == 0.0 and law.startswith("compliance"):
            return k * e + k_3 * e**3 + c * rate
        a = abs(e) - 0.5 * free
        if a <= 0.0:
            return 0.0
        side = math.copysign(1.0, e)
        if law.endswith("hunt_crossley"):
            return side * max(k * a * (1.0 + c * side * rate), 0.0)
        return side * max(k * a + k_3 * a**3 + c * side * rate, 0.0)

    jumps = [(side * 0.5 * free - e_0) / (e_1 - e_0) for side in (1.0, -1.0)]
    points = [*np.linspace(0.05, 0.95, 19).tolist(), *(s for s in jumps if 0.0 < s < 1.0)]
    total = quad(lambda s: at(e_0 + s * (e_1 - e_0)), 0.0, 1.0, limit=400, points=points)
    return float(total[0])


@pytest.mark.parametrize(
    ("law", "given"),
    [
        ("compliance/linear", (3e3, 20.0)),
        ("compliance/hardening", (3e3, 4e7, 20.0)),
        ("impact_backlash/viscoelastic", (0.0, 3e3, 20.0)),
        ("impact_backlash/hunt_crossley", (0.0, 3e3, 0.9)),
    ],
)
def test_the_mean_force_of_a_link_is_the_mean_of_its_force(law: str, given: tuple[float, ...]) -> None:
    link = EFFECTS[law].link
    assert link is not None
    k, c = given[-2] if "hardening" not in law else given[0], given[-1]
    k_3 = given[1] if "hardening" in law else 0.0
    random = np.random.default_rng(3)
    for free in (0.0, 4e-3):
        for h in (1e-4, 2e-3, 0.3):
            for e_0, e_1 in random.uniform(-1e-2, 1e-2, (40, 2)).tolist():
                expected = mean_force(law, e_0, e_1, free, k, k_3, c, h)
                found = link(e_0, e_1, h, free, *given)
                assert found == pytest.approx(expected, rel=2e-5, abs=1e-4 * k * 1e-2), (free, h, e_0, e_1)


@pytest.mark.parametrize("law", ["compliance/linear", "compliance/hardening", "impact_backlash/viscoelastic"])
def test_an_undamped_link_gives_back_what_it_took(law: str) -> None:
    link = EFFECTS[law].link
    assert link is not None
    given = {"compliance/linear": (3e3, 0.0), "compliance/hardening": (3e3, 4e7, 0.0)}.get(law, (4e-3, 3e3, 0.0))
    path = np.cumsum(np.random.default_rng(5).normal(0.0, 3e-3, 2000))
    path = np.concatenate([[0.0], path - np.linspace(0.0, path[-1], 2000)])
    forces = [link(a, b, 1e-3, 4e-3, *given) for a, b in zip(path[:-1].tolist(), path[1:].tolist(), strict=True)]
    work = np.array(forces) * np.diff(path)
    assert abs(np.sum(work)) < 1e-12 * np.sum(np.abs(work))


def test_a_damped_link_only_takes() -> None:
    for law, given in (
        ("compliance/linear", (3e3, 20.0)),
        ("compliance/hardening", (3e3, 4e7, 20.0)),
        ("impact_backlash/viscoelastic", (4e-3, 3e3, 20.0)),
        ("impact_backlash/hunt_crossley", (4e-3, 3e3, 2.0)),
    ):
        link = EFFECTS[law].link
        assert link is not None
        path = np.cumsum(np.random.default_rng(6).normal(0.0, 2e-3, 3000))
        path = np.concatenate([[0.0], path - np.linspace(0.0, path[-1], 3000)])
        work = [link(a, b, 1e-3, 4e-3, *given) * (b - a) for a, b in zip(path[:-1].tolist(), path[1:].tolist(), strict=True)]
        assert sum(work) > 0.01 * sum(abs(each) for each in work)


# --- impacts ---


def impact(zeta: float) -> tuple[float, float]:
    """Restitution and duration by integration until the force vanishes."""
    c = 2.0 * zeta * math.sqrt(STIFFNESS * REDUCED)

    def right_side(t: float, y: Array) -> list[float]:
        return [y[1], -(STIFFNESS * y[0] + c * y[1]) / REDUCED]

    def parts(t: float, y: Array) -> float:
        return float(STIFFNESS * y[0] + c * y[1]) if t > 1e-7 else 1.0

    parts.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(right_side, (0.0, 1.0), [0.0, 0.2], method="DOP853", rtol=1e-11, atol=1e-14, events=parts, max_step=1e-3)
    return float(-found.y[1, -1] / 0.2), float(found.t[-1])


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.3, 0.8, 1.0, 1.0 + 1e-7, 1.7, 4.0])
def test_restitution_and_duration_of_an_impact(zeta: float) -> None:
    c = 2.0 * zeta * math.sqrt(STIFFNESS * REDUCED)
    r, length = impact(zeta)
    assert restitution(STIFFNESS, c, REDUCED) == pytest.approx(r, rel=1e-8)
    assert duration(STIFFNESS, c, REDUCED) == pytest.approx(length, rel=1e-8)
    if zeta > 0.0:
        assert damping_for(r, STIFFNESS, REDUCED) == pytest.approx(c, rel=1e-6)
    # In the simulation, at the step that the model itself asks for.
    simulator = Simulator(bed(term("impact_backlash", gap=0.1, stiffness=STIFFNESS, damping=c)))
    simulator.states[:] = 0.0, 0.0, 0.049, 0.2
    states, _ = simulator.run(np.zeros(40), 1e-3)
    assert (states[-1, 1] - states[-1, 3]) / 0.2 == pytest.approx(r, rel=1e-3)
    assert MOTOR * states[-1, 3] + LOAD * states[-1, 1] == pytest.approx(0.2, rel=1e-13)


def test_known_restitutions() -> None:
    critical = 2.0 * math.sqrt(STIFFNESS * REDUCED)
    assert restitution(STIFFNESS, 0.0, REDUCED) == 1.0
    assert restitution(STIFFNESS, critical, REDUCED) == pytest.approx(math.exp(-2.0))
    assert restitution(STIFFNESS, 100.0 * critical, REDUCED) == pytest.approx(1.0 / 200.0**2, rel=1e-3)
    with pytest.raises(ValueError, match="restitution is 0"):
        damping_for(0.0, STIFFNESS, REDUCED)


@pytest.mark.parametrize("d", [1e-4, 0.1, 1.0, 8.0])
def test_restitution_after_hunt_and_crossley_falls_with_the_closing_speed(d: float) -> None:
    speed = 0.2
    r = crossley_restitution(d / speed, speed)
    # The law's own equation, and what the simulation does.
    assert d * (1.0 + r) == pytest.approx(math.log((1.0 + d) / (1.0 - d * r)), rel=1e-9)
    simulator = Simulator(bed(term("impact_backlash", "hunt_crossley", gap=0.1, stiffness=STIFFNESS, damping=d / speed)))
    simulator.states[:] = 0.0, 0.0, 0.049, speed
    states, _ = simulator.run(np.zeros(45), 1e-3)
    assert (states[-1, 1] - states[-1, 3]) / speed == pytest.approx(r, rel=1e-3)


def test_elastic_impacts_keep_energy_and_momentum() -> None:
    gap = 1e-3
    simulator = Simulator(bed(term("impact_backlash", gap=gap, stiffness=STIFFNESS)))
    simulator.states[:] = 0.0, 0.0, 0.0, 0.2
    states, _ = simulator.run(np.zeros(50_000), 2e-4, 1)
    a = np.maximum(np.abs(states[:, 2] - states[:, 0]) - 0.5 * gap, 0.0)
    assert np.sum((a[1:] > 0.0) & (a[:-1] == 0.0)) > 500
    energy = 0.5 * MOTOR * states[:, 3] ** 2 + 0.5 * LOAD * states[:, 1] ** 2 + 0.5 * STIFFNESS * a**2
    np.testing.assert_allclose(energy, 0.02, rtol=1e-8)
    np.testing.assert_allclose(MOTOR * states[:, 3] + LOAD * states[:, 1], 0.2, rtol=1e-12)


# --- plain backlash ---


def test_plain_backlash_is_a_plastic_impact_at_the_right_time() -> None:
    for step in (1e-3, 0.7e-3):
        simulator = Simulator(bed(term("backlash", gap=1e-2)))
        simulator.states[:] = 0.0, 0.0, 0.0, 0.2
        n = round(0.1 / step)
        states, _ = simulator.run(np.zeros(n), step)
        t = step * np.arange(1, n + 1)
        met = 5e-3 / 0.2
        free = t <= met + 1e-9  # the impact may fall on a sample
        assert np.all(states[free, 3] == 0.2)
        assert np.all(states[free, :2] == 0.0)
        np.testing.assert_allclose(states[~free, 3], 0.05, rtol=1e-13)
        np.testing.assert_allclose(states[~free, 1], 0.05, rtol=1e-13)
        np.testing.assert_allclose(states[~free, 0], 0.05 * (t[~free] - met), atol=1e-14)
        np.testing.assert_allclose(states[~free, 2] - states[~free, 0], 5e-3, rtol=1e-12)


def test_plain_backlash_under_a_force_against_the_parabola() -> None:
    # The motor crosses half the gap, hits, both go on together; then the force turns and the motor draws back alone.
    simulator = Simulator(bed(term("backlash", gap=2e-3)))
    states, _ = simulator.run(np.r_[np.full(100, 4.0), np.full(20, -4.0)], 1e-3)
    met = math.sqrt(2.0 * 1e-3 / 4.0)
    common = 4.0 * met / 4.0
    t = 0.1 - met
    assert states[99, 1] == pytest.approx(common + 1.0 * t, rel=1e-12)
    assert states[99, 0] == pytest.approx(common * t + 0.5 * t**2, rel=1e-11)
    assert np.all(states[100:, 1] == states[99, 1])
    assert states[109, 3] == pytest.approx(states[99, 1] - 4.0 * 0.01, rel=1e-12)


def test_the_load_rests_while_the_motor_crosses_the_gap() -> None:
    model = bed(term("backlash", gap=2e-3), term("coulomb", force=3.0), term("stribeck", force=0.0, velocity=1.0))
    u = 5.0 * np.sin(2.0 * np.pi * 2.0 * 1e-3 * np.arange(4000))
    states, _ = Simulator(model).run(u, 1e-3)
    e = states[:, 2] - states[:, 0]
    assert np.max(np.abs(e)) == pytest.approx(1e-3, rel=1e-9)
    crossing = np.abs(e) < 0.9e-3
    assert np.sum(crossing) > 50
    still = crossing[1:] & (states[1:, 1] == 0.0)
    assert np.sum(still) > 50
    assert np.all(np.diff(states[:, 0])[still & (states[:-1, 1] == 0.0)] == 0.0)


def test_a_spring_or_elastic_stops_take_up_what_a_backlash_adds() -> None:
    gap = 2e-3
    spring = term("compliance", stiffness=STIFFNESS)
    one = Simulator(bed(term("backlash", gap=gap), spring))
    two = Simulator(bed(term("impact_backlash", gap=gap, stiffness=STIFFNESS)))
    three = Simulator(bed(term("impact_backlash", gap=0.5 * gap, stiffness=STIFFNESS), term("backlash", gap=0.5 * gap)))
    for each in (one, two, three):
        each.states[:] = 0.0, 0.0, 0.0, 0.2
    runs = [each.run(np.zeros(300), 1e-3, 8)[0] for each in (one, two, three)]
    np.testing.assert_allclose(runs[1], runs[0], rtol=0, atol=1e-13)
    np.testing.assert_allclose(runs[2], runs[0], rtol=0, atol=1e-13)


# --- compliance ---


def test_springs_side_by_side_add_up() -> None:
    whole = Simulator(bed(term("compliance", stiffness=3e3, damping=4.0)))
    parts = Simulator(bed(term("compliance", stiffness=1e3, damping=4.0), term("compliance", stiffness=2e3)))
    u = np.full(500, 3.0)
    np.testing.assert_allclose(parts.run(u, 1e-3, 2)[0], whole.run(u, 1e-3, 2)[0], rtol=1e-10, atol=1e-15)


def test_damped_two_masses_against_the_closed_form() -> None:
    k, c, f = 4e3, 30.0, 2.0
    simulator = Simulator(bed(term("compliance", stiffness=k, damping=c)))
    states, _ = simulator.run(np.full(1000, f), 1e-3, 16)
    t = 1e-3 * np.arange(1, 1001)
    s, w = 0.5 * c / REDUCED, math.sqrt(k / REDUCED - (0.5 * c / REDUCED) ** 2)
    rest = f / MOTOR * REDUCED / k
    e = rest * (1.0 - np.exp(-s * t) * (np.cos(w * t) + s / w * np.sin(w * t)))
    centre = 0.5 * f / (MOTOR + LOAD) * t**2
    np.testing.assert_allclose(states[:, 2], centre + LOAD / 4.0 * e, atol=1e-5 * rest + 1e-9)
    np.testing.assert_allclose(states[:, 0], centre - MOTOR / 4.0 * e, atol=1e-5 * rest + 1e-9)


# --- appendage ---


def context(velocity: float, step: float, memory: Array) -> Context:
    return Context(0.0, velocity, 1.0, 0.0, 1.0, 0.0, 0.0, step, memory, 0.0)


@pytest.mark.parametrize("zeta", [0.0, 0.03, 0.9999999, 1.0, 1.0000001, 2.5])
def test_an_appendage_on_a_body_that_moves_at_constant_speed(zeta: float) -> None:
    effect = EFFECTS["compliance/appendage"]
    assert effect.force is not None
    assert effect.remember is not None
    mass, frequency, v, h = 0.3, 7.0, 0.4, 0.11
    w = 2.0 * math.pi * frequency

    def right_side(t: float, y: Array) -> list[float]:
        return [y[1] - v, -(w**2) * y[0] - 2.0 * zeta * w * (y[1] - v)]

    memory = np.zeros(effect.n_memory)
    memory[:2] = 2e-3, -0.1
    end = solve_ivp(right_side, (0.0, h), memory[:2], method="DOP853", rtol=1e-12, atol=1e-15).y[:, -1]
    c = context(v, h, memory)
    assert effect.force(c, 0, mass, frequency, zeta) == pytest.approx(mass * (end[1] + 0.1) / h, rel=1e-8)
    instant = effect.force(context(v, 0.0, memory), 0, mass, frequency, zeta)
    assert instant == pytest.approx(mass * right_side(0.0, memory[:2])[1], rel=1e-12)
    effect.remember(c, 0.0, 0, mass, frequency, zeta)
    np.testing.assert_allclose(memory[:2], end, rtol=1e-8)
    # A second step of another length, and one of the same, must not use what the first one has left behind for other values.
    for length in (0.3 * h, 0.3 * h, h):
        end = solve_ivp(right_side, (0.0, length), end, method="DOP853", rtol=1e-12, atol=1e-15).y[:, -1]
        effect.remember(context(v, length, memory), 0.0, 0, mass, frequency, zeta)
        np.testing.assert_allclose(memory[:2], end, rtol=1e-8)


def test_an_appendage_is_a_second_mass_on_a_spring() -> None:
    # The same body and mass written as two masses: body = motor.
    mass, frequency, zeta = 0.5, 6.0, 0.02
    w = 2.0 * math.pi * frequency
    plant = {"inertia": 2.0, "proportional": 0.0, "derivative": 0.0, "gravity": 0.0, "start": 0.0}
    hung = Simulator(
        build_model("pendulum", plant, [term("compliance", "appendage", mass=mass, frequency=frequency, damping=zeta)])
    )
    masses = {"motor_mass": 2.0, "load_mass": mass, "motor_coulomb": 0.0, "motor_viscous": 0.0}
    spring = term("compliance", stiffness=mass * w**2, damping=2.0 * zeta * w * mass)
    pair = Simulator(build_model("two_mass", masses, [spring]))
    u = np.where(np.arange(1000) < 150, 3.0, -1.0)
    one, two = hung.run(u, 1e-3, 4)[0], pair.run(u, 1e-3, 4)[0]
    span = np.ptp(two, axis=0)
    assert np.max(np.abs(one[:, 1] - two[:, 3])) < 1e-4 * span[3]
    assert np.max(np.abs(one[:, 0] - two[:, 2])) < 1e-5 * span[2]


def test_an_appendage_moves_along_when_a_run_begins_in_motion() -> None:
    # Without force and friction nothing changes then: neither the body's velocity nor the distance between both.
    plant = {"inertia": 2.0, "proportional": 0.0, "derivative": 0.0, "gravity": 0.0, "start": 0.0}
    model = build_model("pendulum", plant, [term("compliance", "appendage", mass=0.5, frequency=6.0, damping=0.02)])
    states, _ = Simulator(model, velocity=0.7).run(np.zeros(200), 1e-3, 4)
    np.testing.assert_allclose(states[:, 1], 0.7, rtol=1e-12)


def test_an_appendage_goes_on_any_plant_but_a_link_needs_two_bodies() -> None:
    plant = {"inertia": 2.0, "proportional": 0.0, "derivative": 0.0, "gravity": 0.0, "start": 0.0}
    build_model("pendulum", plant, [term("compliance", "appendage", mass=1.0, frequency=5.0)])
    for refused in (term("compliance", stiffness=1.0), term("backlash", gap=1.0)):
        with pytest.raises(ModelError, match="no transmission"):
            build_model("pendulum", plant, [refused])
