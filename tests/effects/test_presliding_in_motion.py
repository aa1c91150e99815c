"""Bodies on each pre-sliding law: against event-driven integrations, closed forms, and what the laws are known for."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from fric.model import Model, Term, build_model, term
from fric.simulation import Predictor, Simulator
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]

MASS, COULOMB, SURPLUS, STRIBECK, VISCOUS = 1.2, 4.0, 2.0, 0.01, 10.0
STIFFNESS = 1e5
STATIC = COULOMB + SURPLUS
SPRINGS = {"stiffness_1": 5e4, "limit_1": 3e-5, "stiffness_2": 3e4, "limit_2": 6e-5, "stiffness_3": 2e4, "limit_3": 9e-5}
LAWS: dict[str, Term] = {
    "dahl": term("presliding", "dahl", stiffness=STIFFNESS),
    "elasto_plastic": term("presliding", "elasto_plastic", stiffness=STIFFNESS, damping=100.0, breakaway=0.6),
    "gms": term("presliding", "gms", stiffness=STIFFNESS, attraction=400.0, exponent=1.5, elements=4.0, damping=50.0),
    "maxwell_slip": term("presliding", "maxwell_slip", **SPRINGS),
}
EVERY = pytest.mark.parametrize("law", sorted(LAWS))


def axis(law: str, bias: float = 0.0, surplus: float = SURPLUS, viscous: float = VISCOUS, mass: float = MASS) -> Model:
    """One structure for each law, so that it is compiled once; what a test doesn't need is zero."""
    terms = [
        term("coulomb", force=COULOMB),
        term("stribeck", "exponential", force=surplus, velocity=STRIBECK),
        LAWS[law],
        term("viscous", coefficient=viscous),
        term("bias", force=bias),
    ]
    return build_model("rigid", {"mass": mass}, terms)


def g(v: float, surplus: float = SURPLUS) -> float:
    return float(COULOMB + surplus * np.exp(-((v / STRIBECK) ** 2)))


# --- the equations, typed a second time: rates of the states and the force ---


def dahl(v: float, z: Array) -> tuple[Array, float]:
    f = STIFFNESS * z[0]
    df = STIFFNESS * (1.0 - f / g(v) * np.sign(v)) * v
    return np.array([df / STIFFNESS]), f


def elasto_plastic(v: float, z: Array) -> tuple[Array, float]:
    z_max = g(v) / STIFFNESS
    z_ba = 0.6 * z_max
    size = abs(z[0])
    if z[0] * v <= 0.0 or size <= z_ba:
        alpha = 0.0
    elif size >= z_max:
        alpha = 1.0
    else:
        alpha = 0.5 * np.sin(np.pi * (size - 0.5 * (z_max + z_ba)) / (z_max - z_ba)) + 0.5
    dz = v * (1.0 - alpha * size / z_max)
    return np.array([dz]), STIFFNESS * z[0] + 100.0 * dz


def integrated(
    rates: Callable[[float, Array], tuple[Array, float]], n: int, effort: Array, hold: float, step: float
) -> tuple[Array, Array]:
    """Position at every ``step`` and the mean of friction over it, for a law whose states have smooth rates."""

    def right_side(t: float, y: Array, u: float) -> Array:
        dz, friction = rates(y[1], y[2 : 2 + n])
        return np.r_[y[1], (u - friction - VISCOUS * y[1]) / MASS, dz, friction]

    y = np.zeros(3 + n)
    rows = [y]
    grid = step * np.arange(1, round(hold / step) + 1)
    for u in effort:
        answer = solve_ivp(
            right_side, (0.0, grid[-1]), y, method="LSODA", rtol=1e-10, atol=1e-14, t_eval=grid, args=(u,), first_step=1e-6
        )
        assert answer.success
        rows += list(answer.y.T)
        y = answer.y[:, -1]
    states = np.array(rows)
    return states[:, 0], np.diff(states[:, -1]) / step


