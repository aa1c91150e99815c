"""Tensor-product models: known simplices, matrices of known rank, the paper's vertices, and the mass that slides on one."""

from __future__ import annotations

import numpy as np
import pytest
from fric.friction.enclosing_simplex import blown_up, far_simplex, least_simplex
from fric.friction.tensor_product import TensorProductFriction, from_law, from_model, velocity_grid
from fric.friction.tensor_product_transformation import (
    TensorProduct,
    TensorProductError,
    Weighting,
    deviation,
    sample,
    transform,
)
from fric.model import Model, build_model, term
from fric.simulation import simulate
from numpy.typing import NDArray

Array = NDArray[np.float64]

C, S, VISCOUS, SPEED, MASS = 2.447, 3.7, 15.0, 0.019, 0.102
WEIGHTINGS: tuple[Weighting, ...] = ("SN", "SNNN", "CNO")


def rising(v: Array) -> Array:
    return np.asarray((C + (S - C) / (1 + (v / SPEED) ** 2)) * np.sign(v) + VISCOUS * v)


def falling(v: Array) -> Array:
    return np.asarray(C * np.sign(v) + VISCOUS * v)


def model_b() -> Model:
    surplus = term("accel_hysteresis", force=S - C, velocity=SPEED)
    return build_model("rigid", {"mass": MASS}, [term("coulomb", force=C), surplus, term("viscous", coefficient=VISCOUS)])


def model_c(largest: float = 0.05, size: int = 1000) -> TensorProductFriction:
    return from_law(rising, falling, MASS, velocity_grid(largest, size))


def matrix(p: Array) -> Array:
    """Of rank 3, 2 and 3 over its three parameters, the constant included."""
    a, b, c = p
    return np.array([[np.sin(a) * b, a, 1.0], [1 / c, b * c * np.cos(2 * a), 0.0]])


GRIDS = [np.linspace(-1, 1, 17), np.linspace(0, 2, 6), np.linspace(1, 3, 9)]


# --- simplices ---


@pytest.mark.parametrize("dimensions", [1, 2, 3, 5])
def test_a_cloud_that_fills_a_simplex_gets_that_simplex(dimensions: int) -> None:
    random = np.random.default_rng(dimensions)
    corners = random.standard_normal((dimensions + 1, dimensions))
    inside = random.dirichlet(np.ones(dimensions + 1), 200)
    points = np.vstack([corners, inside @ corners])
    weights = np.column_stack([points, np.ones(len(points))]) @ least_simplex(points)
    at_corners = weights[: dimensions + 1]
    order = np.argmax(at_corners, axis=1)
    np.testing.assert_allclose(at_corners[:, order], np.eye(dimensions + 1), atol=1e-7)
    np.testing.assert_allclose(weights[dimensions + 1 :][:, order], inside, atol=1e-7)


def test_corners_that_are_cut_off_come_back() -> None:
    # What is left of the triangle touches all three sides, so the least one around it is the triangle itself.
    corners = np.array([[0.0, 0.0], [4.0, 0.0], [1.0, 3.0]])
    inside = np.random.default_rng(1).dirichlet(np.ones(3), 1000)
    points = inside[np.max(inside, axis=1) < 0.9] @ corners
    found = np.linalg.inv(least_simplex(points))[:, :2]
    for corner in corners:
        assert np.min(np.linalg.norm(found - corner, axis=1)) < 0.05


def test_the_least_triangle_around_a_circle() -> None:
    angle = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    h = least_simplex(np.column_stack([np.cos(angle), np.sin(angle)]))
    assert 0.5 / abs(np.linalg.det(h)) == pytest.approx(3 * np.sqrt(3), rel=1e-3)


def test_blowing_up_is_just_enough() -> None:
    points = np.random.default_rng(2).standard_normal((300, 3))
    weights = np.column_stack([points, np.ones(300)]) @ blown_up(points, far_simplex(points))
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-13)
    assert np.min(weights) == pytest.approx(0.0, abs=1e-14)


