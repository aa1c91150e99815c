"""Tensor-product friction from recordings whose friction is known: slips in closed form, and strokes of an axis by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric.bench.benchmarks.calibration_tensor_product import ratio
from fric.friction.tensor_product_file import tensor_product_from_text
from fric.identification import METHODS
from fric.identification.methods.tensor_product import TensorProductIdentification
from fric.identification.result import IdentificationError, Options
from fric.identification.start import start_model
from fric.model import Model
from fric.model_file import model_from_text, model_to_text
from fric.record import Record, Units
from fric.report.kind import page_of
from numpy.typing import NDArray

Array = NDArray[np.float64]

MASS, COULOMB, SURPLUS, HALF, VISCOUS = 0.4, 2.0, 1.0, 0.02, 6.0
STEP = 2e-4


def friction(v: Array, up: Array, hysteresis: bool) -> Array:
    surplus = SURPLUS / (1.0 + (v / HALF) ** 2)
    return np.asarray(np.sign(v) * (COULOMB + np.where(up, surplus, 0.0 if hysteresis else surplus)) + VISCOUS * v)


def stick_slip(seed: int, n_slips: int = 12, hysteresis: bool = True, both: bool = False) -> Record:
    """Slips v = V sin^2(pi t/T) from rest to rest, with noise on force and acceleration and steps of the sensors."""
    random = np.random.default_rng(seed)
    parts: list[Array] = []
    for k in range(n_slips):
        way = -1.0 if both and k % 2 else 1.0
        slip, top = random.uniform(0.07, 0.09), random.uniform(0.06, 0.08)
        t = np.arange(round(slip / STEP)) * STEP
        v, a = top * np.sin(np.pi * t / slip) ** 2, top * np.pi / slip * np.sin(2.0 * np.pi * t / slip)
        force = friction(v, a >= 0.0, hysteresis) + MASS * a
        rest = np.linspace(1.5, COULOMB + SURPLUS, 500)
        parts.append(
            way * np.array([np.concatenate([np.zeros(500), v]), np.concatenate([np.zeros(500), a]), np.r_[rest, force]])
        )
    v, a, force = np.concatenate(parts, axis=1)
    n = v.shape[0]
    a = np.round((a + 0.05 + 0.05 * random.standard_normal(n)) / 1e-3) * 1e-3
    force = np.round((force + 0.01 * random.standard_normal(n)) / 1e-3) * 1e-3
    time = STEP * np.arange(n, dtype=np.float64)
    return Record(time, STEP * np.cumsum(v), force, extra={"acceleration": a}, effort_hold="linear", source=f"slips {seed}")


def structure(mass: float = MASS) -> Model:
    return start_model(["coulomb"], "axis", Units()).with_value("mass", mass)


def mapped(*records: Record) -> TensorProductIdentification:
    found = METHODS["tensor-product"].fit(structure(), records, Options())
    assert isinstance(found, TensorProductIdentification)
    return found


@pytest.fixture(scope="module")
def found() -> TensorProductIdentification:
    return mapped(stick_slip(1))


def test_both_branches_are_found_and_the_law_through_them(found: TensorProductIdentification) -> None:
    assert found.chosen is not None
    assert found.chosen.candidate.hysteresis
    assert found.law is not None
    v = np.linspace(0.006, 0.06, 12)
    for up in (True, False):
        truth = friction(v, np.full(12, up), True)
        np.testing.assert_allclose(found.law.force(v, up), truth, rtol=0.02)
    truth_by_name = {
        "coulomb.force": COULOMB,
        "viscous.coefficient": VISCOUS,
        "accel_hysteresis.force": SURPLUS,
        "accel_hysteresis.velocity": HALF,
    }
    for name, value in truth_by_name.items():
        assert found.model.value(name) == pytest.approx(value, rel=0.05), name
        assert 0.0 < found.model.standard_errors[name] < 0.05 * value, name
    assert "mass" not in found.fitted
    assert any("one direction" in warning for warning in found.warnings)


def test_intervals_of_the_grid_points_hold_the_truth() -> None:
    inside = []
    for seed in range(20, 26):
        for branch in mapped(stick_slip(seed)).branches:
            truth = friction(branch.speed, np.full(branch.speed.shape[0], branch.speeding_up is True), True)
            known = np.isfinite(branch.error)
            inside.append(np.abs(branch.force - truth)[known] <= branch.half_width(0.9)[known])
    share = float(np.mean(np.concatenate(inside)))
    assert 0.75 <= share <= 0.98


def test_one_branch_where_there_is_no_hysteresis() -> None:
    found = mapped(stick_slip(2, hysteresis=False))
    assert found.chosen is not None
    assert not found.chosen.candidate.hysteresis
    assert "stribeck.force" in found.fitted
    assert found.model.value("stribeck.velocity") == pytest.approx(HALF, rel=0.1)


def test_both_directions_are_one_where_they_are_alike() -> None:
    found = mapped(stick_slip(3, n_slips=16, both=True))
    assert found.chosen is not None
    assert not found.chosen.candidate.directions
    assert not any("one direction" in warning for warning in found.warnings)


def test_it_is_written_and_runs_as_a_model(found: TensorProductIdentification) -> None:
    law, units = tensor_product_from_text(found.attachments["tensor_product.yaml"])
    assert units == found.model.units
    assert found.law is not None
    np.testing.assert_array_equal(law.force(np.array([0.01, 0.05])), found.law.force(np.array([0.01, 0.05])))
    rows = found.attachments["tensor_product.csv"].splitlines()
    assert len(rows) == 1 + sum(branch.speed.shape[0] for branch in found.branches)
    again = model_from_text(model_to_text(found.model))
    assert again.value("coulomb.force") == found.model.value("coulomb.force")
    remark = found.remarks_on([stick_slip(9)])[0]
    assert "the map 0.0" in remark
    page = page_of(found, [stick_slip(1)], [], Options())
    assert "Vertices and weights" in page
    assert "(chosen)" in page


def test_it_predicts_a_slip_much_better_than_a_curve_without_memory() -> None:
    # Szell's Table 1 has 10.7 for Model A over D; the slips are of another integrator and another friction than the map.
    by_map, _ = ratio(3)
    assert by_map >= 7.0


def test_positions_alone_will_do() -> None:
    """Strokes of an axis moved by hand: no acceleration measured, friction one curve with a bias."""
    random = np.random.default_rng(5)
    time = 1e-3 * np.arange(40_000, dtype=np.float64)
    angle = 2.0 * np.pi * np.cumsum(0.4 + 0.2 * np.sin(2.0 * np.pi * 0.05 * time)) * 1e-3
    position = 0.05 * np.sin(angle)
    velocity = np.gradient(position, time)
    force = MASS * np.gradient(velocity, time) + np.sign(velocity) * COULOMB + VISCOUS * velocity + 0.5
    record = Record(time, np.round(position / 1e-7) * 1e-7, force + 0.02 * random.standard_normal(40_000), effort_hold="linear")
    found = mapped(record)
    assert found.chosen is not None
    assert found.chosen.candidate.directions
    assert not found.chosen.candidate.hysteresis
    assert found.model.value("coulomb.force") == pytest.approx(COULOMB, rel=0.02)
    assert found.model.value("viscous.coefficient") == pytest.approx(VISCOUS, rel=0.03)
    assert found.model.value("bias.force") == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda r: replace(r, effort=np.ones(r.n_samples)), "the force doesn't change"),
        (
            lambda r: replace(r, extra={"acceleration": np.random.default_rng(1).standard_normal(r.n_samples)}),
            "no slip|samples",
        ),
    ],
)
def test_recordings_of_no_use_are_refused(spoil: object, message: str) -> None:
    with pytest.raises(IdentificationError, match=message):
        mapped(spoil(stick_slip(1, n_slips=3)))  # type: ignore[operator]


def test_terms_are_its_own() -> None:
    with pytest.raises(IdentificationError, match="--hold"):
        METHODS["tensor-product"].fit(structure(), [stick_slip(1, 3)], Options(held=("coulomb.force",)))