def element_run(
    stiffness: Array, shares: Array, damping: float, attraction: float, surplus: float, effort: Array, hold: float, step: float
) -> tuple[Array, Array]:
    """The same for springs on sliders, from event to event: an element reaches its limit, or the body turns."""
    m = stiffness.shape[0]
    sliding = np.zeros(m, dtype=bool)

    def rates(y: Array, s: float, on: Array) -> Array:
        """Of the deflections, along the motion."""
        v, d = abs(y[1]), s * y[2:-1]
        limit = shares * g(v, surplus) / stiffness
        pull = attraction / g(v, surplus)
        # A sliding element never slides backwards; one that is bent against the motion beyond its limit gives way.
        found: Array = np.where(on, np.minimum(v, pull * (limit - d)), np.maximum(v, pull * (-limit - d)))
        return found

    def over(y: Array, s: float, on: Array) -> Array:
        found: Array = np.where(on, -1.0, s * y[2:-1] - shares * g(y[1], surplus) / stiffness)
        return found

    def right_side(t: float, y: Array, u: float, s: float, on: Array) -> Array:
        dd = rates(y, s, on)
        friction = stiffness @ y[2:-1] + damping * s * np.mean(np.clip(dd, 0.0, abs(y[1])))
        return np.r_[y[1], (u - friction - VISCOUS * y[1]) / MASS, s * dd, friction]

    def turns(t: float, y: Array, u: float, s: float, on: Array) -> float:
        return float(s * y[1])

    def breaks(t: float, y: Array, u: float, s: float, on: Array) -> float:
        return float(np.max(over(y, s, on)))

    for event, direction in ((turns, -1.0), (breaks, 1.0)):
        event.terminal, event.direction = True, direction  # type: ignore[attr-defined]
    y = np.zeros(3 + m)
    rows = [y]
    for u in effort:
        t = 0.0
        s = float(np.sign(y[1]) or np.sign(u - stiffness @ y[2:-1]))
        while t < hold:
            sliding = sliding | (over(y, s, sliding) >= -1e-15)  # of a metre: at its limit but for the event's rounding
            answer = solve_ivp(
                right_side, (t, hold), y, method="DOP853", rtol=1e-11, atol=1e-15, args=(u, s, sliding), events=(turns, breaks),
                dense_output=True, max_step=1e-3,
            )  # fmt: skip
            assert answer.success
            k = np.arange(int(np.floor(t / step + 1e-9)) + 1, int(np.floor(answer.t[-1] / step + 1e-9)) + 1)
            rows += [answer.sol(step * j) for j in k]
            t, y = answer.t[-1], answer.y[:, -1].copy()
            if answer.t_events[0].size:
                sliding, s, y[1] = np.zeros(m, dtype=bool), -s, 0.0
            elif answer.t_events[1].size:
                sliding = sliding.copy()
                sliding[int(np.argmax(over(y, s, sliding)))] = True
    states = np.array(rows)
    return states[:, 0], np.diff(states[:, -1]) / step


# Force constant for 10 ms each: pre-sliding first, then through break-away, sliding and two reversals.
EFFORT = np.r_[3.0 * np.sin(0.4 * (np.arange(20) + 0.5)), 12.0 * np.sin(2 * np.pi * 1.3 * (0.01 * np.arange(60) + 0.005))]


def reference(law: str, step: float) -> tuple[Array, Array]:
    if law == "dahl":
        return integrated(dahl, 1, EFFORT, 0.01, step)
    if law == "elasto_plastic":
        return integrated(elasto_plastic, 1, EFFORT, 0.01, step)
    if law == "gms":
        xi = 1 - (1 - (np.arange(1, 5) - 0.5) / 4) ** (1 / 1.5)
        return element_run(np.full(4, STIFFNESS / 4), xi / xi.sum(), 50.0, 400.0, SURPLUS, EFFORT, 0.01, step)
    stiffness = np.array([5e4, 3e4, 2e4])
    shares = stiffness * np.array([3e-5, 6e-5, 9e-5])
    # At a constant level: there attraction plays no part.
    return element_run(stiffness, shares / shares.sum(), 0.0, 1.0, 0.0, EFFORT, 0.01, step)


