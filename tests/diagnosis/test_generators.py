"""Generators of truth against closed forms, against another integrator, and against each other: three hands, one physics."""

from __future__ import annotations

import ast
import math
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import grimp
import numpy as np
import pytest
from fric.diagnosis.prove import cases
from fric.diagnosis.prove.axis import Setting, draw_setting
from fric.diagnosis.prove.cases import draw, plan
from fric.diagnosis.prove.concealed import CONCEALED, Concealed
from fric.diagnosis.prove.course import Course, Run
from fric.diagnosis.prove.examination import hold
from fric.diagnosis.prove.generators import GENERATORS
from fric.diagnosis.prove.generators.controllers import CONTINUOUS, SAMPLED, Controller, drawn_controller
from fric.diagnosis.prove.generators.generator import Generator
from fric.diagnosis.prove.generators.motions import drawn_motion
from fric.diagnosis.prove.outside import OUTSIDE, Outside
from fric.diagnosis.prove.physics import FIELDS, Physics
from fric.diagnosis.prove.truth import Loop, integrate
from fric.errors import InputError
from scipy.integrate import solve_ivp

_H = 1e-3
_OPEN = Controller(SAMPLED, 1.0 / _H, 0.0, 0.0, 0.0, 0.0, math.inf)

each_hand = pytest.mark.parametrize("hand", GENERATORS.values(), ids=GENERATORS)


def _course(reference: np.ndarray, force: np.ndarray) -> Course:
    n, zeros = force.shape[0], np.zeros_like(force)
    return Course(reference, force, np.ones(n), zeros, np.zeros((0, 2)), zeros)


def _pushed(hand: Generator, physics: Physics, force: np.ndarray) -> Run:
    """The axis under a given force, from rest at 0, with an ideal encoder."""
    return hand.lead(physics, _OPEN, _course(np.zeros_like(force), force), 0.0, _H)


@each_hand
def test_coasting_against_dry_friction_stops_after_the_closed_form_distance_and_stays(hand: Generator) -> None:
    run = _pushed(hand, Physics(mass=1.5, coulomb=2.0), np.where(np.arange(2000) < 500, 6.0, 0.0))
    speed = (6.0 - 2.0) / 1.5 * 0.5
    # MuJoCo's first-order steps are off by half a step of 0.1 ms times the speed.
    rel = 1e-8 if hand.name == "events" else 1e-3
    assert run.seen[-1] - run.seen[500] == pytest.approx(speed**2 * 1.5 / (2.0 * 2.0), rel=rel)
    assert abs(run.speed[-1]) <= (0.0 if hand.name == "events" else 1e-12)
    assert run.direction[-1] == 0.0


@each_hand
def test_a_body_sticks_below_the_level(hand: Generator) -> None:
    """MuJoCo's soft constraint creeps at about 1e-8 s times the acceleration of the push alone: below an encoder's step."""
    run = _pushed(hand, Physics(mass=1.0, coulomb=3.0), np.full(2000, 2.7))
    if hand.name == "events":
        assert np.all(run.seen == 0.0)
        return
    creep = run.seen[-1] / 2.0 / 2.7
    assert 0.0 < creep < 2e-8
    # The least step of an encoder is 1e-6 of the travel, and accelerations are about 20 /s^2 of it.
    travel = 2.7 / 20.0
    assert run.seen[-1] < 1e-6 * travel


@each_hand
def test_viscous_friction_alone_decays_exponentially(hand: Generator) -> None:
    run = _pushed(hand, Physics(mass=2.0, viscous=5.0), np.where(np.arange(1500) < 100, 4.0, 0.0))
    speed = 4.0 / 5.0 * (1.0 - math.exp(-5.0 / 2.0 * 0.1))
    found = run.speed[100:] / (speed * np.exp(-2.5 * np.arange(1400) * _H))
    assert np.max(np.abs(found - 1.0)) < (1e-9 if hand.name == "events" else 5e-4)


