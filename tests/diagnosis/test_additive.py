"""The missing force by components: its evidence against the normal density itself, and known physics in known components."""

from __future__ import annotations

import numpy as np
import pytest
from fric.diagnosis.additive.evidence import Grouped
from fric.diagnosis.additive.residual import lines_of
from fric.diagnosis.additive.together import grown_together, middle_of
from fric.diagnosis.additive.told import by_component
from fric.diagnosis.fitting import refit
from fric.diagnosis.start import started
from fric.model import build_model, term
from fric.record import Record
from scipy.optimize import approx_fprime, minimize
from scipy.stats import multivariate_normal


@pytest.fixture(scope="module")
def grouped() -> Grouped:
    random = np.random.default_rng(3)
    x = {name: random.standard_normal((60, k)) for name, k in (("one", 3), ("two", 5))}
    y = x["one"] @ np.array([1.0, -2.0, 0.5]) + 0.3 * random.standard_normal(60)
    return Grouped(y, random.standard_normal((60, 2)), x)


def test_the_evidence_is_the_normal_density_of_what_the_base_leaves(grouped: Grouped) -> None:
    z = np.array([-0.3, -1.2, -1.0])
    gram, load = grouped._gram, grouped._load
    value, gradient, _ = grouped._negative(z, gram, load, grouped._selected(("one", "two"))[1])
    owner = np.repeat([0, 1], [3, 5])
    covariance = (grouped.x * np.exp(2.0 * z[owner])) @ grouped.x.T + np.exp(2.0 * z[2]) * np.eye(60)
    # In the 58 directions that the base leaves open.
    left = np.linalg.svd(grouped._basis, full_matrices=True)[0][:, 2:]
    density = multivariate_normal(np.zeros(58), left.T @ covariance @ left).logpdf(left.T @ grouped.y)
    assert -value == pytest.approx(density, abs=1e-6)
    numeric = approx_fprime(z, lambda at: grouped._negative(at, gram, load, owner)[0], 1e-6)
    np.testing.assert_allclose(gradient, numeric, rtol=1e-4, atol=1e-4)


def test_a_group_that_is_there_has_evidence_and_one_that_is_not_has_none(grouped: Grouped) -> None:
    whole = grouped.weighed(("one", "two"))
    assert whole.log_evidence - grouped.weighed(("two",)).log_evidence > 20.0
    assert whole.log_evidence - grouped.weighed(("one",)).log_evidence < 3.0
    assert whole.noise == pytest.approx(0.3, rel=0.25)
    np.testing.assert_allclose(
        grouped.residual(whole) + grouped.part("one", whole) + grouped.part("two", whole), grouped.size * grouped.y
    )


TRUE = {"mass": 2.0, "coulomb.force": 6.0, "viscous.coefficient": 15.0}
NOMINAL = build_model(
    "rigid", {"mass": 2.0}, [term("coulomb", force=6.0), term("viscous", coefficient=15.0), term("bias", force=0.0)]
)


def _recording(missing: dict[str, float], seed: int = 5) -> Record:
    """A controlled axis with the values of TRUE, by the integrator of this file, and with forces besides."""
    random = np.random.default_rng(seed)
    h, fine, n = 1e-3, 5, 16000
    t = h * np.arange(n)
    phases = random.uniform(0.0, 6.0, 3)
    wanted = (np.array([0.06, 0.03, 0.012]) * np.sin(2.0 * np.pi * np.outer(t, [0.23, 0.71, 1.9]) + phases)).sum(axis=1)
    speed = np.gradient(wanted, t)
    x, v = wanted[0], 0.0
    q, u = np.empty(n), np.empty(n)
    for k in range(n):
        u[k], q[k] = 3000.0 * (wanted[k] - x) + 150.0 * (speed[k] - v), x
        for _ in range(fine):
            level = 6.0 * (1.0 + missing.get("drift", 0.0) * t[k])
            smooth = missing.get("ripple", 0.0) * np.sin(2.0 * np.pi * x / 0.011)
            free = v + h / fine / 2.0 * (u[k] - 15.0 * v - smooth - missing.get("direction", 0.0) * abs(v))
            v = np.sign(free) * max(abs(free) - h / fine * level / 2.0, 0.0)
            x += h / fine * v
    return Record(t, q + 2e-7 * random.standard_normal(n), u + 0.02 * random.standard_normal(n), effort_hold="following")


def _grown(missing: dict[str, float]) -> dict[str, float]:
    tracks, start = started(NOMINAL, [_recording(missing)])
    track = middle_of(tracks)
    model = grown_together(track, refit(track, start), lambda _: None).fit.model
    if len(model.terms) == len(NOMINAL.terms):
        return {}
    return dict(zip(model.names, model.values.tolist(), strict=True))


