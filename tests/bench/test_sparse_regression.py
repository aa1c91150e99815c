"""Sparse regression as a peer of the diagnosis: how sparse it gets, what it reports, and whether it tells what is there."""

from __future__ import annotations

import numpy as np
import pytest
from fric.bench.sparse_regression import _STRENGTHS, Found, by_lasso, by_sindy, chosen
from fric.model import build_model, term
from fric.record import Array, Record
from fric.simulation import simulate


def dropped(columns: Array, target: Array) -> Array:
    """Least squares of which the small coefficients are dropped, for each strength."""
    whole = np.linalg.lstsq(columns, target, rcond=None)[0]
    return np.array([np.where(np.abs(whole) > strength, whole, 0.0) for strength in _STRENGTHS])


def test_it_keeps_what_is_there_and_nothing_of_noise() -> None:
    generator = np.random.default_rng(1)
    columns, noise = generator.standard_normal((3000, 20)), generator.standard_normal(3000)
    there = 0.8 * columns[:, 3] - 0.5 * columns[:, 11] + 0.3 * noise
    coefficients = chosen(dropped, columns, there / np.std(there))
    assert np.flatnonzero(coefficients).tolist() == [3, 11]
    assert coefficients[3] / coefficients[11] == pytest.approx(-0.8 / 0.5, rel=0.1)
    assert not np.any(chosen(dropped, columns, noise))


@pytest.mark.parametrize(("left", "first"), [(0.05, "ripple"), (0.6, "unknown")])
def test_what_it_leaves_is_reported_as_unknown(left: float, first: str) -> None:
    report = Found({"ripple": 1.0 - left}, left, {"ripple": "load"}).report()
    assert report["mismatch"]
    assert report["findings"][0]["effect"] == first
    assert not Found({}, 1.0, {}).report()["mismatch"]


@pytest.mark.parametrize(("way", "needs"), [(by_sindy, "pysindy"), (by_lasso, "sklearn")])
def test_an_axis_with_a_ripple(way: object, needs: str) -> None:
    pytest.importorskip(needs, reason=f"{needs} is in the extra 'peers'")
    h = 2e-3
    t = h * np.arange(5000)
    effort = 30.0 * np.sin(2.0 * t) + 15.0 * np.sin(7.3 * t)
    plain = [term("coulomb", force=5.0), term("viscous", coefficient=20.0)]
    nominal = build_model("rigid", {"mass": 2.0}, plain)
    true = build_model("rigid", {"mass": 2.0}, [*plain, term("ripple", cosine=3.0, sine=1.0, period=0.2)])
    position = simulate(true, effort, h, n_substeps=4).position[: t.size]
    assert next(iter(way([Record(t, position, effort)], [], nominal).shares)) == "ripple"  # type: ignore[operator]