@each_hand
def test_a_load_stays_until_the_gap_is_crossed_and_an_impact_keeps_the_momentum(hand: Generator) -> None:
    physics = Physics(mass=3.0, load_share=1.0 / 3.0, gap=0.02)
    run = _pushed(hand, physics, np.where(np.arange(1000) < 50, 2.0, 0.0))
    speed = 2.0 / 2.0 * 0.05
    crossed = 0.05 + (0.01 - 0.5 * 0.05**2) / speed  # [s]
    before = run.seen < 0.01
    assert np.flatnonzero(~before)[0] * _H == pytest.approx(crossed, abs=1.1 * _H)
    # MuJoCo's ends give back up to a sixty-fourth of the speed.
    rel = 1e-9 if hand.name == "events" else 1e-2
    assert run.speed[60] == pytest.approx(speed, rel=rel)
    assert run.speed[-1] == pytest.approx(speed * 2.0 / 3.0, rel=rel)
    # A load whose friction is larger than the force: both slide on for the momentum of the motor, and stay.
    held = _pushed(hand, physics.using({"coulomb": 8.0}), np.full(1000, 2.0))
    slid = (2.0 / 3.0) ** 2 * 2.0 * 0.01 / (2.0 * (8.0 - 2.0) / 3.0)
    assert held.seen[-1] == pytest.approx(0.01 + slid, rel=1e-9 if hand.name == "events" else 5e-3)


@each_hand
def test_a_shaft_swings_at_the_frequency_of_two_masses(hand: Generator) -> None:
    stiffness, first, second = 800.0, 0.8, 1.2
    physics = Physics(mass=2.0, load_share=0.6, shaft=stiffness)
    run = _pushed(hand, physics, np.where(np.arange(4096) < 5, 10.0, 0.0))
    rate = run.speed[5:] - np.mean(run.speed[5:])
    spectrum = np.abs(np.fft.rfft(rate * np.hanning(rate.shape[0]), 1 << 17))
    found = np.argmax(spectrum) / (1 << 17) / _H
    expected = math.sqrt(stiffness * (1.0 / first + 1.0 / second)) / (2.0 * math.pi)
    assert found == pytest.approx(expected, rel=1e-3)


@each_hand
def test_a_delayed_command_is_written_when_it_is_given(hand: Generator) -> None:
    run = _pushed(hand, Physics(mass=1.0, delay=0.05), np.where(np.arange(300) < 100, 5.0, 0.0))
    np.testing.assert_allclose(run.command, np.where(np.arange(300) < 100, 5.0, 0.0), atol=1e-9)
    assert run.speed[50] == pytest.approx(0.0, abs=1e-12)
    assert run.speed[60] == pytest.approx(0.05, rel=1e-6)


def test_events_agree_with_an_integrator_of_scipy() -> None:
    """An analogue loop that swings in with friction: every mode of its own by ``solve_ivp``, from event to event."""
    physics = Physics(mass=1.2, coulomb=2.0, viscous=3.0, stribeck=1.0, stribeck_velocity=0.02)
    kp, kd, goal = 900.0, 12.0, 0.05
    reference = np.full(3000, goal)
    reference[0] = 0.0
    run = GENERATORS["events"].lead(
        physics, Controller(CONTINUOUS, 0.0, kp, kd, 0.0, 0.0, 1e9), _course(reference, np.zeros(3000)), 0.0, _H
    )

    def wanted(t: float) -> tuple[float, float]:
        return (goal * t / _H, goal / _H) if t < _H else (goal, 0.0)

    def push(t: float, q: float, v: float) -> float:
        r, rate = wanted(t)
        return kp * (r - q) + kd * (rate - v) - 3.0 * v

    def turned(t: float, x: np.ndarray, way: float) -> float:
        return float(x[1])

    turned.terminal = True  # type: ignore[attr-defined]
    t, x, way = 0.0, np.zeros(2), 1.0
    for end in (_H, 3.0):
        while t < end:

            def slope(t: float, x: np.ndarray, way: float) -> list[float]:
                level = 2.0 + math.exp(-((x[1] / 0.02) ** 2))
                return [x[1], (push(t, x[0], x[1]) - way * level) / 1.2]

            turned.direction = -way  # type: ignore[attr-defined]
            found = solve_ivp(slope, (t, end), x, "DOP853", events=turned, args=(way,), rtol=1e-11, atol=1e-14)
            t, x = float(found.t[-1]), found.y[:, -1]
            if found.status == 1:
                x[1], way = 0.0, -way
                if abs(push(t, x[0], 0.0)) <= 3.0:
                    break
    assert run.seen[-1] == pytest.approx(x[0], abs=1e-9)
    assert run.speed[-1] == 0.0


