"""Every feedback of the catalogue, and each new one against what it is for."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.control.controller import ControlInputError, Law, Setpoint
from fric.control.feedbacks import CONTROLLERS
from fric.control.feedbacks.disturbance_observer import Filtered
from fric.control.feedbacks.friction_observer import Bristles
from fric.control.feedbacks.pid import Pid, PidError, PidGains
from fric.model import build_model, term

H = 1e-3
MASS, VISCOUS, COULOMB = 2.0, 20.0, 6.0
BASE = {"proportional": 2.0e4, "integral": 2.0e5, "derivative": 250.0, "filter_time": 1e-3}
VALUES: dict[str, dict[str, float]] = {
    "pid": BASE,
    "cascade": {"position_gain": 60.0, "velocity_gain": 250.0, "velocity_integral": 5e3, "velocity_weight": 1.0},
    "nonlinear_pid": {**BASE, "error_scale": 1e-4, "speed_scale": 5e-3},
    "disturbance_observer": {**BASE, "integral": 0.0, "inertia": MASS, "damping": VISCOUS, "observer_time": 5e-3},
    "friction_observer": {**BASE, "coulomb": COULOMB, "stiffness": 1e6},
    "reset_integral": {**BASE, "dead_zone": 2e-6},
    "adaptive": {**BASE, "inertia": MASS, "observer_time": 4e-3, "slow": 5e-3, "most_coulomb": 30.0, "most_viscous": 100.0},
}


def law(name: str, limit: float = 200.0, **changed: float) -> Law:
    kind = CONTROLLERS[name]
    given = {p.name: p.default for p in kind.parameters} | VALUES[name] | changed
    assert all(value is not None for value in given.values())
    values = {key: float(value) for key, value in given.items() if value is not None}
    assert kind.refusal(values) is None
    return kind.build(values, limit)


def sine(t: float, amplitude: float = 0.05, frequency: float = 0.5) -> Setpoint:
    w = 2.0 * math.pi * frequency
    s, c = math.sin(w * t), math.cos(w * t)
    # Starts at rest: half a cycle of (1 - cos).
    return Setpoint(amplitude * (1.0 - c), amplitude * w * s, amplitude * w * w * c)


class Axis:
    """Coulomb and viscous friction by Moreau's time stepping at 50 us."""

    def __init__(self, coulomb: float = COULOMB, static: float = 0.0, step: float = 1e-6) -> None:
        self.q = self.v = 0.0
        self.coulomb, self.static, self.step = coulomb, max(static, coulomb), step

    def advance(self, u: float) -> None:
        h = H / 20
        for _ in range(20):
            free = self.v + h / MASS * (u - VISCOUS * self.v)
            level = self.static if self.v == 0.0 else self.coulomb
            self.v = math.copysign(max(abs(free) - h / MASS * level, 0.0), free)
            self.q += h * self.v

    @property
    def seen(self) -> float:
        return self.step * round(self.q / self.step)


def follow(control: Law, duration: float, axis: Axis | None = None, begin: float = 0.0, rest: bool = False) -> np.ndarray:
    """Errors at the samples."""
    axis = Axis() if axis is None else axis
    errors = []
    for k in range(round(duration / H)):
        wanted = Setpoint(0.01) if rest else sine(begin + k * H)
        u = control.answer(wanted, axis.seen, H)
        assert abs(u) <= control.limit
        axis.advance(u)
        errors.append(wanted.position - axis.q)
    return np.array(errors)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_all_of_the_catalogue_are_tested() -> None:
    # Those that come from a design file have none of their own numbers to be tried with (test_tensor_product_control).
    designed = {name for name, kind in CONTROLLERS.items() if kind.designed is not None}
    assert designed == {"tensor_product"}
    assert set(VALUES) == set(CONTROLLERS) - designed