# --- transformation ---


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_exact_at_the_grid_with_the_fewest_weights(weighting: Weighting) -> None:
    samples = sample(matrix, GRIDS)
    model = transform(samples, GRIDS, weighting=weighting)
    # sin(a), a, cos(2a) and the constant; b and the constant; c, 1/c and the constant.
    assert model.vertices.shape == (4, 2, 3, 2, 3)
    assert model.n_vertices == 24
    np.testing.assert_allclose(model.at_grid(), samples, atol=1e-13)
    points = np.stack(np.meshgrid(*GRIDS, indexing="ij"), -1).reshape(-1, 3)
    np.testing.assert_allclose(model.at(points).reshape(samples.shape), samples, atol=1e-13)
    for weights in model.weights:
        np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    if weighting != "SN":
        assert min(float(np.min(weights)) for weights in model.weights) >= 0.0


def test_close_to_normal_means_a_smaller_simplex_than_only_blown_up() -> None:
    samples = sample(matrix, GRIDS)
    # The weights are points times H, so their Gram determinant goes as 1/volume^2.
    gram = {
        kind: np.array([np.linalg.det(weights.T @ weights) for weights in transform(samples, GRIDS, weighting=kind).weights])
        for kind in WEIGHTINGS
    }
    ratio = np.sqrt(gram["CNO"] / gram["SNNN"])
    assert ratio[0] > 3.0
    assert ratio[1] == pytest.approx(1.0)  # one dimension: the interval in both
    assert ratio[2] > 1.0
    assert np.all(gram["SN"] >= gram["CNO"] * (1 - 1e-9))


def test_between_grid_points_it_stays_convex_and_is_linear() -> None:
    model = transform(sample(matrix, GRIDS), GRIDS)
    points = np.random.default_rng(3).uniform([-1.5, -1, 0], [1.5, 3, 4], (400, 3))
    for weights in model.weights_at(points):
        np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
        assert np.min(weights) >= 0.0
    # Half-way along one parameter: the mean of the neighbours.
    ends = model.at(np.array([[GRIDS[0][3], 1.2, 2.0], [GRIDS[0][4], 1.2, 2.0]]))
    middle = model.at(np.array([[0.5 * (GRIDS[0][3] + GRIDS[0][4]), 1.2, 2.0]]))
    np.testing.assert_allclose(middle[0], ends.mean(axis=0), atol=1e-13)
    outside = model.at(np.array([[9.0, -9.0, 9.0]]))
    np.testing.assert_allclose(outside[0], matrix(np.array([1.0, 0.0, 3.0])), atol=1e-12)


def test_the_error_off_the_grid_falls_with_its_square() -> None:
    points = np.random.default_rng(4).uniform([-1, 0, 1], [1, 2, 3], (300, 3))
    found = []
    for finer in (1, 2):
        grids = [np.linspace(grid[0], grid[-1], finer * (len(grid) - 1) + 1) for grid in GRIDS]
        found.append(deviation(transform(sample(matrix, grids), grids), matrix, points))
    assert found[0].rms / found[1].rms == pytest.approx(4.0, rel=0.15)
    assert found[0].largest >= found[0].rms > 0.0
    assert found[0].largest_relative >= found[0].rms_relative > 0.0


@pytest.mark.parametrize("limits", [[2, 2, 2], [3, 2, 2], [4, 1, 3], [1, 1, 1]])
def test_what_is_left_out_stays_within_the_bound(limits: list[int]) -> None:
    samples = sample(matrix, GRIDS)
    model = transform(samples, GRIDS, limits=limits)
    assert model.vertices.shape[:3] == tuple(limits)
    error = float(np.linalg.norm(model.at_grid() - samples))
    assert 0.3 * model.error_bound < error <= model.error_bound * (1 + 1e-9)