class _Nothing:
    needs = lacks = frozenset[str]()

    @staticmethod
    def make(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], dict[str, float]]:
        return lambda s: {}


def _three(entry: Concealed | Outside | _Nothing) -> tuple[Setting, Run, Run, dict[str, Run]]:
    """The axis without and with what is concealed by the usual hand, and with it by the others, in one loop for all."""
    random = np.random.default_rng(3)
    at = draw_setting(random, getattr(entry, "needs", frozenset()), entry.lacks, 1.0)
    physics = at.physics.using(entry.make(at, random, 0)(1.0))
    if physics.payload_time > 0.0:
        physics = physics.using({"payload_time": 1.1})
    h, n = at.sample_time, round(2.5 / at.sample_time)
    t = np.arange(n) * h
    reference = at.travel * (0.2 * np.sin(4.4 * t) + 0.04 * np.sin(18.2 * t)) * np.minimum(1.0, t / 0.5)
    mass = at.physics.mass
    kp, kd, most = mass * at.bandwidth**2, 1.6 * mass * at.bandwidth, 20.0 * (at.friction + mass * at.acceleration)
    course = Course(
        reference, np.zeros(n), 1.0 + 0.3 * np.sin(2.0 * t), 9.0 * np.sin(t), np.array([[0.4, 0.9], [1.5, 2.2]]), np.zeros(n)
    )
    loop = Loop(kp, kd, most, h, 0.0)
    bare, usual = integrate(at.physics, loop, course), integrate(physics, loop, course)
    # The usual loop looks back for the rate of the reference, the others look ahead.
    back = np.diff(reference, prepend=reference[0]) / h
    ahead = np.append(np.diff(reference), 0.0) / h
    same = replace(course, feedforward=kd * (back - ahead))
    controller = Controller(SAMPLED, 1.0 / h, kp, kd, 0.0, h, most)
    others = {
        name: hand.lead(physics, controller, same, 0.0, h)
        for name, hand in GENERATORS.items()
        if getattr(entry, "effect", "") not in hand.without
    }
    return at, bare, usual, others


@pytest.mark.parametrize("name", ["nothing", *CONCEALED, *OUTSIDE])
def test_every_effect_is_the_same_in_every_hand(name: str) -> None:
    """Errors are those of steps: 20 us of the usual hand, 100 us of MuJoCo, none that counts between events."""
    entry: Concealed | Outside | _Nothing = CONCEALED.get(name) or OUTSIDE.get(name) or _Nothing()
    at, bare, usual, others = _three(entry)
    if name != "nothing":
        assert np.std(usual.command - bare.command) > 0.003 * np.std(usual.command)
    for hand, run in others.items():
        place, force, way = {"events": (4e-6, 1.5e-3, 5e-4), "mujoco": (3e-5, 8e-3, 6e-3)}[hand]
        assert np.sqrt(np.mean((run.seen - usual.seen) ** 2)) < place * at.travel, hand
        assert np.std(run.command - usual.command) < force * np.std(usual.command), hand
        assert np.mean(np.abs(run.direction - usual.direction)) < way, hand
        assert np.std(run.speed - usual.speed) < 5e-3 * np.std(usual.speed), hand


@each_hand
def test_what_a_hand_does_not_honour_it_refuses(hand: Generator) -> None:
    for name in FIELDS:
        other = Physics().using({name: 2.0})
        if hand.honoured.get(name) == ():
            hand.check(other)
        else:
            with pytest.raises(InputError, match=f"does not honour {name}"):
                hand.check(other)
    with pytest.raises(InputError, match="elements"):
        hand.check(Physics(elements=((1.0, 1.0),)))
    with pytest.raises(InputError, match="either gap or shaft"):
        _pushed(hand, Physics(load_share=0.5, gap=1e-3, shaft=1e3), np.zeros(10))
    # Everything that a case of its variant can be is honoured.
    random = np.random.default_rng(1)
    at = draw_setting(random, frozenset(), frozenset(), 1.0)
    for name, entry in (CONCEALED | OUTSIDE).items():
        for _ in range(4):
            if name not in hand.without:
                hand.check(at.physics.using(entry.make(at, random, 0)(1.0)))
    assert not hand.without & {name for order in plan(300, 1, hand.name) for name in order.names}