@pytest.mark.parametrize("name", VALUES)
class TestConformance:
    def test_it_follows_a_sine_and_counts_what_is_limited(self, name: str) -> None:
        errors = follow(law(name), 4.0)
        assert rms(errors[2000:]) < 6e-4
        tight = law(name, limit=5.0)
        axis = Axis()
        for k in range(500):
            assert abs(tight.answer(sine(k * H), axis.seen, H)) <= 5.0
            axis.advance(0.0)
        assert tight.saturated > 0

    def test_reset_makes_it_as_new(self, name: str) -> None:
        one = law(name)
        first = [one.answer(sine(k * H), 1e-3 * math.sin(k), H) for k in range(300)]
        one.reset()
        again = [one.answer(sine(k * H), 1e-3 * math.sin(k), H) for k in range(300)]
        assert again == first

    def test_it_begins_with_the_force_that_it_is_told(self, name: str) -> None:
        one = law(name)
        wanted, state = sine(0.3), (sine(0.3).position - 1e-5, sine(0.3).velocity)
        one.begin(wanted, state, 12.0, H)
        inertia = MASS * wanted.acceleration if name == "adaptive" else 0.0
        if name in ("cascade", "pid", "nonlinear_pid", "reset_integral", "friction_observer", "adaptive"):
            assert one.answer(wanted, state[0], H) - inertia == pytest.approx(12.0, abs=0.8)
        else:
            assert one.answer(wanted, state[0], H) == pytest.approx(12.0, abs=3.0)

    @pytest.mark.parametrize("bad", [math.nan, math.inf])
    def test_bad_input_is_refused_and_leaves_no_trace(self, name: str, bad: float) -> None:
        one, other = law(name), law(name)
        for k in range(10):
            one.answer(sine(k * H), 0.0, H), other.answer(sine(k * H), 0.0, H)
        with pytest.raises((ControlInputError, PidError)):
            one.answer(sine(0.01), bad, H)
        with pytest.raises((ControlInputError, PidError)):
            one.answer(Setpoint(bad), 0.0, H)
        assert one.answer(sine(0.01), 0.0, H) == other.answer(sine(0.01), 0.0, H)

    def test_wild_inputs_give_a_bounded_force(self, name: str) -> None:
        one = law(name)
        random = np.random.default_rng(3)
        for _ in range(3000):
            wanted = Setpoint(*(10.0 ** random.uniform(-9, 9, 3) * random.choice([-1, 1], 3)))
            u = one.answer(wanted, float(10.0 ** random.uniform(-9, 9)), float(10.0 ** random.uniform(-5, 0)))
            assert abs(u) <= 200.0


def test_filter_gives_the_derivatives_of_a_parabola() -> None:
    made = Filtered(0.004)
    made.reset(0.0)
    for k in range(1, 200):
        made.take(3.0 * (k * H) ** 2, H)
    assert made.bend == pytest.approx(6.0, rel=1e-9)
    t = 199 * H
    assert made.rate == pytest.approx(6.0 * (t - 2 * 0.004) - 6.0 * H * 1.0, rel=0.02)


def test_observer_estimates_a_constant_force_and_ignores_a_perfect_feedforward() -> None:
    one = law("disturbance_observer")
    axis = Axis(coulomb=0.0)
    for k in range(4000):
        axis.advance(one.answer(sine(k * H), axis.q, H, MASS * sine(k * H).acceleration + VISCOUS * sine(k * H).velocity) + 7.0)
    assert one.disturbance == pytest.approx(-7.0, abs=0.3)


def test_observer_beats_the_pid_that_it_contains() -> None:
    plain, observed = follow(law("pid", integral=0.0), 4.0), follow(law("disturbance_observer"), 4.0)
    assert rms(observed[2000:]) < 0.45 * rms(plain[2000:])


def test_nonlinear_pid_is_the_pid_where_the_factors_are_one() -> None:
    pid = Pid(PidGains(**BASE), 200.0)
    other = law("nonlinear_pid", proportional_factor=1.0, integral_factor=1.0)
    for k in range(500):
        wanted, seen = sine(k * H), sine(k * H).position - 1e-4 * math.sin(0.1 * k)
        assert other.answer(wanted, seen, H) == pytest.approx(pid.step(wanted.position, seen, H), rel=1e-9, abs=1e-9)