def test_the_tolerance_leaves_out_what_is_small() -> None:
    samples = sample(matrix, GRIDS)
    model = transform(samples, GRIDS, tolerance=0.05)
    assert model.n_vertices < 24
    assert np.linalg.norm(model.at_grid() - samples) <= model.error_bound * (1 + 1e-9)
    assert model.error_bound <= 0.05 * np.sqrt(6 + 17 + 9) * np.linalg.norm(samples)


def test_singular_values_are_those_of_the_unfolding_without_its_mean() -> None:
    samples = sample(matrix, GRIDS)
    unfolded = samples.transpose(1, 0, 2, 3, 4).reshape(6, -1)
    expected = np.sqrt(np.maximum(np.linalg.eigvalsh((unfolded - unfolded.mean(0)) @ (unfolded - unfolded.mean(0)).T)[::-1], 0))
    np.testing.assert_allclose(transform(samples, GRIDS).singular_values[1], expected, atol=1e-6)


def test_a_constant_matrix_is_its_own_vertex() -> None:
    model = transform(np.full((5, 1, 2, 3), 7.0), [np.arange(5.0), np.array([2.0])])
    assert model.vertices.shape == (1, 1, 2, 3)
    np.testing.assert_allclose(model.vertices, 7.0, rtol=1e-14)
    np.testing.assert_allclose(model.at(np.array([[1.5, 2.0], [8.0, 0.0]])), 7.0, rtol=1e-14)


def test_a_matrix_to_enclose_lies_in_the_polytope() -> None:
    p = np.linspace(0, 1, 9)
    curve = np.stack([p, p**2], axis=1)[:, None, :]
    far = np.array([[[2.0, -3.0]]])
    model = transform(curve, [p], enclosed=far)
    np.testing.assert_allclose(model.at_grid(), curve, atol=1e-13)
    corners = np.column_stack([model.vertices[:, 0, :], np.ones(3)])
    weights = np.append(far[0, 0], 1.0) @ np.linalg.inv(corners)
    assert np.min(weights) >= -1e-12
    assert model.weights[0].shape == (9, 3)


@pytest.mark.parametrize(
    ("samples", "grids", "rest", "message"),
    [
        (np.zeros((3, 1, 1)), [np.array([0.0, 2.0, 1.0])], {}, "doesn't increase"),
        (np.zeros((3, 1, 1)), [np.arange(4.0)], {}, "shape"),
        (np.zeros((3, 1)), [np.arange(3.0)], {}, "shape"),
        (np.full((3, 1, 1), np.nan), [np.arange(3.0)], {}, "not finite"),
        (np.zeros((3, 1, 1)), [np.arange(3.0)], {"limits": [2, 2]}, "limits"),
        (np.zeros((3, 1, 1)), [np.arange(3.0)], {"limits": [0]}, "limits"),
        (np.zeros((3, 1, 1)), [np.arange(3.0)], {"enclosed": np.zeros((1, 2, 2))}, "enclose"),
    ],
)
def test_what_can_t_be_transformed_is_refused(
    samples: Array, grids: list[Array], rest: dict[str, object], message: str
) -> None:
    with pytest.raises(TensorProductError, match=message):
        transform(samples, grids, **rest)  # type: ignore[arg-type]


# --- friction ---


def test_the_paper_s_vertices() -> None:
    law = model_c()
    up, down = law.speeding_up.vertices[:, 0, 0], law.slowing_down.vertices[:, 0, 0]
    assert up[0] == pytest.approx(-7.25e5, rel=1e-3)  # Eq. 24
    assert down[0] == pytest.approx(-4.79e5, rel=2e-3)  # Eq. 26
    assert up[0] / down[0] == pytest.approx(3.7 / 2.447, rel=1e-3)
    assert up[1] == pytest.approx(down[1], rel=1e-12)
    alone = from_law(rising, falling, MASS, velocity_grid(0.05, 1000), shared=False)
    assert alone.speeding_up.vertices[1, 0, 0] == pytest.approx(-float(rising(np.array([0.05]))[0]) / (0.05 * MASS), rel=1e-12)
    assert alone.speeding_up.vertices[0, 0, 0] == pytest.approx(up[0], rel=1e-12)


