"""Values for which a residual is least, against normal equations and bounds that are known."""

from __future__ import annotations

import numpy as np
import pytest
from fric.diagnosis.least_squares import fitted_values
from fric.model import Model
from fric.record import Array

from .small_axis import NOMINAL

NAMES = ("mass", "coulomb.force", "viscous.coefficient")
COLUMNS = np.random.default_rng(5).standard_normal((60, 3))


def towards(values: tuple[float, float, float]) -> Array:
    return np.asarray(COLUMNS @ np.array(values))


def fit(target: Array, names: tuple[str, ...] = NAMES, bounds: dict[str, tuple[float, float]] | None = None) -> Model:
    scale = np.array([{"mass": 1.0, "coulomb.force": 10.0, "viscous.coefficient": 100.0}[name] for name in names])
    return fitted_values(
        lambda m: COLUMNS @ np.array([m.value(n) for n in NAMES]) - target, NOMINAL, names, scale, bounds or {}
    )[0]


def test_the_least_squares_of_a_linear_residual_are_those_of_the_normal_equations() -> None:
    target = towards((3.0, 7.0, 30.0)) + np.random.default_rng(6).standard_normal(60)
    known = np.linalg.solve(COLUMNS.T @ COLUMNS, COLUMNS.T @ target)
    found = fit(target)
    assert [found.value(name) for name in NAMES] == pytest.approx(known.tolist(), rel=1e-5)


def test_what_is_not_named_stays() -> None:
    found = fit(towards((3.0, 7.0, 30.0)), ("coulomb.force",))
    assert found.value("mass") == NOMINAL.value("mass")
    assert found.value("viscous.coefficient") == NOMINAL.value("viscous.coefficient")


def test_declared_and_given_bounds_hold() -> None:
    """Friction is not negative, a mass is above zero; what is given for a fit may be narrower, and isn't wider."""
    below = fit(towards((-3.0, -7.0, 30.0)))
    assert below.value("coulomb.force") == 0.0
    assert below.value("mass") > 0.0
    assert fit(towards((3.0, 7.0, 30.0)), bounds={"coulomb.force": (0.0, 5.0)}).value("coulomb.force") == pytest.approx(5.0)
    assert fit(towards((3.0, -7.0, 30.0)), bounds={"coulomb.force": (-50.0, 50.0)}).value("coulomb.force") == 0.0
