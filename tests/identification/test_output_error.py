"""Output error: the free run of an axis simulated elsewhere."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
from fric.identification import METHODS
from fric.identification.result import Options
from fric.model import Model, Term, build_model, term

FIT = METHODS["output-error"].fit
TRUE = {"mass": 2.0, "coulomb.force": 8.0, "viscous.coefficient": 15.0, "bias.force": 0.8, "asymmetry.coefficient": 2.0}


def structure(*more: Term) -> Model:
    terms = [term("coulomb", force=1.0), term("viscous", coefficient=1.0), term("bias", force=0.0), term("asymmetry"), *more]
    return build_model("rigid", {"mass": 1.0}, terms)


@pytest.mark.parametrize("horizon", [None, 2.0])
def test_the_truth_comes_back_without_the_bias_of_filters(slider: Any, horizon: float | None) -> None:
    # The force as it was applied: its noise would add up in the free run, and is another error than this method's.
    found = FIT(structure(), [slider.record(resolution=1e-6)], Options(horizon=horizon))
    for name, value in TRUE.items():
        assert found.model.value(name) == pytest.approx(value, rel=0.03), name
    assert found.model.value("mass") == pytest.approx(2.0, rel=0.003)
    assert found.model.value("coulomb.force") == pytest.approx(8.0, rel=0.003)
    if horizon is None:
        assert found.train.position_rmse < 2e-4 * np.ptp(slider.position)


@pytest.mark.alone
def test_six_parameters_on_25000_samples_take_about_a_second_at_most(slider: Any) -> None:
    record = slider.record(noise=0.05, resolution=1e-6)
    model = structure(term("stribeck", force=0.5, velocity=0.05))
    FIT(model, [record], Options())  # compiles, or loads what was compiled
    start = time.process_time()
    found = FIT(model, [record], Options())
    # Of the processor, which other programs do not count in: one that evaluates too often takes several times as long.
    assert time.process_time() - start < 4.5  # on a machine that does other work beside it
    assert found.model.value("mass") == pytest.approx(2.0, rel=0.05)


def test_a_start_that_holds_parameters_keeps_them(slider: Any) -> None:
    found = FIT(structure().with_value("mass", 2.1), [slider.record(resolution=1e-6)], Options(held=("mass",), horizon=2.0))
    assert found.model.value("mass") == 2.1
    assert "mass" not in found.fitted
