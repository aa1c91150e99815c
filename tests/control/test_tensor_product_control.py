"""Tensor-product control: against the plants themselves, against numpy, and against what must not pass."""

from __future__ import annotations

import sys
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from fric.bench.benchmarks import tensor_product_control as trial
from fric.control.closed_loop import closed_loop
from fric.control.controller import Setpoint
from fric.control.controller_file import ControllerError, read_controller
from fric.control.tensor_product.certificate import certify, is_positive_definite
from fric.control.tensor_product.design import Requirements, TensorProductController, design
from fric.control.tensor_product.design_file import (
    controller_from_text,
    controller_to_text,
    read_tp_controller,
    write_tp_controller,
)
from fric.control.tensor_product.law import TensorProductLaw
from fric.control.tensor_product.polytope import Polytope, polytope
from fric.control.tensor_product.quasi_lpv import TensorProductControlError, mass_on_friction, pneumatic_cylinder
from fric.friction.tensor_product import from_law, from_model, velocity_grid
from fric.model import Model, build_model, term
from fric.model_file import read_model
from fric.record import Record, Units
from fric.shared_files import config_file
from numpy.typing import NDArray

Array = NDArray[np.float64]
MASS, COULOMB, SURPLUS, KNEE, VISCOUS = 2.0, 6.0, 3.0, 0.02, 20.0


def friction(v: float, share: float) -> float:
    """Typed here a second time: Szell's Eq. 23, the surplus by its share."""
    return COULOMB + share * SURPLUS / (1.0 + (v / KNEE) ** 2) + VISCOUS * abs(v)


def axis() -> Model:
    terms = [
        term("coulomb", force=COULOMB),
        term("accel_hysteresis", force=SURPLUS, velocity=KNEE),
        term("viscous", coefficient=VISCOUS),
    ]
    return build_model("rigid", {"mass": MASS}, terms)


@lru_cache(maxsize=1)
def held() -> Polytope:
    law = from_model(axis(), velocity_grid(0.5, 2000))
    return polytope(mass_on_friction(law, slowest=2e-3, fastest=0.5, error=0.01))


@lru_cache(maxsize=1)
def designed() -> TensorProductController:
    return design(held(), Requirements(decay=8.0, limit=60.0))


def test_the_polytope_is_convex_and_gives_the_plant_back() -> None:
    random = np.random.default_rng(1)
    speed = random.choice([-1.0, 1.0], 400) * 10.0 ** random.uniform(np.log10(2e-3), np.log10(0.5), 400)
    product = held().product
    weights = product.weights_at(np.column_stack([speed, random.uniform(*product.grids[1][[0, -1]], 400)]))
    for each in weights:
        assert np.min(each) >= -1e-9
        np.testing.assert_allclose(each.sum(axis=1), 1.0, atol=1e-9)
    assert held().convexity <= 1e-9
    assert held().reconstruction <= 1e-9
    # Every mixture of the two branches lies between what the two ends of the hysteresis give, to the grid's 1 %.
    ends = np.einsum("pi,ih->ph", weights[0], held().a[:, :, 2, 2])
    for v, (one, other) in zip(speed, ends, strict=True):
        for share in (0.0, 0.3, 1.0):
            a_22 = -friction(v, share) / (abs(v) * MASS)
            assert 1.01 * min(one, other) <= a_22 <= 0.99 * max(one, other)


def test_a_cylinder_gives_back_its_stiffness_and_gain() -> None:
    model = read_model(config_file("pneumatic_model.yaml"))
    law = from_model(model, velocity_grid(0.5, 1000))
    plant = pneumatic_cylinder(
        model, law, slowest=5e-3, fastest=0.5, error=0.02, force=60.0, positions=(0.02, 0.08), pressures=(3e5, 3e5)
    )
    made = polytope(plant)
    assert made.a.shape == (4, 2, 4, 4)
    x, area, dead = 0.0425, 3.14159e-4, 1e-6  # a point of the grid
    weights = made.product.weights_at(np.array([[0.1, 1.0, x]]))
    share = np.outer(weights[0][0], weights[2][0]).ravel()
    stiffness = 1.4 * area**2 * 3e5 * (1.0 / (dead + area * x) + 1.0 / (dead + area * (0.1 - x)))
    assert float(share @ made.a[:, 0, 3, 2]) == pytest.approx(-stiffness, rel=1e-6)
    # Supply to 3 bar and 3 bar to the exhaust are both choked, or nearly: psi = 0.484.
    flows = 1.6e-6 * np.sqrt(2.0 * 287.0 * 293.0) * 0.484 * (7e5 + 3e5)
    gain = 0.5 * 1.4 * area * flows * (1.0 / (dead + area * x) + 1.0 / (dead + area * (0.1 - x)))
    assert float(share @ made.b[:, 0, 3]) == pytest.approx(gain, rel=0.01)