def test_no_delay_is_behind_an_analogue_loop() -> None:
    analogue = Controller(CONTINUOUS, 0.0, 10.0, 1.0, 0.0, 0.0, 1e9)
    zeros = np.zeros(10)
    with pytest.raises(InputError, match="analogue"):
        GENERATORS["events"].lead(Physics(delay=0.01), analogue, _course(zeros, zeros), 0.0, _H)


@each_hand
def test_a_case_follows_from_its_seed(hand: Generator, monkeypatch: pytest.MonkeyPatch) -> None:
    def short(*given: object) -> Setting:
        return replace(draw_setting(*given), train_time=2.0, validation_time=2.0, sample_time=0.004)  # type: ignore[arg-type]

    monkeypatch.setattr(cases, "draw_setting", short)
    monkeypatch.setattr(cases, "_check", lambda *_: None)
    first, second = draw(5, "nothing", (), hand.name), draw(5, "nothing", (), hand.name)
    for a, b in zip(first.train + first.validation, second.train + second.validation, strict=True):
        np.testing.assert_array_equal(a.effort, b.effort)
        np.testing.assert_array_equal(a.position, b.position)
        np.testing.assert_array_equal(a.time, b.time)
    assert first.key == second.key
    assert {"controller", "dirt"} <= set(first.key)


def test_motions_of_work_stay_on_the_axis_and_end_at_rest() -> None:
    random = np.random.default_rng(8)
    axis = draw_setting(random, frozenset(), frozenset(), 1.0).axis(1.0)
    for _ in range(20):
        reference, push = drawn_motion(axis, 20.0, random)
        assert reference.shape == push.shape
        assert 20.0 <= reference.shape[0] * axis.sample_time < 60.0
        assert np.max(np.abs(reference)) <= 0.5 * axis.travel
        speed = np.diff(reference) / axis.sample_time
        assert np.max(np.abs(speed)) <= 1.05 * axis.top_speed
        assert np.all(speed[-10:] == 0.0)
        assert not np.any(push)


def test_controllers_are_of_every_kind_and_no_delay_meets_an_analogue_one() -> None:
    random = np.random.default_rng(2)
    at = draw_setting(random, frozenset(), frozenset(), 1.0)
    assert {drawn_controller(at, False, random).kind for _ in range(40)} == {"continuous", "sampled", "cascade"}
    sampled = [drawn_controller(at, True, random) for _ in range(40)]
    assert {each.kind for each in sampled} == {"sampled", "cascade"}
    assert all(200.0 <= each.rate <= 5000.0 for each in sampled)


def test_hands_share_no_equation() -> None:
    """Neither the usual truth's, nor those of what is examined, nor each other's; imports within functions count."""
    graph = grimp.build_graph("fric", cache_dir=None)
    own = "fric.diagnosis.prove.generators"
    assert graph.find_downstream_modules("fric.diagnosis.prove.laws") >= {"fric.diagnosis.prove.chain"}
    for module in graph.find_children(own):
        known = graph.find_upstream_modules(module)
        for other in ("diagnosis.prove.truth", "diagnosis.prove.chain", "diagnosis.prove.laws", "engine", "effects", "model"):
            assert not {each for each in known if each == f"fric.{other}" or each.startswith(f"fric.{other}.")}, module
        foreign = "events" if module.startswith(f"{own}.mujoco") else "mujoco"
        assert not [each for each in known if each.startswith(f"{own}.{foreign}")] or module == own
    # The graph sees what is written: so does whoever looks into the files.
    folder = Path(sys.modules[own].__file__ or "").parent
    written = {
        name
        for path in folder.glob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ImportFrom)
        for name in [node.module or ""]
    }
    assert not {each for each in written if each.split(".")[-1] in ("chain", "laws", "truth", "engine", "effects")}


def test_what_has_to_be_installed_is_said_before_anything_is_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(InputError, match=r"mujoco is not installed.*fric\[peers\]"):
        hold(2, 1, tmp_path / "proof", variant="mujoco")
    assert not (tmp_path / "proof").exists()
