"""Prediction error on an axis simulated elsewhere."""

from __future__ import annotations

from typing import Any

import pytest
from fric.bench.dirty_axis import drawn, recorded
from fric.identification import METHODS
from fric.identification.result import IdentificationError, Options
from fric.model import Model, Term, build_model, term
from fric.signals.conditioning import conditioned

FIT = METHODS["prediction-error"].fit


def structure(*more: Term) -> Model:
    terms = [term("coulomb", force=1.0), term("viscous", coefficient=1.0), term("bias", force=0.0), *more]
    return build_model("rigid", {"mass": 1.0}, terms)


def test_sticking_and_sliding_come_back_without_the_bias_of_filters(slider: Any) -> None:
    found = FIT(structure(term("asymmetry")), [slider.record(noise=0.1, resolution=1e-7)], Options())
    for name, value in {"mass": 2.0, "coulomb.force": 8.0, "viscous.coefficient": 15.0, "bias.force": 0.8}.items():
        assert found.model.value(name) == pytest.approx(value, rel=0.02), name
        assert abs(found.model.value(name) - value) < 5.0 * found.model.standard_errors[name] + 2e-3 * value, name


def test_the_bristles_come_back(bristled: Any) -> None:
    model = structure(term("asymmetry"), term("presliding", stiffness=1e4, damping=0.0))
    # The force as it was applied: the method takes what is recorded to be what acts, to which others may add.
    found = FIT(model, [bristled.record(resolution=1e-8)], Options())
    for name, value, rel in (
        ("mass", 2.0, 0.005),
        ("coulomb.force", 8.0, 0.005),
        ("viscous.coefficient", 15.0, 0.01),
        ("presliding.stiffness", 2e5, 0.01),
        ("presliding.damping", 400.0, 0.02),
    ):
        assert found.model.value(name) == pytest.approx(value, rel=rel), name


def test_noise_of_the_force_signal_makes_the_axis_neither_heavier_nor_its_bristles_damped(bristled: Any) -> None:
    # The plain sum of squared innovations ends far off here, with errors that exclude the truth.
    model = structure(term("asymmetry"), term("presliding", stiffness=1e4, damping=0.0))
    found = FIT(model, [bristled.record(noise=0.1, resolution=1e-8)], Options())
    for name, value, rel in (
        ("mass", 2.0, 0.01),
        ("coulomb.force", 8.0, 0.002),
        ("viscous.coefficient", 15.0, 0.02),
        ("presliding.stiffness", 2e5, 0.01),
        ("presliding.damping", 400.0, 0.1),
    ):
        assert found.model.value(name) == pytest.approx(value, rel=rel), name
        assert abs(found.model.value(name) - value) < 3.0 * found.model.standard_errors[name], name


def test_what_acts_without_being_in_the_noise_of_the_record_is_not_corrected_away(bristled: Any) -> None:
    # The same force without noise: its fast part did act, and nothing of it may be taken for noise.
    model = structure(term("asymmetry"), term("presliding", stiffness=1e4, damping=0.0))
    found = FIT(model, [bristled.record(resolution=1e-8)], Options())
    assert found.model.value("presliding.damping") == pytest.approx(400.0, rel=0.02)
    assert found.model.value("mass") == pytest.approx(2.0, rel=0.002)


@pytest.mark.long
def test_a_mass_that_comes_out_at_nothing_is_refused() -> None:
    # 1710 encoder steps at 4.4 kHz, spikes of 50 times the force, pink noise and mains: innovations that hold no motion.
    axis, dirt = drawn(40083)
    with pytest.raises(IdentificationError, match="'mass' comes out at nothing; use the method output-error"):
        FIT(structure(), [conditioned(recorded(axis, dirt, 40083))], Options())