def test_every_vertex_pair_decays_as_designed_by_numpy() -> None:
    made = designed()
    r, variants, n = made.b.shape
    assert float(np.max(made.eigenvalues().real)) < -made.decay
    assert np.all(np.linalg.eigvalsh(made.p) > 0.0)
    for h in range(variants):
        q = {}
        for i in range(r):
            for j in range(r):
                pa = made.p @ (made.a[i, h] + made.b[i, h][:, None] * made.gains[j])
                q[i, j] = pa + pa.T + 2.0 * made.decay * made.p
        for i in range(r):
            assert np.linalg.eigvalsh(q[i, i])[-1] < 0.0
            for j in range(r):
                if i != j:
                    assert np.linalg.eigvalsh(2.0 / (r - 1) * q[i, i] + q[i, j] + q[j, i])[-1] < 0.0
    # On the ellipsoid the command keeps its limit, and the states their domain.
    for k in made.gains:
        assert float(k @ np.linalg.solve(made.p, k)) <= 1.0
    assert np.all(made.semi_axes <= made.domain)
    assert np.ptp(made.physical_gains[:, 0]) <= 1e-9 * abs(made.physical_gains[0, 0])
    assert "proved" in made.summary()
    assert n == 3


def test_the_proof_refuses_a_p_that_is_only_nearly_right() -> None:
    made = designed()
    assert certify(made.a, made.b, made.gains, made.p).decay >= made.decay
    wrong = made.p.copy()
    wrong[0, 1] = wrong[1, 0] = 0.5 * wrong[0, 1]
    assert certify(made.a, made.b, made.gains, wrong).decay < made.decay
    assert not certify(made.a, made.b, made.gains, 0.5 * made.p).input_bound
    assert certify(made.a, made.b, -made.gains, made.p).decay < 0.0
    # Singular by construction: floating point has its smallest eigenvalue anywhere about zero, fractions have it at zero.
    v = np.array([[1.0 / 3.0, 0.1], [0.7, 1e-3], [1e5, 0.3]])
    exact = [[Fraction(float(x)) for x in row] for row in v]
    gram = [[sum((a * b for a, b in zip(one, two, strict=True)), Fraction(0)) for two in exact] for one in exact]
    assert not is_positive_definite(gram)
    for k in range(3):
        gram[k][k] += Fraction(1, 10**30)
    assert is_positive_definite(gram)


def test_a_refusal_names_the_pair_and_what_to_relax() -> None:
    with pytest.raises(TensorProductControlError) as caught:
        design(held(), Requirements(decay=60.0, limit=12.0))
    said = str(caught.value)
    assert "\n" not in said
    assert "60 1/s" in said
    assert "vertex" in said
    assert "a_22" in said
    assert "relax" in said
    assert "slowest velocity" in said
    for bad in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(TensorProductControlError, match="decay"):
            Requirements(decay=bad, limit=1.0)


def test_friction_that_drives_is_refused() -> None:
    law = from_law(lambda v: -2.0 * v, lambda v: -2.0 * v, 1.0, velocity_grid(0.5, 100))
    with pytest.raises(TensorProductControlError, match="drives the motion"):
        mass_on_friction(law, slowest=1e-2, fastest=0.4, error=0.01)


def test_without_cvxpy_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cvxpy", None)
    with pytest.raises(
        TensorProductControlError, match=r"cvxpy is not installed; install it with pip install 'fric\[control\]'"
    ):
        design(held(), Requirements(decay=8.0, limit=60.0))


def test_a_second_solver_agrees() -> None:
    second = design(held(), Requirements(decay=8.0, limit=60.0, solver="CVXOPT"))
    assert second.certificate.decay == pytest.approx(designed().certificate.decay, rel=0.05)
    with pytest.raises(TensorProductControlError, match="NONE gives up"):
        design(held(), Requirements(decay=8.0, limit=60.0, solver="NONE"))