@EVERY
def test_force_and_motion_at_1_khz_match_an_independent_integration(law: str) -> None:
    q, expected = reference(law, 1e-3)
    model = axis(law, surplus=0.0 if law == "maxwell_slip" else SURPLUS)
    for n_substeps, force_goal, position_goal in ((None, 2e-4, 1e-5), (32, 3e-5, 1e-6)):
        states, friction = Simulator(model).run(np.repeat(EFFORT, 10), 1e-3, n_substeps)
        assert np.max(np.abs(friction - expected)) < force_goal * np.ptp(expected)
        assert np.max(np.abs(states[:, 0] - q[1:])) < position_goal * np.ptp(q)


@EVERY
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_break_away_under_a_slow_ramp_takes_coulomb_and_stribeck_force_together(law: str, direction: float) -> None:
    effort = direction * np.linspace(0.0, 8.0, 16_001)
    states, friction = Simulator(axis(law)).run(effort, 1e-3)
    slips = int(np.argmax(np.abs(states[:, 1]) > 0.05))
    assert abs(effort[slips]) == pytest.approx(STATIC, rel=0.02)
    assert np.max(direction * friction) == pytest.approx(STATIC, rel=0.02)


@EVERY
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_small_force_bends_the_springs_by_force_over_stiffness(law: str, direction: float) -> None:
    push = direction * 6e-4
    # Viscous friction, so heavy that even the law without damping of its own comes to rest.
    states, friction = Simulator(axis(law, viscous=600.0)).run(np.full(3000, push), 1e-3)
    assert states[-1, 0] == pytest.approx(push / STIFFNESS, rel=1e-3)
    assert friction[-1] == pytest.approx(push, rel=1e-6)


@EVERY
def test_a_body_at_rest_on_its_springs_comes_to_rest_for_good(law: str) -> None:
    states, friction = Simulator(axis(law, bias=3.0, viscous=600.0)).run(np.zeros(40_000), 1e-3)
    assert np.max(np.abs(states[-1000:, 1])) < 1e-15
    assert states[-1, 0] == pytest.approx(states[20_000, 0], abs=1e-15)
    assert friction[-1] == pytest.approx(-3.0, rel=1e-12)


@EVERY
def test_sample_by_sample_is_one_run_to_the_last_bit(law: str) -> None:
    effort = 9.0 * np.sin(0.02 * np.arange(400))
    states, friction = Simulator(axis(law)).run(effort, 1e-3)
    single = Simulator(axis(law))
    for k, force in enumerate(effort):
        mean = single.step(float(force), 1e-3)
        assert (single.position, single.velocity, mean) == (states[k, 0], states[k, 1], friction[k])


@EVERY
def test_the_predictor_finds_the_force_that_moved_it(law: str) -> None:
    t = 5e-4 * (np.arange(6000) + 0.5)
    effort = 14.0 * np.sin(2 * np.pi * 0.7 * t)
    states, _ = Simulator(axis(law)).run(effort, 5e-4, 1)
    q, v = np.r_[0.0, states[:, 0]], np.r_[0.0, states[:, 1]]
    mean = 0.5 * (v[1:] + v[:-1])
    wanted, _ = Predictor(axis(law)).run(t, 0.5 * (q[1:] + q[:-1]), mean, np.diff(v) / 5e-4, 5e-4)
    # Where the axis turns within a sample, the predictor can't know the instant.
    on = v[1:] * v[:-1] > 0
    assert np.mean(on) > 0.99
    assert np.sqrt(np.mean((wanted - effort)[on] ** 2)) < 1e-3 * 14.0


# --- what the laws are known for, displacement-driven ---


def along(law: str, corners: list[float], way: float = 1.3e-7, level: float = COULOMB) -> tuple[Array, Array]:
    """Displacement at the middle of each step and friction, from corner to corner [x] in steps of about ``way``."""
    parts = [np.linspace(a, b, max(int(abs(b - a) / way), 1), endpoint=False) for a, b in pairwise(corners)]
    path = np.r_[np.concatenate(parts), corners[-1]]
    middle = 0.5 * (path[1:] + path[:-1])
    n = middle.shape[0]
    terms = axis(law, surplus=0.0, viscous=0.0).with_value("coulomb.force", level)
    _, friction = Predictor(terms).run(1e-3 * np.arange(n), middle, np.diff(path) / 1e-3, np.zeros(n), 1e-3)
    return middle, friction


