"""Intervals of the methods that have no residual to be judged by alone, over a few simulated experiments each.

The full counts over 200 are ``fric bench calibration-oscillation`` and its sisters; with a few only a gross fault shows.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from fric.bench.benchmarks.calibration_forced import trial as forced
from fric.bench.benchmarks.calibration_oscillation import CASES, free, parametric
from fric.bench.benchmarks.calibration_static import TRIALS
from fric.bench.benchmarks.calibration_two_stage import LIMITS, SPRINGS, recorded, structure, trial, truth
from fric.bench.trials import Finding, count, figures_of
from fric.identification import METHODS
from fric.identification.result import IdentificationError, Options
from fric.identification.static_maps.weighted import as_normal, weighted
from scipy import stats


def pooled(found: object, n: int) -> tuple[float, float]:
    """Share of all intervals that hold the truth, and root mean square of errors over standard errors."""
    calibration, refused = count(found, range(300, 300 + n), 1)  # type: ignore[arg-type]
    assert refused == 0
    score = calibration.estimates / calibration.errors
    return float(np.mean(calibration.coverage(0.9))), float(np.sqrt(np.nanmean(score**2)))


@pytest.mark.parametrize("method", CASES)
def test_of_one_free_oscillation(method: str) -> None:
    share, size = pooled(partial(free, method), 12)
    assert share >= 0.75
    assert 0.6 < size < 1.5


def test_of_oscillations_under_several_gains() -> None:
    share, size = pooled(parametric, 8)
    assert share >= 0.75
    assert 0.6 < size < 1.5


@pytest.mark.parametrize("name", TRIALS)
def test_of_static_maps(name: str) -> None:
    share, size = pooled(TRIALS[name], 8 if "three loads" in name else 12)
    assert share >= 0.72
    assert 0.4 < size < 1.6


@pytest.mark.long
def test_of_forced_oscillations_that_stop_at_their_turns() -> None:
    calibration, refused = count(forced, range(300, 312), 1)
    assert refused <= 2  # those that rest for too long
    score = calibration.estimates / calibration.errors
    assert float(np.mean(calibration.coverage(0.9))) >= 0.75
    assert 0.6 < float(np.sqrt(np.mean(score**2))) < 1.5


@pytest.mark.long
def test_of_the_two_stage_method_in_fast_turns() -> None:
    share, size = pooled(partial(trial, 0.04), 8)
    assert share >= 0.75
    assert 0.6 < size < 1.5


def test_fast_turns_leave_no_viscous_force_behind() -> None:
    """Springs read at the samples alone, or filtered in another way than the force, cost five per cent of it and more."""
    noiseless = recorded(7, 0.04, force_noise=0.0)
    found = METHODS["two-stage"].fit(structure(), [noiseless], Options(decimation=25)).model
    for name, value in truth().items():
        assert found.value(name) == pytest.approx(value, rel=3e-3), name


def test_springs_that_make_up_for_the_filter_are_not_in_the_mechanism() -> None:
    found = METHODS["two-stage"].fit(structure(0), [recorded(5001, 0.04)], Options(decimation=25))
    limits = np.array([found.model.value(f"presliding.limit_{k}") for k in range(1, 11)])
    np.testing.assert_allclose(limits[limits > 0.0], LIMITS, rtol=0.02)
    assert found.model.value("coulomb.force") == pytest.approx(float(SPRINGS @ LIMITS), rel=2e-3)
    assert any("compensate for the filter" in note for note in found.notes)


def test_slow_strokes_say_that_they_hide_the_mass() -> None:
    found = METHODS["two-stage"].fit(structure(), [recorded(5000, 0.5)], Options(decimation=25))
    assert any(warning.startswith("mass") for warning in found.warnings)
    error = found.model.standard_errors.get("mass", np.inf)
    assert error > 0.15 * found.model.value("mass")
    assert found.model.value("coulomb.force") == pytest.approx(float(SPRINGS @ LIMITS), rel=5e-3)


def test_a_scatter_beside_the_errors_is_found_and_widens() -> None:
    random = np.random.default_rng(4)
    columns = np.stack([np.ones(40), np.linspace(0.0, 1.0, 40)], axis=1)
    alike = weighted(columns, columns @ [1.0, 2.0] + 0.1 * random.standard_normal(40), np.full(40, 0.1), 400)
    apart = weighted(columns, columns @ [1.0, 2.0] + 0.5 * random.standard_normal(40), np.full(40, 0.1), 400)
    assert alike.scatter < 0.06
    assert apart.scatter == pytest.approx(0.49, rel=0.3)
    assert apart.freedom == 38
    assert apart.misfit > 3.0
    np.testing.assert_allclose(apart.values, [1.0, 2.0], atol=4.0 * np.sqrt(apart.covariance[1, 1]))
    agreeing = weighted(columns, columns @ [1.0, 2.0], np.full(40, 0.1), 400)
    assert (agreeing.scatter, agreeing.freedom) == (0.0, 400)
    # Weighted least squares in closed form.
    inverse = np.linalg.inv(columns.T @ columns) * 0.01
    np.testing.assert_allclose(agreeing.covariance, inverse, rtol=1e-9)


def test_a_standard_error_for_few_degrees_of_freedom_gives_students_interval() -> None:
    assert as_normal(3) * stats.norm.ppf(0.95) == pytest.approx(stats.t.ppf(0.95, 3))
    assert as_normal(100_000) == pytest.approx(1.0, abs=1e-4)


def test_refused_recordings_count_neither_way() -> None:
    def seldom(seed: int) -> Finding:
        if seed % 2:
            raise IdentificationError("recording", "is of no use", "record another")
        return {"a": (0.5, 1.0), "b": (3.0, 1.0)}

    found, refused = count(seldom, range(10), 1)
    assert refused == 5
    assert found.coverage(0.9).tolist() == [1.0, 0.0]
    by_name = {figure.name: figure for figure in figures_of("method", found, refused)}
    assert by_name["method: b, 90 % intervals that hold the truth"].reached is False
    assert by_name["method: a, mean error over standard error"].value == 0.5
    with pytest.raises(IdentificationError, match="all 1"):
        count(seldom, [1], 1)