def test_a_file_is_proved_again(tmp_path: Path) -> None:
    made = designed()
    path = tmp_path / "tp.yaml"
    write_tp_controller(made, path)
    back = read_tp_controller(path)
    for one, other in ((made.gains, back.gains), (made.p, back.p), (made.a, back.a), (made.b, back.b)):
        np.testing.assert_array_equal(one, other)
    assert back.certificate == made.certificate
    assert back.summary() == made.summary()
    text = controller_to_text(made)
    changed = replace(made, gains=0.5 * made.gains)
    with pytest.raises(TensorProductControlError, match=r"the proof of 8 1/s within the limit fails"):
        controller_from_text(controller_to_text(changed))
    for old, new, what in (
        ("limit: 60.0", "limit: -1.0", "line"),
        ("states: [integral, error, velocity]", "states: [integral, velocity, error]", "states"),
        ("name: velocity", "name: colour", "line"),
        ("fric-tp-controller/1", "fric-tp-controller/2", "line 1"),
    ):
        with pytest.raises(TensorProductControlError, match=what):
            controller_from_text(text.replace(old, new))
    tables = ((made.tables[0][0], made.tables[0][1], 1.01 * made.tables[0][2]),)
    with pytest.raises(TensorProductControlError, match="aren't convex"):
        controller_from_text(controller_to_text(replace(made, tables=tables)))


def test_the_output_is_bounded_and_bad_inputs_change_nothing() -> None:
    law = TensorProductLaw(designed(), limit=25.0)
    random = np.random.default_rng(2)
    for k in range(500):
        force = law.answer(Setpoint(*random.uniform(-1.0, 1.0, 3)), float(random.uniform(-1.0, 1.0)), 1e-3)
        assert abs(force) <= 25.0, k
    assert law.saturated > 0
    law.reset()
    one = law.answer(Setpoint(0.001), 0.0, 1e-3)
    with pytest.raises(TensorProductControlError, match="can't be used"):
        law.answer(Setpoint(0.001), float("nan"), 1e-3)
    other = TensorProductLaw(designed(), limit=25.0)
    assert other.answer(Setpoint(0.001), 0.0, 1e-3) == one
    assert other.answer(Setpoint(0.001), 0.0, 1e-3) == law.answer(Setpoint(0.001), 0.0, 1e-3)


def test_a_controller_file_names_a_design(tmp_path: Path) -> None:
    write_tp_controller(designed(), tmp_path / "tp.yaml")
    head = "format: fric-controller/1\nunits: {position: m, force: N}\nperiod: 0.001\nresolution: 1.0e-6\n"
    file = tmp_path / "controller.yaml"
    file.write_text(head + "controller: {type: tensor_product, design: tp.yaml, filter_time: 0.002, tolerance: 2.0e-5}\n")
    settings = read_controller(file)
    time = 1e-3 * np.arange(3000)
    target = np.where(time < 0.2, 0.0, 0.004)
    record = Record(time, np.zeros(3000), np.zeros(3000), reference=target, source="step")
    done = closed_loop(axis(), settings, record)
    assert np.ptp(done.record.position[-500:]) == 0.0
    assert abs(done.record.position[-1] - 0.004) <= 2.1e-5
    assert float(np.max(np.abs(done.record.effort))) <= 60.0
    file.write_text(head + "controller: {type: tensor_product}\n")
    with pytest.raises(ControllerError, match=r"'controller.design' is missing"):
        read_controller(file)
    file.write_text(head.replace("N}", "A}") + "controller: {type: tensor_product, design: tp.yaml}\n")
    with pytest.raises(ControllerError, match="units are m and N"):
        read_controller(file)
    write_tp_controller(trial.cylinder_design(), tmp_path / "tp.yaml")
    file.write_text(head + "controller: {type: tensor_product, design: tp.yaml}\n")
    with pytest.raises(TensorProductControlError, match="force of the actuator"):
        read_controller(file)
    assert settings.units == Units()


def test_where_pid_hunts_the_tensor_product_controller_rests() -> None:
    for seed in (1000, 1001, 1002):
        moved, error = trial.positioned(trial.tensor_product(), seed)
        assert moved == 0.0
        assert error <= trial.TOLERANCE + trial.ENCODER
        hunted, _ = trial.positioned(trial.pid(), seed)
        assert hunted > 2.0 * trial.TOLERANCE


def test_random_designs_hold_in_simulation() -> None:
    accepted = 0
    for seed in range(5000, 5006):
        found = trial.random_design(seed)
        if found is None:
            continue
        accepted += 1
        assert trial.eigenvalues_hold(found[1])
        assert trial.decay_found(*found, seed) >= found[1].decay
    assert accepted >= 3


def test_eight_vertices_with_four_states_take_less_than_a_second() -> None:
    assert trial.design_time() < 1.0


@pytest.mark.long
def test_the_benchmark_reaches_its_goals() -> None:
    figures = trial.run(range(30), range(60))
    assert not [each for each in figures if each.reached is False]