def test_nonlinear_pid_settles_faster_against_friction() -> None:
    plain = follow(law("pid", integral=3e4), 1.0, rest=True)
    quick = follow(law("nonlinear_pid", integral=3e4, integral_factor=6.0, error_scale=1e-3), 1.0, rest=True)
    assert rms(quick[200:]) < 0.6 * rms(plain[200:])


def hunting(control: Law) -> float:
    """Width of the motion in the last 6 of 16 s of rest, with a static force above the Coulomb force."""
    return float(np.ptp(follow(control, 16.0, Axis(static=2.0 * COULOMB, step=1e-6), rest=True)[10000:]))


def test_where_a_pid_hunts_resetting_does_not() -> None:
    assert hunting(law("pid")) > 2e-5
    assert hunting(law("reset_integral", dead_zone=2e-6)) < 3e-6


def test_bristles_reach_the_level_and_stay_bounded() -> None:
    bristles = Bristles(6.0, 8.0, 1e-2, 1e6, 100.0)
    z = 0.0
    for _ in range(200):
        z, force = bristles.led(z, 0.1, 0.0, H)
    assert force == pytest.approx(6.0, rel=1e-6)
    z, force = bristles.led(z, -1e9, 1e9, H)
    assert abs(force) <= 8.0
    assert abs(z) <= 8.0 / 1e6


def test_friction_observer_takes_most_of_the_reversal_error_away() -> None:
    plain, observed = follow(law("pid"), 4.0), follow(law("friction_observer"), 4.0)
    assert np.max(np.abs(observed[2000:])) < 0.5 * np.max(np.abs(plain[2000:]))


@pytest.mark.parametrize(("name", "expected"), [("friction_observer", {"coulomb": 6.0, "static": 8.0, "stiffness": 1e6})])
def test_values_from_a_model(name: str, expected: dict[str, float]) -> None:
    terms = [
        term("coulomb", force=6.0),
        term("stribeck", force=2.0, velocity=0.01),
        term("presliding", "lugre", stiffness=1e6, damping=10.0),
    ]
    kind = CONTROLLERS[name]
    assert kind.from_model is not None
    assert kind.from_model(build_model("rigid", {"mass": 2.0}, terms)).items() >= expected.items()


class TestAdaptive:
    def adapted(self) -> tuple[Law, Axis]:
        one, axis = law("adaptive"), Axis()
        follow(one, 10.0, axis)
        return one, axis

    def test_it_learns_the_friction(self) -> None:
        one, _ = self.adapted()
        assert one.theta[:2] == pytest.approx([COULOMB, VISCOUS], rel=0.15)  # type: ignore[attr-defined]

    @pytest.mark.parametrize("factor", [2.0, 0.5])
    def test_a_change_of_friction_is_learnt_in_ten_seconds(self, factor: float) -> None:
        one, axis = self.adapted()
        before = rms(follow(one, 4.0, axis, 10.0))
        axis.coulomb = axis.static = factor * COULOMB
        follow(one, 10.0, axis, 14.0)
        assert one.theta[0] == pytest.approx(factor * COULOMB, rel=0.15)  # type: ignore[attr-defined]
        after = rms(follow(one, 4.0, axis, 24.0))
        assert after < max(factor, 1.2) * before

    def test_rest_teaches_nothing(self) -> None:
        one, axis = self.adapted()
        follow(one, 2.0, axis, rest=True)
        held = one.theta.copy()  # type: ignore[attr-defined]
        for k in range(60000):
            one.answer(Setpoint(0.01), 0.01 + 1e-6 * (k % 7 == 0), H)
        assert np.array_equal(one.theta, held)  # type: ignore[attr-defined]