@pytest.mark.parametrize("shared", [True, False])
def test_friction_is_that_of_the_law(shared: bool) -> None:
    law = from_law(rising, falling, MASS, velocity_grid(0.05, 1000), shared=shared)
    grid = law.speeding_up.grids[0]
    np.testing.assert_allclose(law.force(grid), rising(grid), rtol=1e-12)
    np.testing.assert_allclose(law.force(grid, False), falling(grid), rtol=1e-12)
    between = np.random.default_rng(5).uniform(-0.05, 0.05, 5000)
    between = between[np.abs(between) > grid[500]]
    np.testing.assert_allclose(law.force(between), rising(between), rtol=1e-5)
    # Coulomb and viscous friction are a straight line, so nothing is lost between grid points.
    np.testing.assert_allclose(law.force(between, False), falling(between), rtol=1e-12)
    mixed = np.array([True, False] * 3)
    v = np.array([-0.04, -0.04, 0.01, 0.01, 0.03, 0.03])
    np.testing.assert_allclose(law.force(v, mixed), np.where(mixed, rising(v), falling(v)), rtol=1e-5)


def test_weights_make_the_damping_of_which_the_force_comes() -> None:
    law = model_c()
    v = np.concatenate([np.linspace(-0.07, 0.07, 501), [0.0, 1e-7, -1e-7]])
    for up, branch in ((True, law.speeding_up), (False, law.slowing_down)):
        weights = law.weights(v, up)
        np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
        assert np.min(weights) >= 0.0
        np.testing.assert_allclose(law.damping(v, up), weights @ branch.vertices[:, 0, 0], rtol=1e-14)
        outside = np.abs(v) > 1e-4
        np.testing.assert_allclose(law.force(v, up)[outside], (-MASS * law.damping(v, up) * v)[outside], rtol=1e-12)


def test_inside_the_innermost_grid_velocity_there_is_a_level_to_stick_at() -> None:
    law = model_c()
    innermost = float(law.speeding_up.grids[0][500])
    assert law.force(0.0)[0] == 0.0
    expected = float(rising(np.array([innermost]))[0])
    np.testing.assert_allclose(law.force([1e-9, -1e-9]), [expected, -expected], rtol=1e-12)
    assert law.break_away() == law.break_away(-1.0) == pytest.approx(expected)


def test_a_model_s_terms_give_the_same_as_its_curves() -> None:
    law, typed = from_model(model_b(), velocity_grid(0.05, 200)), model_c(0.05, 200)
    v = np.linspace(-0.06, 0.06, 333)
    for up in (True, False):
        np.testing.assert_allclose(law.force(v, up), typed.force(v, up), rtol=1e-9)


def test_slip_dynamics_have_no_curve() -> None:
    bristles = term("presliding", "lugre", stiffness=1e5)
    with pytest.raises(TensorProductError, match="slip dynamics"):
        from_model(model_b().with_terms([term("coulomb", force=1.0), bristles]), velocity_grid(0.05, 100))


@pytest.mark.parametrize("size", [3, 2, 7])
def test_a_velocity_grid_must_miss_zero(size: int) -> None:
    with pytest.raises(TensorProductError, match="even number"):
        velocity_grid(0.1, size)


def test_a_grid_on_one_side_only_is_refused() -> None:
    with pytest.raises(TensorProductError, match="both sides"):
        from_law(rising, falling, MASS, np.linspace(0.01, 0.05, 20))


# --- from data ---


def test_it_sticks_exactly_below_break_away() -> None:
    law = model_c()
    for push in (0.9999, -0.9999):
        run = law.simulate(np.full(10_000, push * law.break_away()), 1e-3)
        assert np.all(run.position == 0.0)
        np.testing.assert_array_equal(run.friction[1:], push * law.break_away())
        moved = law.simulate(np.full(100, 1.0002 * np.sign(push) * law.break_away()), 1e-3)
        assert moved.position[-1] * push > 0.0


