"""Mass from runs with different feedback: de Marchi's formulas on exact numbers, then recordings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric.identification import METHODS
from fric.identification.methods.parametric_oscillation import parametric_mechanics
from fric.identification.result import IdentificationError, Options
from fric.identification.start import start_model
from fric.model import build_model, term
from fric.record import Units
from fric.verification.free_oscillation_reference import INERTIA, PENDULUMS, STIFFNESS, Pendulum, gain, recorded, swing

M, C, K = 2.0, 3.0, 50.0
SMALL = np.diag([1e-4, 1e-5]) ** 2


def run(proportional: float, derivative: float) -> tuple[float, float]:
    w = np.sqrt((K + proportional) / M)
    return float(w), float((C + derivative) / (2.0 * M * w))


def test_two_proportional_gains_are_the_printed_formulas() -> None:
    (wi, zi), (wj, zj) = run(100.0, 0.0), run(250.0, 0.0)
    found = parametric_mechanics([(wi, zi), (wj, zj)], [(100.0, 0.0), (250.0, 0.0)], [SMALL, SMALL])
    assert found.mass == pytest.approx((100.0 - 250.0) / (wi**2 - wj**2), rel=1e-9)
    assert found.stiffness == pytest.approx((100.0 * wj**2 - 250.0 * wi**2) / (wi**2 - wj**2), rel=1e-8)
    assert (found.mass, found.viscous, found.stiffness) == pytest.approx((M, C, K), rel=1e-8)
    assert found.viscous == pytest.approx(found.mass * (wi * zi + wj * zj), rel=1e-8)


def test_two_derivative_gains_do_too() -> None:
    (wi, zi), (wj, zj) = run(0.0, 1.0), run(0.0, 6.0)
    found = parametric_mechanics([(wi, zi), (wj, zj)], [(0.0, 1.0), (0.0, 6.0)], [SMALL, SMALL])
    assert found.mass == pytest.approx((1.0 - 6.0) / (2.0 * (wi * zi - wj * zj)), rel=1e-8)
    assert (found.mass, found.viscous, found.stiffness) == pytest.approx((M, C, K), rel=1e-8)


def test_without_a_spring_one_run_is_enough() -> None:
    w = np.sqrt(80.0 / M)
    found = parametric_mechanics([(w, C / (2.0 * M * w))], [(80.0, 0.0)], [SMALL], spring=False)
    assert (found.mass, found.viscous, found.stiffness) == pytest.approx((M, C, 0.0), rel=1e-8)


def test_its_standard_errors_cover() -> None:
    rng = np.random.default_rng(0)
    gains = [(0.0, 0.0), (50.0, 0.0), (100.0, 2.0), (200.0, 0.0), (200.0, 5.0)]
    spread = np.array([2e-3, 4e-4])
    inside = []
    for _ in range(200):
        runs = [tuple(np.array(run(*each)) + spread * rng.standard_normal(2)) for each in gains]
        found = parametric_mechanics(runs, gains, [np.diag(spread**2)] * 5)  # type: ignore[arg-type]
        off = np.array([found.mass - M, found.viscous - C, found.stiffness - K])
        inside.append(np.abs(off) <= 1.645 * np.sqrt(np.diag(found.covariance)[:3]))
    # What runs differ by more than expected widens the intervals, never what they differ by less.
    assert np.all((np.mean(inside, axis=0) > 0.85) & (np.mean(inside, axis=0) < 0.98))


def test_a_damping_that_varies_does_not_spoil_the_mass() -> None:
    gains = [(0.0, 0.0), (50.0, 0.0), (100.0, 0.0), (200.0, 0.0)]
    runs = [(w, z * factor) for (w, z), factor in zip([run(*g) for g in gains], (0.5, 1.4, 0.9, 1.2), strict=True)]
    found = parametric_mechanics(runs, gains, [SMALL] * 4)
    assert found.mass == pytest.approx(M, rel=1e-4)
    assert np.sqrt(found.covariance[0, 0]) < 1e-3 * M
    assert np.sqrt(found.covariance[1, 1]) > 0.05 * C
    assert found.misfit[1] > 100.0


@pytest.mark.parametrize(
    ("runs", "gains", "says"),
    [
        ([run(10.0, 0.0)] * 2, [(10.0, 0.0)] * 2, "same feedback gains"),
        ([run(0.0, 0.0)] * 2, [(10.0, 0.0), (20.0, 0.0)], "doesn't change with the gain"),
        ([run(10.0, 0.0), run(200.0, 0.0)], [(200.0, 0.0), (10.0, 0.0)], "negative mass"),
    ],
)
def test_gains_that_show_nothing(runs: list[tuple[float, float]], gains: list[tuple[float, float]], says: str) -> None:
    with pytest.raises(IdentificationError) as caught:
        parametric_mechanics(runs, gains, [SMALL, SMALL])
    assert says in str(caught.value)


def _structure(*terms: str) -> object:
    return start_model(terms or ("stiffness", "viscous", "coulomb", "asymmetry"), "axis", Units("rad", "N m"))


def test_the_inertia_of_the_four_pendulums() -> None:
    off, scaled = [], []
    motions = [swing(pendulum, 1.5) for pendulum in PENDULUMS.values()]
    options = Options(gains=tuple((gain(pendulum), 0.0) for pendulum in PENDULUMS.values()))
    for seed in range(5):
        records = [recorded(motion, seed) for motion in motions]
        result = METHODS["parametric-oscillation"].fit(_structure(), records, options)  # type: ignore[arg-type]
        off.append(result.model.value("mass") / INERTIA - 1.0)
        scaled.append((result.model.value("mass") - INERTIA) / result.model.standard_errors["mass"])
        assert result.model.value("stiffness.stiffness") == pytest.approx(STIFFNESS, rel=0.02)
    # The thesis: 8.4 %.
    assert np.max(np.abs(off)) < 0.01
    assert np.sqrt(np.mean(np.square(scaled))) < 2.5
    # Friction of the table isn't the same in the four, and the result says so.
    assert any("differ from run to run" in warning for warning in result.warnings)


def test_gains_are_found_from_the_recorded_force() -> None:
    """One axis, one friction, three gains; the force as measured, the gains nowhere stated."""
    records = []
    for number, proportional in enumerate((60.0, 120.0, 240.0)):
        total = K + proportional
        w = np.sqrt(total / M)
        pendulum = Pendulum(float(w), float(C / (2.0 * M * w)) / 10.0, 0.0, 1.5 / total, 0.3 / total)
        motion = swing(pendulum, 1.0)
        record = recorded(motion, number, noise=1e-4, step=0.0)
        force = -proportional * record.position + 0.01 * np.random.default_rng(number).standard_normal(record.n_samples)
        records.append(replace(record, effort=force, source=f"gain {proportional:g}"))
    result = METHODS["parametric-oscillation"].fit(_structure(), records, Options())  # type: ignore[arg-type]
    assert result.model.value("mass") == pytest.approx(M, rel=0.003)
    assert result.model.value("stiffness.stiffness") == pytest.approx(K, rel=0.01)
    assert result.model.value("viscous.coefficient") == pytest.approx(C / 10.0, rel=0.02)
    assert result.model.value("coulomb.force") == pytest.approx(1.5, rel=0.01)
    assert result.model.value("asymmetry.force") == pytest.approx(0.3, rel=0.05)
    assert any("from the recorded force" in note for note in result.notes)


@pytest.mark.parametrize("hold", ["preceding", "following"])
def test_a_held_force_is_half_a_sample_off_its_stamp(hold: str) -> None:
    """A stiffness P that is taken half a sample late would look like a damping of P h/2, half of the axis' own here."""
    records = []
    for number, proportional in enumerate((60.0, 240.0)):
        total = K + proportional
        w = np.sqrt(total / M)
        record = recorded(
            swing(Pendulum(float(w), float(C / (2.0 * M * w)) / 10.0, 0.0, 1.5 / total, 0.0), 1.0), number, step=0.0
        )
        h, x = record.sample_time, record.position
        between = 0.5 * (x[1:] + x[:-1])
        held = -proportional * (np.append(between, x[-1]) if hold == "following" else np.insert(between, 0, x[0]))
        assert h * 240.0 > 0.5 * C / 10.0
        records.append(replace(record, effort=held, effort_hold=hold, source=f"gain {proportional:g}"))
    result = METHODS["parametric-oscillation"].fit(_structure(), records, Options())  # type: ignore[arg-type]
    assert result.model.value("mass") == pytest.approx(M, rel=0.005)
    assert result.model.value("viscous.coefficient") == pytest.approx(C / 10.0, rel=0.05)


def test_the_own_feedback_of_a_plant_counts_as_one() -> None:
    """The pendulum plant has its gains inside: what is left of the stiffness is the spring's."""
    p = PENDULUMS["#1"]
    total = INERTIA * p.frequency**2
    model = build_model(
        "pendulum",
        {"inertia": INERTIA, "proportional": 0.7 * total, "derivative": 0.0, "gravity": 0.0, "start": 0.0},
        [term("stiffness", stiffness=1.0), term("viscous", coefficient=0.1), term("coulomb", force=0.1), term("asymmetry")],
        units=Units("rad", "N m"),
    )
    result = METHODS["log-decrement"].fit(model, [recorded(swing(p, 1.5), 0)], Options())
    assert result.model.value("stiffness.stiffness") == pytest.approx(0.3 * total, rel=1e-3)
    assert result.model.value("inertia") == INERTIA
