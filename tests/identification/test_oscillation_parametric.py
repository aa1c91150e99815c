"""Mass from runs with different feedback: de Marchi's formulas on exact numbers, then recordings, then forced runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric_nodes.identification import METHODS
from fric_nodes.identification.parametric_oscillation import (
    Forced,
    forced_mechanics,
    forced_response,
    parametric_mechanics,
)
from fric_nodes.identification.result import IdentificationError, Options
from fric_nodes.identification.start import start_model
from fric_nodes.model import build_model, term
from fric_nodes.record import Record, Units
from fric_nodes.verification.free_oscillation_reference import INERTIA, PENDULUMS, STIFFNESS, Pendulum, gain, recorded, swing
from scipy.integrate import solve_ivp

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


# ---- forced oscillation ----------------------------------------------------------------------------------------------


def _forced(frequency: float, force: float, dry: float, hold: str = "linear") -> Record:
    """Steady response to a sine, dry friction smoothed over 1e-3 of the velocity, integrated by an implicit method."""
    step, periods = 2.0 * np.pi / frequency / 400.0, 40
    time = step * np.arange(400 * periods)

    def right_side(t: float, y: np.ndarray) -> list[float]:
        friction = dry * np.tanh(y[1] / (1e-3 * force / (M * frequency)))
        return [y[1], (force * np.sin(frequency * t) - C * y[1] - K * y[0] - friction) / M]

    answer = solve_ivp(right_side, (0.0, time[-1] + step), [0.0, 0.0], method="LSODA", rtol=1e-8, atol=1e-10, t_eval=time)
    late = {"linear": 0.0, "following": 0.5}[hold] * step
    effort = force * np.sin(frequency * (time + late))
    return Record(time, answer.y[0], effort, effort_hold=hold).slice(400 * 30, 400 * periods)


@pytest.mark.parametrize("hold", ["linear", "following"])
def test_the_dynamic_stiffness_of_a_linear_axis(hold: str) -> None:
    for frequency in (2.0, 5.0, 9.0):
        response = forced_response(_forced(frequency, 4.0, 0.0, hold), frequency)
        assert response.stiff == pytest.approx(K - M * frequency**2, abs=0.01)
        assert response.lossy == pytest.approx(C * frequency, abs=0.01)


def test_forced_runs_give_mass_damping_stiffness_and_friction() -> None:
    runs = [(3.0, 8.0), (4.0, 14.0), (6.5, 10.0), (8.0, 20.0)]
    found = forced_mechanics([forced_response(_forced(w, b, 1.0), w) for w, b in runs])
    assert found.mass == pytest.approx(M, rel=0.01)
    assert found.stiffness == pytest.approx(K, rel=0.01)
    # The describing function takes the motion for a sine.
    assert found.viscous == pytest.approx(C, rel=0.05)
    assert found.coulomb == pytest.approx(1.0, rel=0.1)
    # Without the dry term the damping holds the friction too, as the printed formula does.
    blind = forced_mechanics([forced_response(_forced(w, b, 1.0), w) for w, b in runs], coulomb=False)
    assert blind.viscous > 1.1 * C


def test_the_printed_formulas_of_the_forced_parametric_oscillation() -> None:
    """Two runs with P and D of their own: the closed forms with D_i w_i where the slide has D_i."""
    gains, frequencies = [(20.0, 1.0), (70.0, 4.0)], [3.0, 7.0]
    runs = [
        Forced(w, 1.0, K + p - M * w**2, (C + d) * w, 1e-6 * np.eye(2)) for w, (p, d) in zip(frequencies, gains, strict=True)
    ]
    found = forced_mechanics(runs, gains, coulomb=False)
    (wi, wj), (i, j) = frequencies, runs
    mass = ((20.0 - i.stiff) - (70.0 - j.stiff)) / (wi**2 - wj**2)
    viscous = ((i.lossy - 1.0 * wi) * wj + (j.lossy - 4.0 * wj) * wi) / (2.0 * wi * wj)
    assert (found.mass, found.viscous, found.stiffness) == pytest.approx((mass, viscous, K), rel=1e-9)
    assert mass == pytest.approx(M, rel=1e-12)


def test_forced_runs_that_are_alike() -> None:
    same = Forced(3.0, 1.0, 10.0, 5.0, np.eye(2))
    with pytest.raises(IdentificationError) as caught:
        forced_mechanics([same, same, same])
    assert "too much alike" in str(caught.value)
    with pytest.raises(IdentificationError):
        forced_response(Record(np.arange(10.0) * 0.1, np.ones(10), np.ones(10)), 1.0)