@pytest.mark.parametrize("step", [1e-3, 1e-4])
def test_it_moves_as_the_same_law_does_as_a_model(step: float) -> None:
    force = 4.0 * np.sin(2 * np.pi * 5 * step * np.arange(round(1 / step)))
    mine = model_c(0.1, 4000).simulate(force, step)
    theirs = simulate(model_b(), force, step)
    assert np.max(np.abs(mine.velocity - theirs.velocity)) < 1e-3 * np.ptp(theirs.velocity)
    assert np.max(np.abs(mine.position - theirs.position)) < 1e-3 * np.ptp(theirs.position)
    assert np.any(mine.velocity == 0.0)
    assert np.any(mine.velocity < 0.0)


def test_energy_closes_in_every_step() -> None:
    step = 1e-3
    force = 5.0 * np.sin(2 * np.pi * 3 * step * np.arange(2000)) + 1.0
    run = model_c().simulate(force, step)
    v, q = run.velocity, run.position
    momentum = MASS * np.diff(v) - step * (run.applied - run.friction)[1:]
    assert np.max(np.abs(momentum)) < 1e-12 * step * 5.0
    taken = run.friction[1:] * np.diff(q)
    whole = (v[1:] * v[:-1] > 0.0) | (v[1:] == v[:-1])
    kinetic = 0.5 * MASS * np.diff(v**2)
    work = run.applied[1:] * np.diff(q)
    np.testing.assert_allclose(kinetic[whole] + taken[whole], work[whole], atol=1e-13)
    assert np.min(taken) >= 0.0


def test_speed_is_kept_while_neither_branch_can_change_it() -> None:
    law = model_c(0.1, 4000)
    # Between falling(0.03) = 2.9 N and rising(0.03) = 3.26 N.
    run = law.simulate(np.full(200, 3.1), 1e-3, velocity=0.03)
    assert np.all(run.velocity == 0.03)
    np.testing.assert_allclose(run.friction[1:], 3.1, rtol=1e-14)


def test_beyond_the_grid_the_damping_stays() -> None:
    law = model_c(0.05, 100)
    end = float(rising(np.array([0.05]))[0])
    np.testing.assert_allclose(law.force([0.1, -0.2]), [2 * end, -4 * end], rtol=1e-12)
    steady = law.simulate(np.full(3000, 2 * end), 1e-3, velocity=0.09)
    assert steady.velocity[-1] == pytest.approx(0.1, rel=1e-6)
    assert isinstance(law.speeding_up, TensorProduct)


def test_it_stops_within_a_step_on_the_falling_branch() -> None:
    v = 0.02
    run = model_c().simulate(np.zeros(3), 0.1, velocity=v)
    # Kinetic energy over the force at half the speed, which is the mean on a straight line.
    assert run.position[1] == pytest.approx(0.5 * MASS * v**2 / float(falling(np.array([0.5 * v]))[0]), rel=1e-9)
    np.testing.assert_array_equal(run.velocity[1:], 0.0)
    assert run.position[2] == run.position[1]
    assert run.friction[1] == pytest.approx(MASS * v / 0.1, rel=1e-9)


def test_each_direction_slides_on_its_own_friction() -> None:
    grid = velocity_grid(0.2, 2000)
    law = from_law(lambda v: rising(v) * np.where(v > 0, 1, 2), lambda v: falling(v) * np.where(v > 0, 1, 2), MASS, grid)
    forth = law.simulate(np.full(2000, 4.5), 1e-3)
    back = law.simulate(np.full(2000, -9.0), 1e-3)
    # Steady where the force is rising(v), and backwards twice that.
    assert float(rising(forth.velocity[-1:])[0]) == pytest.approx(4.5, rel=1e-5)
    assert back.velocity[-1] == pytest.approx(-forth.velocity[-1], rel=1e-5)
    assert np.all(law.simulate(np.full(100, -7.3), 1e-3).velocity == 0.0)
