"""How sure a diagnosis would be of an effect of some energy: against a regression that is done, and at its limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric.diagnosis.expected import Expected

BESIDE = Expected(left=100.0, floor=60.0, excess=40.0, independent=400.0, least=1.0)


def test_the_evidence_is_the_likelihood_ratio_of_a_regression() -> None:
    random = np.random.default_rng(4)
    n, size = 400, 0.4
    ratios = []
    for _ in range(200):
        column = random.standard_normal(n)
        noise = random.standard_normal(n)
        recorded = size * column + noise
        left = recorded - column * float(column @ recorded) / float(column @ column)
        ratios.append(0.5 * n * np.log(float(recorded @ recorded) / float(left @ left)))
    beside = replace(BESIDE, left=float(n), independent=float(n))
    assert beside.nats(size**2 * n) == pytest.approx(np.mean(ratios), rel=0.03)


def test_more_is_surer_and_what_stays_or_looks_alike_makes_it_less_sure() -> None:
    energies = (1.0, 10.0, 100.0, 1000.0)
    assert np.all(np.diff([BESIDE.sure("ripple", energy, 1.0) for energy in energies]) > 0.0)
    assert np.all(np.diff([BESIDE.sure("ripple", 50.0, apart) for apart in (0.0, 0.01, 0.1, 1.0)]) > 0.0)
    assert np.all(np.diff([replace(BESIDE, excess=rest).sure("ripple", 50.0, 1.0) for rest in (0.0, 10.0, 100.0)]) < 0.0)


def test_what_is_needed_makes_it_as_likely_as_not() -> None:
    needed = BESIDE.needed("accel_hysteresis", 0.5)
    assert needed is not None
    assert BESIDE.sure("accel_hysteresis", 0.99 * needed, 0.5) < 0.5 < BESIDE.sure("accel_hysteresis", 1.01 * needed, 0.5)
    alike = BESIDE.needed("accel_hysteresis", 0.01)
    assert alike is not None
    assert alike > needed


def test_no_less_is_needed_than_what_a_term_has_to_take_off() -> None:
    clean = replace(BESIDE, excess=0.0, left=1.0, floor=1.0, least=5.0)
    assert clean.needed("ripple", 1.0) == 5.0


def test_what_is_never_as_likely_as_not_has_no_size() -> None:
    # Of two values none tells anything, however much it takes off beside so much that stays.
    assert replace(BESIDE, independent=2.0, excess=1e12).needed("presliding", 0.0) is None
