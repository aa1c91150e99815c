"""The asperity population: exact steps against many small ones, the balance of energy, closed forms, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest
from fric.friction import asperity_growth as laws
from fric.friction import asperity_loops as loops
from fric.friction.asperity import GROWTH_LAWS, AsperityError, AsperityParameters, AsperityPopulation
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq

LAWS = pytest.mark.parametrize("law", GROWTH_LAWS)
SHAPES = {"stretched": {"beta": 0.6}, "exponential_power": {"beta": 0.8, "gamma": 0.5}, "power": {"beta": 0.5}}


def parameters(law: str = "exponential", **values: float) -> AsperityParameters:
    return AsperityParameters(law=law, **{"growth": 3.0, **SHAPES.get(law, {}), **values})  # type: ignore[arg-type]


def strength(law: str, t: float) -> float:
    """The laws once more, as the paper has them, with F_0 = 1, F_inf = 3 and the shapes above."""
    return {
        "exponential": lambda: 1 + 2 * (1 - np.exp(-t)),
        "stretched": lambda: 3 - 2 * np.exp(-(t**0.6)),
        "exponential_power": lambda: 3 * (1 - np.exp(-(t**0.8))) ** 0.5,
        "hyperbolic": lambda: 1 + 2 * t / (t + 1),
        "power": lambda: 1 + 2 * t**0.5,
        "root": lambda: 3 / ((3 / 1 - 1) / np.sqrt(t + 1) + 1),
        "logarithmic": lambda: 1 + 2 * np.log(t + 1),
    }[law]()


@LAWS
def test_a_contact_strengthens_by_its_law(law: str) -> None:
    p = parameters(law, time=0.2)
    ages = np.geomspace(1e-4, 20.0, 30)
    assert [p.strength(float(age)) for age in ages] == pytest.approx([strength(law, age / 0.2) for age in ages], rel=1e-12)


@LAWS
def test_rate_and_integral_of_the_growth(law: str) -> None:
    number = GROWTH_LAWS.index(law)
    shape = (3.0, SHAPES.get(law, {}).get("beta", 1.0), SHAPES.get(law, {}).get("gamma", 1.0))
    for begin in (0.0, 1e-3, 0.3, 5.0):
        clock = np.exp(-begin) if law == "exponential" else begin
        if begin > 0.0:
            slope = (strength(law, begin * (1 + 1e-6)) - strength(law, begin * (1 - 1e-6))) / (2e-6 * begin)
            assert laws.growth_rate(number, clock, *shape) == pytest.approx(slope, rel=1e-6)
        for r in (1e-6, 0.1, 3.0):
            expected = quad(lambda t: strength(law, t), begin, begin + r, epsabs=0.0, epsrel=1e-10)[0]
            assert laws.impulse(number, clock, r, *shape) == pytest.approx(expected, rel=1e-7)


def test_random_numbers_are_uniform_and_belong_to_their_counters() -> None:
    many = np.array([[loops.uniform(seed, a, 3) for a in range(4000)] for seed in (1, 2)])
    assert np.all((many > 0.0) & (many < 1.0))
    assert np.mean(many, axis=1) == pytest.approx([0.5, 0.5], abs=0.02)
    counts = np.histogram(many[0], bins=20, range=(0, 1))[0]
    assert np.sum((counts - 200.0) ** 2 / 200.0) < 43.8  # chi squared, 19 degrees of freedom, 1 in 1000
    assert abs(np.corrcoef(many)[0, 1]) < 0.05
    assert abs(np.corrcoef(many[0, 1:], many[0, :-1])[0, 1]) < 0.05
    assert loops.uniform(1, 5, 3) == many[0, 5]
    assert loops.uniform(1, 5, 4) != many[0, 5]


def test_at_the_start_the_topography_is_found_as_it_is_later() -> None:
    """Share in contact and mean length of the waves met do not drift."""
    population = AsperityPopulation(parameters(stiffness=1e4, gap=0.6), 20_000)
    first = np.mean(population.states[60_000:] % 2)
    run = population.run(0.05 * np.arange(200), 1.0)
    assert first == pytest.approx(1 / 1.6, abs=0.01)
    assert np.mean(run.touching[:10]) == pytest.approx(first, abs=0.01)
    assert np.mean(run.touching[-100:]) == pytest.approx(first, abs=0.01)
    assert np.mean(population.heights) == pytest.approx(1.0, rel=1e-12)


def by_small_steps(p: AsperityParameters, n: int, positions: np.ndarray, h: float, cuts: int) -> np.ndarray:
    """Force over each interval: the rules of the contact scenario, applied again and again over small steps of time."""
    start = AsperityPopulation(p, n, seed=3)
    q, d, _, event = (start.states[k * n : (k + 1) * n].copy() for k in range(4))
    touches = event % 2 == 1
    age = np.zeros(n)
    number = np.where(touches, event, event - 1).astype(int)

    def wave(numbers: np.ndarray) -> np.ndarray:
        u = np.array([loops.uniform(3, a, k) for a, k in enumerate(numbers)])
        return p.wavelength * 2 * np.where(numbers == 1, np.sqrt(u), u)

    length = wave(number)
    each = p.stiffness * (1 + p.gap) / n
    reach = p.force / p.stiffness * start.heights
    forces = []
    for dx in np.diff(positions):
        work = 0.0
        for _ in range(cuts):
            small = dx / cuts
            before = np.where(touches, d, 0.0)
            age += h / cuts
            d = np.where(touches, d + small, 0.0)
            q = np.where(touches, q, q + small)
            limit = reach * np.array([strength(p.law, t / p.time) for t in age])
            excess = np.where(touches, np.sign(d) * np.maximum(np.abs(d) - limit, 0.0), 0.0)
            d -= excess
            q += excess
            work += each * np.sum(0.5 * (before + d)) * small
            lost = touches & ((q > length) | (q < 0.0))
            q = np.where(lost, np.where(q > length, q + d - length, p.gap * length + (q + d)), q)
            met = ~touches & ((q > p.gap * length) | (q < 0.0))
            d[lost] = 0.0
            touches = (touches & ~lost) | met
            if np.any(met):
                number = np.where(met, number + 2, number)
                right = q > p.gap * length
                length = wave(number)
                q = np.where(met, np.where(right, 0.0, length), q)
                age = np.where(met, 0.0, age)
                d = np.where(met, 0.0, d)
        forces.append(work / dx)
    return np.array(forces)


@pytest.mark.parametrize("law", ["exponential", "hyperbolic", "power"])
def test_a_motion_with_reversals_follows_the_rules_of_the_contact_scenario(law: str) -> None:
    p = parameters(law, stiffness=25.0, time=2.0, gap=0.7)
    position = np.concatenate([[0.0, 0.5, 1.7, 1.2, -0.4, -0.2, -0.5, 0.3], 0.3 + 2.3 * np.arange(1, 3)])
    exact = AsperityPopulation(p, 60, seed=3).run(position, 0.8).force
    rough = by_small_steps(p, 60, position, 0.8, 2000)
    assert exact == pytest.approx(rough, abs=2e-3 * float(np.ptp(exact)))


@LAWS
@settings(max_examples=12, deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(1e-3, 5.0), st.integers(0, 50))
def test_a_step_is_the_sum_of_its_parts(law: str, way: float, h: float, seed: int) -> None:
    """With constant speed one long step ends where many short ones do, after the same work, whatever happens within."""
    p = parameters(law, stiffness=15.0, mass=0.1, gap=0.3)
    whole, parts = (AsperityPopulation(p, 50, seed) for _ in range(2))
    before = np.array([0.0, 0.4, 0.1])
    for population in (whole, parts):
        population.run(before, 0.3)
    force = whole.run(np.array([0.0, way]), h).force[0]
    forces = parts.run(np.linspace(0.0, way, 138), h / 137).force
    assert np.mean(forces) == pytest.approx(force, rel=1e-6, abs=1e-6)
    same = whole.states[150:] == parts.states[150:]
    assert np.mean(same) >= 0.98  # an event at the very end of the step may fall on either side
    assert whole.extension[same] == pytest.approx(parts.extension[same], abs=1e-8)
    assert whole.states[:50][same] == pytest.approx(parts.states[:50][same], abs=1e-8)


@LAWS
@settings(max_examples=15, deadline=None)
@given(st.lists(st.floats(-2.0, 2.0), min_size=2, max_size=30), st.floats(1e-3, 10.0), st.integers(0, 50))
def test_it_never_delivers_energy(law: str, positions: list[float], h: float, seed: int) -> None:
    population = AsperityPopulation(parameters(law, stiffness=15.0, mass=0.05), 40, seed)
    lost = 0.0
    last = 0.0
    for way in np.diff(positions):
        before = population.elastic_energy
        force = population.run(np.array([last, last + way]), h).force[0]
        lost += force * way - (population.elastic_energy - before)
        assert lost >= -1e-9
        last += way


def test_work_is_what_springs_hold_and_what_slipping_and_letting_go_take() -> None:
    """One asperity over one contact, with the times of its events found by other means."""
    p = parameters(stiffness=20.0, time=0.5, mass=0.3, gap=1.5)
    population = AsperityPopulation(p, 1, seed=4)
    speed = 0.9
    y, each = population.heights[0], p.stiffness * (1 + p.gap)
    number = 7
    population.states[:] = [0.0, 0.0, 1.0, number]  # where a wave begins
    w = 2.0 * loops.uniform(4, 0, number)

    def limit(t: float) -> float:
        return y / p.stiffness * strength("exponential", t / p.time)

    slips = brentq(lambda t: speed * t - limit(t), 0.0, 10.0, xtol=1e-14)
    loses = brentq(lambda t: speed * t - limit(t) - w, 0.0, 100.0, xtol=1e-14)
    work = 0.5 * each * (speed * slips) ** 2
    work += each * speed * quad(limit, slips, loses, epsrel=1e-12)[0]
    work += 0.5 * p.mass * (1 + p.gap) * speed**2
    way = speed * loses + 0.1 * w
    found = population.run(np.array([0.0, way]), way / speed)
    assert found.force[0] * way == pytest.approx(work, rel=1e-9)
    assert found.touching[0] == 0.0
    assert population.states[3] == number + 1
    assert population.states[0] == pytest.approx(way - w, rel=1e-9)


def test_the_other_direction_is_the_mirror_image() -> None:
    """Of the means, since random waves are met in another order."""
    there, back = (AsperityPopulation(parameters(), 20_000) for _ in range(2))
    forward = there.run(0.05 * np.arange(200), 0.1)
    backward = back.run(-0.05 * np.arange(200), 0.1)
    assert np.mean(backward.force[40:]) == pytest.approx(-np.mean(forward.force[40:]), rel=5e-3)
    assert np.mean(backward.load[40:]) == pytest.approx(np.mean(forward.load[40:]), rel=5e-3)
    # Before anything is lost it is exact.
    there, back = (AsperityPopulation(parameters(), 500) for _ in range(2))
    small = 1e-5 * np.arange(20)
    assert back.run(-small, 0.1).force == pytest.approx(-there.run(small, 0.1).force, rel=1e-12)


def test_small_displacements_meet_springs() -> None:
    population = AsperityPopulation(parameters(stiffness=200.0), 20_000)
    share = np.mean(population.states[60_000:] % 2)
    found = population.run(np.array([0.0, 1e-7]), 1.0)
    assert found.force[0] == pytest.approx(200.0 * 2.0 * share * 0.5e-7, rel=1e-3)


def test_at_rest_the_force_stays_and_contacts_grow_old() -> None:
    population = AsperityPopulation(parameters(), 1000)
    population.run(np.linspace(0.0, 0.5, 50), 0.1)
    before = population.states.copy()
    rest = population.run(np.zeros(5), 1.0)
    touching = before[3000:] % 2 == 1
    assert np.ptp(rest.force) == 0.0
    assert np.array_equal(population.states[1000:2000], before[1000:2000])
    assert population.states[2000:3000][touching] == pytest.approx(before[2000:3000][touching] * np.exp(-4.0))


def test_the_load_is_held_by_the_separation() -> None:
    population = AsperityPopulation(parameters(stiffness=20.0), 5000)
    half = population.run(0.05 * np.arange(100), 0.05, load=0.5)
    assert np.all(half.load == 0.5)
    carrying = population.states[15_000:] % 2 == 1
    overlap = np.maximum(population.heights - half.separation[-1], 0.0)
    base = population.states[:5000] + population.extension
    number = population.states[15_000:].astype(int)
    length = np.array([2.0 * loops.uniform(1, a, k) for a, k in enumerate(number)])
    carrying &= (base >= 0.0) & (base <= length) & (number > 1)
    assert 2.0 / 5000 * np.sum(overlap[carrying]) == pytest.approx(0.5, rel=1e-6)
    # Uniform heights: the sum of overlaps falls with the square of what is left.
    assert half.separation[-1] == pytest.approx(2.0 - 2.0 * np.sqrt(0.5), abs=0.05)
    # Friction per load hardly depends on the load, Amontons' law: more so, the stiffer.
    full = AsperityPopulation(parameters(stiffness=2000.0), 5000).run(0.05 * np.arange(100), 0.05, load=1.0)
    less = AsperityPopulation(parameters(stiffness=2000.0), 5000).run(0.05 * np.arange(100), 0.05, load=0.3)
    assert np.mean(less.force[50:]) / 0.3 == pytest.approx(np.mean(full.force[50:]), rel=0.02)


def test_a_run_may_be_cut_anywhere() -> None:
    position = np.cumsum(np.random.default_rng(0).normal(0.0, 0.3, 40))
    whole = AsperityPopulation(parameters(), 1300).run(position, 0.1)
    cut = AsperityPopulation(parameters(), 1300)
    first, second = cut.run(position[:17], 0.1), cut.run(position[16:], 0.1)
    assert np.array_equal(whole.force, np.concatenate([first.force, second.force]))
    other = AsperityPopulation(parameters(), 1300, seed=2).run(position, 0.1)
    assert not np.any(other.force == whole.force)


@pytest.mark.parametrize(
    "values",
    [
        {"force": 0.0}, {"stiffness": -1.0}, {"wavelength": np.inf}, {"time": np.nan}, {"gap": -0.1}, {"reach": np.nan},
        {"mass": -1.0}, {"beta": 1.2}, {"gamma": 0.0}, {"growth": 0.9}, {"law": "linear"}, {"load": 0.0},
    ],
)  # fmt: skip
def test_it_refuses_parameters_without_meaning(values: dict[str, float]) -> None:
    with pytest.raises(AsperityError):
        AsperityParameters(**values)  # type: ignore[arg-type]


def test_it_refuses_motions_without_meaning() -> None:
    with pytest.raises(AsperityError):
        AsperityPopulation(parameters(), 0)
    population = AsperityPopulation(parameters(), 10)
    for position, h, load in (
        ([0.0], 1.0, None),
        ([0.0, np.nan], 1.0, None),
        ([[0.0, 1.0]], 1.0, None),
        ([0.0, 1.0], 0.0, None),
        ([0.0, 1.0], 1.0, -1.0),
    ):
        with pytest.raises(AsperityError):
            population.run(np.array(position), h, load)
