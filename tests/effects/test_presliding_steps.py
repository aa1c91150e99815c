"""One step of each pre-sliding law at constant velocity against integrations of its equations, typed here a second time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
import pytest
from fric.effect import Effect
from fric.effects import EFFECTS
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
Rate = Callable[[float, float, float, float], float]

LEVEL = 5.0
STIFFNESS = 1e5
SCALE = LEVEL / STIFFNESS  # displacement over which sliding begins [x]
SPRINGS = ((4e4, 2e-5), (3e4, 5e-5), (0.0, 1e-5), (2e4, 9e-5), (1e4, 8.9e-5), (0.0, 0.0))
SPRINGS_LEVEL = sum(k * limit for k, limit in SPRINGS)

VALUES: dict[str, tuple[float, ...]] = {
    "lugre": (STIFFNESS, 100.0),
    "dahl": (STIFFNESS, 1.0),
    "elasto_plastic": (STIFFNESS, 100.0, 0.7),
    "gms": (STIFFNESS, 300.0, 2.0, 10.0, 100.0),
    "maxwell_slip": tuple(value for spring in SPRINGS for value in spring) + (0.0,) * 8,
}
LAWS = pytest.mark.parametrize("law", sorted(VALUES))


def law_of(name: str) -> Effect:
    return EFFECTS[f"presliding/{name}"]


def one_step(
    name: str, values: Sequence[float], z: Array, v: float, h: float, level: float = LEVEL, offset: int = 0
) -> tuple[float, Array]:
    """Mean force over the step and the states after it; the states may stand anywhere in a longer array."""
    effect = law_of(name)
    assert effect.slip is not None
    before = np.concatenate([np.full(offset, 7.0), z])
    after = np.full(before.shape[0], 9.0)
    constants: tuple[object, ...] = ()
    if effect.prepare is not None:
        held = np.full(offset + effect.constants(values), 8.0)
        effect.prepare(held, offset, *values)
        constants = (held, offset)
    kept = before.copy()
    force = effect.slip(before, after, offset, v, h, level, *constants, *values)
    np.testing.assert_array_equal(before, kept)  # it reads these only
    np.testing.assert_array_equal(after[:offset], 9.0)
    return float(force), after[offset:]


def integrated(rate: Callable[[float], float], z_0: float, h: float, stop: float | None = None) -> tuple[float, float]:
    """State after ``h`` and its mean over it, for dz/dt = rate(z); from ``stop`` on nothing changes."""

    def reached(t: float, y: Array) -> float:
        return float(y[0] - (np.inf if stop is None else stop))

    reached.terminal = True  # type: ignore[attr-defined]
    scale = max(abs(z_0), SCALE)
    answer = solve_ivp(
        lambda t, y: [rate(y[0]), (y[0] - z_0) / h], (0.0, h), [z_0, 0.0], method="LSODA", rtol=1e-12,
        atol=1e-15 * scale, events=reached, first_step=1e-7 * h,
    )  # fmt: skip
    assert answer.success
    z_1, mean = answer.y[:, -1]
    if stop is not None and answer.t[-1] < h:
        z_1 = stop
        mean += (1.0 - answer.t[-1] / h) * (stop - z_0)
    return float(z_1), float(z_0 + mean)


# --- Dahl ---


@pytest.mark.parametrize("reach", [1e-6, 1e-3, 0.03, 0.4, 2.0, 7.0, 100.0])
@pytest.mark.parametrize("exponent", [0.0, 0.5, 1.0, 1.5, 2.0, 3.3])
def test_dahl(exponent: float, reach: float) -> None:
    for start, v in product((0.0, 0.6, -0.9, 1.3), (1e-3, -2e-2)):
        z_0, h = start * SCALE, reach * SCALE / abs(v)
        s = np.sign(v)

        def rate(z: float, v: float = v, s: float = float(s)) -> float:
            y = 1.0 - STIFFNESS * z * s / LEVEL
            return float(v * abs(y) ** exponent * np.sign(y))

        z_1, mean = integrated(rate, z_0, h, stop=s * SCALE if exponent < 1.0 else None)
        force, z = one_step("dahl", (STIFFNESS, exponent), np.array([z_0]), v, h, offset=2)
        assert z[0] - z_0 == pytest.approx(z_1 - z_0, rel=3e-8, abs=1e-10 * SCALE), (start, v)
        assert force == pytest.approx(STIFFNESS * mean, rel=1e-8, abs=1e-9 * LEVEL), (start, v)


@pytest.mark.parametrize("exponent", [0.999999, 1.0 + 1e-15, 1.0 + 1e-9])
@pytest.mark.parametrize("reach", [1e-5, 0.01, 0.7, 30.0])
def test_dahl_near_one_is_the_exponential(exponent: float, reach: float) -> None:
    v = 1e-3
    near = one_step("dahl", (STIFFNESS, exponent), np.array([-0.3 * SCALE]), v, reach * SCALE / v)
    one = one_step("dahl", (STIFFNESS, 1.0), np.array([-0.3 * SCALE]), v, reach * SCALE / v)
    assert near[0] == pytest.approx(one[0], rel=1e-5)
    assert near[1][0] == pytest.approx(one[1][0], rel=1e-5)
    closed = SCALE * (1.0 - 1.3 * np.exp(-reach))
    assert one[1][0] == pytest.approx(closed, rel=1e-12)
    assert one[0] == pytest.approx(LEVEL * (1.0 - 1.3 * -np.expm1(-reach) / reach), rel=1e-9)


def test_brittle_dahl_reaches_the_level_after_the_way_of_the_closed_form() -> None:
    for exponent in (0.0, 0.3, 0.8):
        way = SCALE / (1.0 - exponent)  # y^(1-n) = 1 - (1-n) sigma q / g
        for share, there in ((0.99, False), (1.0 + 1e-12, True)):
            _, z = one_step("dahl", (STIFFNESS, exponent), np.zeros(1), 1.0, share * way)
            assert bool(z[0] == SCALE) is there


# --- elasto-plastic ---


def alpha(z: float, v: float, breakaway: float) -> float:
    """Dupont et al. 2002, their piecewise definition, with z_ba and z_max = z_ss in displacement."""
    z_max, z_ba = SCALE, breakaway * SCALE
    if z * v <= 0.0 or abs(z) <= z_ba:
        return 0.0
    if abs(z) >= z_max:
        return 1.0
    return 0.5 * float(np.sin(np.pi * (abs(z) - 0.5 * (z_max + z_ba)) / (z_max - z_ba))) + 0.5


@pytest.mark.parametrize("reach", [1e-6, 1e-3, 0.03, 0.4, 2.0, 7.0, 100.0])
@pytest.mark.parametrize("breakaway", [0.02, 0.5, 0.95])
def test_elasto_plastic(breakaway: float, reach: float) -> None:
    for start, v in product((0.0, 0.6, -0.97, 0.999, 1.3, -1.2), (1e-3, -2e-2)):
        z_0, h = start * SCALE, reach * SCALE / abs(v)

        def rate(z: float, v: float = v) -> float:
            return v * (1.0 - alpha(z, v, breakaway) * abs(z) / SCALE)

        z_1, mean = integrated(rate, z_0, h)
        force, z = one_step("elasto_plastic", (STIFFNESS, 40.0, breakaway), np.array([z_0]), v, h, offset=1)
        assert z[0] - z_0 == pytest.approx(z_1 - z_0, rel=1e-7, abs=1e-8 * SCALE), (start, v)
        damping = 40.0 * (z[0] - z_0) / h
        assert force - damping == pytest.approx(STIFFNESS * mean, rel=1e-8, abs=1e-7 * LEVEL), (start, v)


def test_elasto_plastic_is_a_spring_below_break_away_to_the_last_bit() -> None:
    rng = np.random.default_rng(1)
    z = 0.0
    for target in 0.7 * SCALE * (1 - 1e-12) * rng.uniform(-1.0, 1.0, 2000):
        h = 10.0 ** rng.uniform(-6, 1)
        v = (target - z) / h
        force, after = one_step("elasto_plastic", (STIFFNESS, 40.0, 0.7), np.array([z]), v, h)
        assert after[0] == z + v * h
        assert force == STIFFNESS * (z + 0.5 * (v * h)) + 40.0 * v
        z = after[0]


# --- GMS ---


def gms_limits(n: float, m: int) -> Array:
    """Shares alpha_i of the slip level."""
    xi = (n + 1) * (1 - (1 - (np.arange(1, m + 1) - 0.5) / m) ** (1 / n))
    shares: Array = xi / xi.sum()
    return shares


def gms_element(d_0: float, slides: bool, limit: float, v: float, attraction: float, h: float) -> tuple[float, float, bool]:
    """One element: deflection after ``h``, its mean, whether it slides; by integration from event to event."""
    t, d, area = 0.0, d_0, 0.0
    s = 1.0 if v > 0 else -1.0
    sliding = (slides and d * s > 0.0) or abs(d) > limit
    for _ in range(6):
        against = d * s < 0.0  # an element beyond its limit, being unloaded

        def rate(d: float, sliding: bool = sliding, against: bool = against) -> float:
            if not sliding:
                return v
            side = -s if against else s
            return side * min(v * side, attraction / LEVEL * (limit - d * side))

        def event(t: float, y: Array, sliding: bool = sliding, against: bool = against) -> float:
            if sliding:
                return float(abs(y[0]) - limit) if against else 1.0
            return float(y[0] * s - limit)

        event.terminal = True  # type: ignore[attr-defined]
        event.direction = -1.0 if sliding else 1.0  # type: ignore[attr-defined]
        answer = solve_ivp(
            lambda t, y, rate=rate: [rate(y[0]), (y[0] - d_0) / h], (t, h), [d, area], method="LSODA", rtol=1e-12,
            atol=1e-15 * SCALE, events=event, first_step=1e-9 * h if t < (1 - 1e-6) * h else None,
        )  # fmt: skip
        assert answer.success
        d, area = answer.y[:, -1]
        t = answer.t[-1]
        if t >= h:
            break
        sliding = not sliding
        if sliding:
            d = s * limit
    return d, d_0 + area, sliding


@pytest.mark.parametrize("reach", [1e-6, 1e-3, 0.03, 0.4, 2.0, 7.0, 100.0])
@pytest.mark.parametrize("attraction", [1.0, 300.0, 1e5])
def test_gms(attraction: float, reach: float) -> None:
    m, n, damping = 4, 1.7, 30.0
    limits = gms_limits(n, m) * LEVEL / (STIFFNESS / m)
    cases = (
        (np.zeros(m), np.zeros(m)),
        (limits * [1.0, 0.7, 0.2, -0.6], np.array([1.0, 1.0, 0.0, 0.0])),
        (limits * [1.2, 1.5, -1.3, -1.0], np.array([1.0, 0.0, 0.0, 1.0])),
        (limits * [0.9, 0.99, 0.01, -1.1], np.array([1.0, 1.0, 1.0, 1.0])),
    )
    for (d_0, slides), v in product(cases, (2e-3, -2e-3)):
        h = reach * SCALE / abs(v)
        wanted = [gms_element(*row, v, attraction, h) for row in zip(d_0, slides > 0.5, limits, strict=True)]
        values = (STIFFNESS, attraction, n, float(m), 0.0)
        force, z = one_step("gms", values, np.r_[d_0, slides], v, h, offset=3)
        np.testing.assert_allclose(
            z[:m] - d_0, [row[0] - e for row, e in zip(wanted, d_0, strict=True)], rtol=2e-8, atol=1e-10 * SCALE
        )
        assert force == pytest.approx(STIFFNESS / m * sum(row[1] for row in wanted), abs=1e-8 * LEVEL)
        within = np.abs(z[:m]) <= limits  # beyond it an element slides whatever is written down about it
        np.testing.assert_array_equal(z[m:][within], np.array([row[2] for row in wanted])[within])
        # Damping belongs to the elements that stick, so it lies between none and all of them.
        damped, _ = one_step("gms", (*values[:-1], damping), np.r_[d_0, slides], v, h)
        assert -1e-12 <= (damped - force) / (damping * v) <= 1.0 + 1e-9


def test_gms_loads_along_the_virgin_curve() -> None:
    # f'(xi) = (1 - xi/xi_p)^n: f = (xi_p/(n+1)) (1 - (1 - xi/xi_p)^(n+1)), and xi_p = n + 1 makes f(xi_p) = 1.
    for n in (0.5, 1.0, 2.0, 5.0):
        values = (STIFFNESS, 1e3, n, 32.0, 0.0)
        for xi in np.linspace(0.05, 1.2, 12) * (n + 1):
            q = xi * SCALE
            _, z = one_step("gms", values, np.zeros(64), 1.0, q)
            force = STIFFNESS / 32 * np.sum(z[:32])
            assert force / LEVEL == pytest.approx(1 - max(1 - xi / (n + 1), 0.0) ** (n + 1), abs=8e-3)
        _, z = one_step("gms", values, np.zeros(64), 1.0, 1e-3 * SCALE)
        assert STIFFNESS / 32 * np.sum(z[:32]) == pytest.approx(1e-3 * LEVEL, rel=1e-12 if n < 3 else 0.05)


def test_gms_sliding_follows_the_level_with_the_rate_of_its_attraction() -> None:
    values = (STIFFNESS, 300.0, 2.0, 10.0, 100.0)
    _, z = one_step("gms", values, np.zeros(20), 0.1, 1.0, 6.0)
    assert STIFFNESS / 10 * np.sum(z[:10]) == pytest.approx(6.0, rel=1e-12)
    for level in (4.0, 7.0):
        now = z
        for h in (0.01, 0.02, 0.005):
            _, now = one_step("gms", values, now, 0.1, h, level)
        expected = level + (6.0 - level) * np.exp(-300.0 / level * 0.035)
        assert STIFFNESS / 10 * np.sum(now[:10]) == pytest.approx(expected, rel=1e-12)


# --- Maxwell slip ---


@pytest.mark.parametrize("reach", [1e-6, 1e-3, 0.4, 2.0, 100.0])
def test_maxwell_slip_is_equation_11(reach: float) -> None:
    rng = np.random.default_rng(2)
    stiffness, limit = np.array(SPRINGS).T
    delta = np.zeros(6)
    z = np.zeros(10)
    h = 1e-3
    for dx in reach * 5e-5 * rng.standard_normal(300):
        trial = dx + delta
        after = np.sign(trial) * np.minimum(np.abs(trial), limit)
        # Mean of the force, from a fine walk along the same way.
        walk = delta[:, None] + dx * (np.arange(4000) + 0.5) / 4000
        mean = float(stiffness @ np.clip(walk, -limit[:, None], limit[:, None]).mean(axis=1))
        force, z = one_step("maxwell_slip", VALUES["maxwell_slip"], z, dx / h, h, SPRINGS_LEVEL, offset=1)
        np.testing.assert_allclose(z[:6][stiffness > 0], after[stiffness > 0], rtol=1e-12, atol=1e-18)
        assert force == pytest.approx(mean, abs=2e-6 * SPRINGS_LEVEL)
        delta = after


def test_maxwell_slip_scales_its_limits_and_keeps_its_stiffness() -> None:
    values = VALUES["maxwell_slip"]
    total = sum(k for k, limit in SPRINGS if limit > 0)
    for level in (0.3, 5.0, 800.0):
        force, z = one_step("maxwell_slip", values, np.zeros(10), 1.0, 1.0, level)
        assert z[:2] == pytest.approx(level / SPRINGS_LEVEL * np.array([2e-5, 5e-5]))
        assert force == pytest.approx(level, rel=1e-3 * level)
        small = 1e-6 * level / SPRINGS_LEVEL * 2e-5
        force, _ = one_step("maxwell_slip", values, np.zeros(10), 1.0, small, level)
        assert force == pytest.approx(total * 0.5 * small, rel=1e-12)


# --- all of them ---


@LAWS
@pytest.mark.parametrize("level", [1e-6, 0.2, 5.0, 1e4])
def test_steady_sliding_gives_the_level_and_reversal_its_opposite(law: str, level: float) -> None:
    z = law_of(law).start(VALUES[law])
    for v in (0.3, -0.002, 11.0):
        for h in (1e2, 1e4):
            force, z = one_step(law, VALUES[law], z, v, h * max(level, 1.0) / abs(v), level)
        assert force == pytest.approx(np.copysign(level, v), rel=1e-9)


@LAWS
def test_two_half_steps_are_one_step(law: str) -> None:
    rng = np.random.default_rng(5)
    values = VALUES[law]
    z = law_of(law).start(values)
    for _ in range(400):
        v = float(rng.standard_normal()) * 10.0 ** rng.uniform(-5, -1)
        h = 10.0 ** rng.uniform(-4, -1)
        level = LEVEL * float(rng.uniform(0.3, 1.5))
        share = float(rng.uniform(0.01, 0.99))
        whole, after = one_step(law, values, z, v, h, level)
        first, middle = one_step(law, values, z, v, share * h, level)
        second, end = one_step(law, values, middle, v, (1 - share) * h, level)
        n = 10 if law == "gms" else after.shape[0]
        np.testing.assert_allclose(end[:n], after[:n], rtol=1e-9, atol=1e-8 * SCALE)
        assert share * first + (1 - share) * second == pytest.approx(whole, rel=1e-9, abs=1e-8 * LEVEL)
        z = after


@LAWS
def test_it_is_odd(law: str) -> None:
    rng = np.random.default_rng(6)
    values = VALUES[law]
    z = law_of(law).start(values)
    n = 10 if law == "gms" else z.shape[0]
    sign = np.r_[-np.ones(n), np.ones(z.shape[0] - n)]
    for v in (*(0.01 * rng.standard_normal(100)), 0.0, 1.0, 0.0, -1.0, 0.0):
        force, after = one_step(law, values, z, v, 1e-2, 4.0)
        mirrored, after_mirrored = one_step(law, values, sign * z, -v, 1e-2, 4.0)
        assert mirrored == -force
        np.testing.assert_array_equal(after_mirrored, sign * after)
        z = after


@LAWS
def test_force_and_states_are_continuous_in_velocity(law: str) -> None:
    # What the solver of a step relies on: it interpolates between two trials.
    rng = np.random.default_rng(7)
    values = VALUES[law]
    z = law_of(law).start(values)
    n = 10 if law == "gms" else z.shape[0]
    for v in 0.01 * rng.standard_normal(20):
        _, z = one_step(law, values, z, v, 5e-3, 4.0)
        grid = np.sort(np.r_[np.linspace(-0.02, 0.02, 4001), -1e-12, 1e-12])
        force, states = zip(*(one_step(law, values, z, w, 5e-3, 3.0) for w in grid), strict=True)
        # Neighbours on the grid are 5e-8 apart in displacement; bent beyond their level, bristles move by up to 7/3 of that.
        assert np.max(np.abs(np.diff(np.array(states)[:, :n], axis=0))) <= 2.4 * 5e-8
        assert np.max(np.abs(np.diff(force))) <= 2.5 * (STIFFNESS * 5e-8 + 100.0 * 1e-5)


@LAWS
def test_no_friction_without_level(law: str) -> None:
    z = law_of(law).start(VALUES[law])
    z[:] = 1e-6
    for level in (0.0, -1.0):
        for v in (0.0, 0.2, -0.2):
            force, after = one_step(law, VALUES[law], z, v, 1e-3, level)
            assert force == 0.0
            assert np.all(after == 0.0)


@LAWS
def test_every_law_takes_energy_whatever_the_level_does(law: str) -> None:
    # Work of the mean force minus the change of what the springs hold, K d^2/2 each, is never negative.
    rng = np.random.default_rng(8)
    # Bristles with damping dissipate while sigma_1 < 4 g/|v| (the discriminant of their balance of energy in z): kept below.
    values = {"lugre": (STIFFNESS, 10.0), "elasto_plastic": (STIFFNESS, 10.0, 0.7)}.get(law, VALUES[law])
    springs = np.full(1, STIFFNESS)
    if law == "gms":
        springs = np.r_[np.full(10, STIFFNESS / 10), np.zeros(10)]
    elif law == "maxwell_slip":
        springs = np.r_[[k if limit > 0 else 0.0 for k, limit in SPRINGS], np.zeros(4)]
    z = law_of(law).start(values)
    done = 0.0
    for k in range(5000):
        v = float(rng.standard_normal()) * 10.0 ** rng.uniform(-6, -1)
        if k % 50 == 0:
            v = 0.0
        h = 10.0 ** rng.uniform(-5, -2)
        level = float(rng.uniform(0.5, 6.0))
        v = float(np.clip(v, -0.19, 0.19))
        force, after = one_step(law, values, z, v, h, level)
        held = 0.5 * float(springs @ (after**2 - z**2))
        work = force * v * h
        done += abs(work)
        assert work - held >= -1e-9 * (abs(work) + abs(held)) - 1e-15 * LEVEL * SCALE, (k, v, h, level)
        z = after
    assert done > 0.0