@pytest.mark.parametrize("law", ["gms", "maxwell_slip"])
def test_turning_back_follows_masing(law: str) -> None:
    # Masing 1926: the branch after a reversal is the first loading, twice as large in both directions.
    damping = 50.0 * 1.3e-4 if law == "gms" else 0.0  # greatest force of the damping at the speed of the walk
    q, first = along(law, [0.0, 3e-4])
    q_back, back = along(law, [0.0, 3e-4, -5e-4])
    turned = q_back.shape[0] - int(np.sum(np.diff(q_back) < 0.0)) - 1
    expected = back[turned - 1] - 2.0 * np.interp(0.5 * (3e-4 - q_back[turned + 1 :]), q, first)
    assert np.max(np.abs(back[turned + 1 :] - expected)) < 2e-2 * COULOMB + 3 * damping
    assert back[-1] == pytest.approx(-COULOMB, rel=1e-9)


@pytest.mark.parametrize(("law", "remembers"), [("gms", True), ("maxwell_slip", True), ("dahl", False)])
def test_nested_inner_loops_are_forgotten_once_closed(law: str, remembers: bool) -> None:
    outer = [0.0, 8.1e-5, -8.1e-5]
    q, plain = along(law, [*outer, 8.1e-5])
    nested = [1.7e-5, -3.3e-5, 0.6e-5, -2.1e-5, 0.6e-5, -3.3e-5, 1.7e-5]
    q_nested, inner = along(law, [*outer, *nested, 8.1e-5])
    after = int(np.flatnonzero(np.diff(q_nested) < 0.0)[-1]) + 1
    after += int(np.argmax(q_nested[after:] > 1.75e-5))
    rising = slice(plain.shape[0] - int(1.62e-4 / 1.3e-7), None)
    off = float(np.max(np.abs(inner[after:] - np.interp(q_nested[after:], q[rising], plain[rising])))) / float(np.ptp(plain))
    assert (off < 3e-3) is remembers
    if not remembers:
        assert off > 0.03


def test_gms_lags_behind_the_slip_level_as_its_equation_says() -> None:
    # All elements slide: their sum obeys dF/dt = C (1 - F/g(v)).
    t = 1e-4 * np.arange(20_000)
    v = 0.02 + 0.012 * np.sin(2 * np.pi * 5.0 * t)
    model = axis("gms", viscous=0.0)
    _, friction = Predictor(model).run(t, np.cumsum(v) * 1e-4, v, np.zeros(t.shape[0]), 1e-4)
    answer = solve_ivp(
        lambda t, y: [400.0 * (1.0 - y[0] / g(0.02 + 0.012 * np.sin(2 * np.pi * 5.0 * t)))],
        (1.0, t[-1]), [friction[10_000]], method="LSODA", rtol=1e-9, atol=1e-9, t_eval=t[10_000:],
    )  # fmt: skip
    damping = 50.0 * 0.04  # acts on elements that are pulled up
    assert np.max(np.abs(friction[10_000:] - answer.y[0])) < damping
    undamped = model.with_value("presliding.damping", 0.0)
    _, friction = Predictor(undamped).run(t, np.cumsum(v) * 1e-4, v, np.zeros(t.shape[0]), 1e-4)
    last = t > 1.5
    assert np.max(np.abs(friction[last] - answer.y[0][last[10_000:]])) < 2e-3 * STATIC
    # At equal velocity there is more friction while it speeds up.
    middle = last & (np.abs(v - 0.02) < 1e-3)
    up, down = middle & (np.gradient(v) > 0), middle & (np.gradient(v) < 0)
    assert np.min(friction[up]) > np.max(friction[down]) + 0.02


def test_elasto_plastic_goes_nowhere_below_break_away_and_creeps_above() -> None:
    t = 1e-3 * np.arange(20_000)
    for amplitude, creeps in ((1.0, False), (2.4, True)):  # elastic up to 0.6 of 6 N
        effort = 2.0 + amplitude * np.sin(2 * np.pi * 10.0 * t)
        states, _ = Simulator(axis("elasto_plastic", viscous=600.0)).run(effort, 1e-3)
        drift = float(abs(states[-1, 0] - states[9_999, 0]))
        assert (drift > 1e-6) is creeps
        if not creeps:
            assert drift < 1e-16