@pytest.mark.long
def test_three_effects_at_once_are_found_with_their_values() -> None:
    found = _grown({"ripple": 0.5, "direction": 6.0, "drift": 0.02})
    assert {name.split(".")[0] for name in found} == {"mass", "coulomb", "viscous", "bias", "ripple", "asymmetry", "time_drift"}
    for name, value in TRUE.items():
        assert found[name] == pytest.approx(value, rel=0.02), name
    assert found["ripple.period"] == pytest.approx(0.011, rel=1e-3)
    assert np.hypot(found["ripple.cosine"], found["ripple.sine"]) == pytest.approx(0.5, rel=0.02)
    assert found["asymmetry.coefficient"] == pytest.approx(6.0, rel=0.02)
    assert found["time_drift.rate"] == pytest.approx(0.02, rel=0.02)


def test_where_nothing_is_missing_nothing_comes() -> None:
    assert _grown({}) == {}


@pytest.mark.long
def test_what_is_missing_shows_in_its_component() -> None:
    tracks, start = started(NOMINAL, [_recording({"drift": 0.02})])
    found = by_component(tracks, start)
    first = found[0]
    assert (first.component, first.laws[0].effect) == ("friction-time", "time_drift")
    assert first.is_there
    assert first.laws[0].explained > 0.8
    assert "N rms goes with friction over time; slow drift of friction" in first.sentence("N")
    assert all(0.0 <= each.presence <= 1.0 and 0.0 <= each.share <= 1.0 for each in found)


def test_the_evidence_is_as_large_as_another_optimiser_finds_it() -> None:
    random = np.random.default_rng(11)
    for size in (0.05, 0.6):
        groups = {name: np.cumsum(random.standard_normal((600, k)), axis=0) for name, k in (("a", 5), ("b", 9), ("c", 20))}
        y = size * groups["b"] @ random.standard_normal(9) + random.standard_normal(600)
        grouped = Grouped(y, np.ones((600, 1)), groups)
        found = grouped.weighed(grouped.names)
        index, owner = grouped._selected(grouped.names)
        gram, load = grouped._gram[np.ix_(index, index)], grouped._load[index]

        def cost(z: np.ndarray, gram: np.ndarray, load: np.ndarray, owner: np.ndarray, grouped: Grouped) -> float:
            return float(grouped._negative(np.clip(z, -8.0, 2.0), gram, load, owner)[0])

        others = [
            minimize(
                cost, begin, (gram, load, owner, grouped), method="Nelder-Mead", options={"maxiter": 4000, "xatol": 1e-5}
            ).fun
            for begin in ([-1.0, -1.0, -1.0, -1.0], [-3.0, 0.0, -3.0, -2.0])
        ]
        assert found.log_evidence > -min(others) - 0.2


def test_gradient_and_expected_curvature_of_the_evidence() -> None:
    random = np.random.default_rng(12)
    groups = {name: random.standard_normal((80, k)) for name, k in (("a", 3), ("b", 6))}
    z = np.log([0.7, 0.4, 0.5])
    curvatures, step = [], 1e-4
    for _ in range(400):
        y = 0.7 * groups["a"] @ random.standard_normal(3) + 0.4 * groups["b"] @ random.standard_normal(6)
        grouped = Grouped(y + 0.5 * random.standard_normal(80), np.zeros((80, 0)), groups)
        index, owner = grouped._selected(grouped.names)
        given = grouped._gram[np.ix_(index, index)], grouped._load[index], owner
        # In units of the data's own size, and with columns of size one.
        at = z + np.log([grouped._sizes["a"], grouped._sizes["b"], 1.0]) - np.log(grouped.size)
        value, gradient, expected = grouped._negative(at, *given)
        ends = [[grouped._negative(at + s * step * np.eye(3)[k], *given) for s in (-1.0, 1.0)] for k in range(3)]
        slopes = [(after[0] - before[0]) / (2.0 * step) for before, after in ends]
        assert gradient == pytest.approx(slopes, rel=1e-4, abs=1e-4 * abs(value))
        curvatures.append(np.array([(after[1] - before[1]) / (2.0 * step) for before, after in ends]) - expected)
    apart, spread = np.mean(curvatures, axis=0), np.std(curvatures, axis=0) / np.sqrt(len(curvatures))
    assert np.all(np.abs(apart) < 4.0 * spread + 0.05)


def test_a_line_between_two_whole_numbers_of_cycles_is_found() -> None:
    place, cycles = np.linspace(0.0, 1.0, 4000, endpoint=False), np.arange(4.0, 121.0)
    for true in (98.4, 31.5, 7.2):
        target = 0.9 * np.sin(2.0 * np.pi * true * place + 0.4) + 0.4 * np.cos(2.0 * np.pi * 55.0 * place)
        angle = 2.0 * np.pi * place[:, None] * cycles
        fitted = np.linalg.lstsq(np.concatenate([np.cos(angle), np.sin(angle)], axis=1), target, rcond=None)[0]
        first, second, *_ = lines_of(cycles, *np.split(fitted, 2))
        assert first == pytest.approx(true, abs=0.15)
        assert second == pytest.approx(55.0, abs=0.15)
