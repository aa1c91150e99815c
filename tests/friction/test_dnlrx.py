"""DNLRX against sums written out by hand, a bisection, and a continuous system."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fric.friction.dnlrx import (
    DnlrxError,
    DnlrxModel,
    DnlrxPredictor,
    DnlrxSimulator,
    derivative_filter,
    from_mechanics,
    poles,
    step_at_slip,
)
from fric.friction.dnlrx_file import dnlrx_from_text, dnlrx_to_text, read_dnlrx, write_dnlrx
from fric.friction.dnlrx_regression import (
    deformations,
    from_coefficients,
    noe,
    regressors,
    sliding_start,
    spread_thresholds,
)
from fric.record import Units
from hypothesis import given, settings
from hypothesis import strategies as st

GENERAL = DnlrxModel(
    1e-3,
    np.array([0.5, 2.0, 1.0]),
    np.array([3.0, -4.0, 1.5]),
    np.array([[2.0, 0.7, 1.1], [-0.4, 0.2, 0.3], [0.1, -0.3, 0.05], [0.02, 0.0, -0.1]]),
    0.25,
)


def walk(n: int, seed: int = 5) -> np.ndarray:
    return np.cumsum(np.random.default_rng(seed).normal(0.0, 0.6, n))


def printed(model: DnlrxModel, x: np.ndarray) -> np.ndarray:
    """Eqs. 11 and 14 as they are printed, sample by sample, from rest at 0."""
    m = model.thresholds.shape[0]
    n, n_delta = model.position_filter.shape[0] - 1, model.deformation_filter.shape[0] - 1
    delta = {k: np.zeros(m) for k in range(-n_delta - 1, 0)}
    at = dict.fromkeys(range(-n - 1, 0), 0.0)
    u = []
    for k, here in enumerate(x.tolist()):
        at[k] = here
        s = at[k] - at[k - 1] + delta[k - 1]
        delta[k] = np.sign(s) * np.minimum(np.abs(s), model.thresholds)
        linear = sum(model.position_filter[j] * at[k - j] for j in range(n + 1))
        friction = sum(float(model.deformation_filter[j] @ delta[k - j]) for j in range(n_delta + 1))
        u.append(linear + friction + model.offset)
    return np.array(u)


def test_the_predictor_is_equations_11_and_14() -> None:
    x = walk(300)
    np.testing.assert_allclose(DnlrxPredictor(GENERAL).run(x), printed(GENERAL, x), rtol=1e-12, atol=1e-12)


def test_blocks_and_single_samples_are_the_same_run() -> None:
    x = walk(60)
    whole = DnlrxPredictor(GENERAL).run(x)
    pieces = DnlrxPredictor(GENERAL)
    assert np.array_equal(np.concatenate([pieces.run(x[:17]), [pieces.step(v) for v in x[17:30]], pieces.run(x[30:])]), whole)
    simulator, again = DnlrxSimulator(GENERAL), DnlrxSimulator(GENERAL)
    motion = simulator.run(whole)
    assert np.array_equal(np.concatenate([again.run(whole[:11]), [again.step(u) for u in whole[11:]]]), motion)


def bisected(model: DnlrxModel, x_past: list[float], delta_past: list[np.ndarray], u: float) -> float:
    """x(k) by bisection over Eq. 14, which doesn't know about corners."""

    def surplus(x: float) -> float:
        delta = np.clip(x - x_past[0] + delta_past[0], -model.thresholds, model.thresholds)
        total = model.offset - u + model.position_filter[0] * x + float(model.deformation_filter[0] @ delta)
        total += sum(g * past for g, past in zip(model.position_filter[1:], x_past, strict=False))
        return total + sum(float(row @ past) for row, past in zip(model.deformation_filter[1:], delta_past, strict=False))

    low, high = -1e3, 1e3
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if surplus(middle) < 0.0 else (low, middle)
    return 0.5 * (low + high)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-20.0, 20.0), min_size=1, max_size=12))
def test_the_simulator_solves_equation_14(forces: list[float]) -> None:
    # A friction that falls at first (Theta_0 of the stiffest spring is negative) but stays solvable.
    for theta in ([2.0, 0.7, 1.1], [-1.2, 0.7, 1.1], [2.0, -0.9, -0.7]):
        filters = np.array([theta, [-0.4, 0.2, 0.3]])
        model = DnlrxModel(1.0, np.array([0.5, 2.0, 1.0]), np.array([3.0, -1.0]), filters, 0.25)
        found = DnlrxSimulator(model).run(np.array(forces))
        x_past, delta_past = [0.0], [np.zeros(3)]
        for u, x in zip(forces, found.tolist(), strict=True):
            assert x == pytest.approx(bisected(model, x_past, delta_past, u), abs=1e-9)
            delta = np.clip(x - x_past[0] + delta_past[0], -model.thresholds, model.thresholds)
            x_past, delta_past = [x], [delta]


@pytest.mark.parametrize("order", [2, 3, 4])
def test_motion_from_the_force_of_a_motion_is_that_motion(order: int) -> None:
    model = from_mechanics(1.0, 5.0, 0.0, [1e5, 3e4], [1e-5, 8e-5], 1e-3, order=order, spring_damping=[30.0, 10.0])
    x = 1e-4 * np.sin(0.02 * np.arange(5000)) + 3e-5 * np.sin(0.11 * np.arange(5000))
    np.testing.assert_allclose(DnlrxSimulator(model).run(DnlrxPredictor(model).run(x)), x, atol=1e-9 * np.ptp(x), rtol=0.0)


def test_a_force_that_does_not_determine_the_motion_is_refused() -> None:
    # All three stick: 1 - 0.5 - 0.6 + 0.3 > 0. The smallest slides: 1 - 0.6 - 0.5 < 0.
    model = DnlrxModel(1.0, np.array([3.0, 1.0, 2.0]), np.array([1.0]), np.array([[-0.6, 0.3, -0.5]]))
    np.testing.assert_allclose(model.slopes, [0.2, -0.1, 0.4, 1.0])
    DnlrxPredictor(model).run(np.zeros(3))
    with pytest.raises(DnlrxError, match="doesn't determine the motion"):
        DnlrxSimulator(model)
    # Springs with the same threshold slide together: the slope between them is never met.
    together = DnlrxModel(1.0, np.array([1.0, 1.0]), np.array([1.0]), np.array([[2.0, -1.5]]))
    np.testing.assert_allclose(together.slopes, [1.5, 1.0])
    DnlrxSimulator(together)


def test_deformations_no_motion_leads_to_are_refused() -> None:
    model = from_mechanics(1.0, 0.0, 0.0, [1.0, 1.0], [1.0, 1.5], 1.0)
    DnlrxSimulator(model, deformation=np.array([1.0, 1.5]))
    with pytest.raises(DnlrxError, match="no motion leads to"):
        DnlrxSimulator(model, deformation=np.array([1.0, 0.0]))


def test_the_mechanical_system_on_a_parabola() -> None:
    # x = a t^2 / 2: differences of second order give a and a t exactly, and each spring k min(x, Delta).
    mass, damping, stiffness, a, step = 1.3, 4.0, 7.0, 0.2, 1e-2
    springs, thresholds = np.array([50.0, 20.0]), np.array([0.01, 0.04])
    t = step * np.arange(120)
    x = 0.5 * a * t**2
    found = DnlrxPredictor(from_mechanics(mass, damping, stiffness, springs.tolist(), thresholds.tolist(), step)).run(x)
    expected = mass * a + damping * a * t + stiffness * x + np.minimum(x[:, None], thresholds) @ springs
    np.testing.assert_allclose(found[2:], expected[2:], rtol=1e-10)


def test_derivative_filters() -> None:
    np.testing.assert_allclose(derivative_filter(1, 1, 0.5), [2.0, -2.0])
    np.testing.assert_allclose(derivative_filter(2, 2, 0.5), [4.0, -8.0, 4.0])
    np.testing.assert_allclose(derivative_filter(2, 3, 1.0), [2.0, -5.0, 4.0, -1.0], atol=1e-12)
    with pytest.raises(DnlrxError, match="can't give derivative 2"):
        derivative_filter(2, 1, 1.0)


def test_a_free_mass_is_stable_up_to_order_seven() -> None:
    largest = [float(poles(from_mechanics(1.0, 0.0, 0.0, [], [], 1.0, order=n))[0][0]) for n in range(2, 9)]
    assert max(largest[:-1]) < 1.0 + 1e-6
    assert largest[-1] > 1.05


def test_poles_with_sticking_springs() -> None:
    # Backward differences of m x'' + k x: 1/(1 + h^2 k/m) is the squared magnitude.
    sliding, sticking = poles(from_mechanics(2.0, 0.0, 0.0, [3.0, 5.0], [1.0, 2.0], 0.5))
    np.testing.assert_allclose(sliding, [1.0, 1.0], atol=1e-7)
    np.testing.assert_allclose(sticking**2, 1.0 / (1.0 + 0.25 * 8.0 / 2.0))


def test_step_at_slip() -> None:
    model = from_mechanics(1.0, 0.0, 0.0, [10.0, 20.0], [1e-3, 2e-3], 1e-2, spring_damping=[3.0, 0.0])
    np.testing.assert_allclose(step_at_slip(model), [-3.0, 0.0], atol=1e-12)
    # At 1e-2 per second the first spring slides after 0.1 s: the force falls by 3 * 1e-2 besides its change of slope.
    v = 1e-2
    u = DnlrxPredictor(model).run(v * 1e-2 * np.arange(40))
    rise = np.diff(u)
    assert u[11] - u[10] == pytest.approx(20.0 * v * 1e-2 - 3.0 * v, rel=1e-9)
    np.testing.assert_allclose(rise[12:18], 20.0 * v * 1e-2, rtol=1e-9)


def test_regressors_recover_a_model_from_its_own_force() -> None:
    x = walk(400)
    u = DnlrxPredictor(GENERAL).run(x)
    n_springs, n_delta, n = GENERAL.order
    assert (n_springs, n_delta, n) == (3, 3, 2)
    assert GENERAL.first_predicted == 3
    first = np.clip(x[0], -GENERAL.thresholds, GENERAL.thresholds)  # the springs after the first move away from 0
    rows = regressors(x, GENERAL.thresholds, n, n_delta, first)
    assert rows.shape == (400 - 3, 3 + 4 * 3 + 1)
    found = np.linalg.lstsq(rows, u[3:], rcond=None)[0]
    model = from_coefficients(found, GENERAL.thresholds, n, n_delta, 1e-3)
    np.testing.assert_allclose(model.position_filter, GENERAL.position_filter, atol=1e-9)
    np.testing.assert_allclose(model.deformation_filter, GENERAL.deformation_filter, atol=1e-9)
    assert model.offset == pytest.approx(0.25, abs=1e-9)
    with pytest.raises(DnlrxError, match="longer record"):
        regressors(x[:3], GENERAL.thresholds, n, n_delta)


def test_all_springs_slide_at_the_sliding_start_whatever_came_before() -> None:
    x = np.concatenate([np.linspace(0.3, -0.4, 30), np.linspace(-0.4, 0.8, 60), np.linspace(0.8, 0.1, 40)])
    found = sliding_start(x)
    assert (found.sample, found.direction) == (89, 1.0)
    assert found.travel == pytest.approx(1.2)
    thresholds = np.array([0.1, 0.35, 0.6])  # up to half of the travel
    for before in (-thresholds, 0.0 * thresholds, thresholds):
        np.testing.assert_allclose(deformations(x, thresholds, before)[found.sample], thresholds, rtol=1e-12)
    assert sliding_start(-x).direction == -1.0
    with pytest.raises(DnlrxError, match="doesn't move"):
        sliding_start(np.ones(5))
    np.testing.assert_allclose(spread_thresholds(1.2, 2), [0.2, 0.4])


def test_the_sliding_start_of_a_noisy_oscillation_is_early() -> None:
    t = np.linspace(0.0, 10.0, 10_001)  # ten periods
    x = np.sin(2 * np.pi * t) + 1e-4 * np.random.default_rng(2).normal(size=t.shape)
    found = sliding_start(x)
    assert 0.7 < t[found.sample] < 0.8
    assert found.direction == -1.0


def test_noe_by_hand() -> None:
    # Mean 2; squared spread 1 + 0 + 1; squared error 0.01 + 0.04.
    assert noe(np.array([1.0, 2.0, 3.0]), np.array([1.1, 2.0, 2.8])) == pytest.approx(2.5)


def test_the_text_form_keeps_every_bit(tmp_path: Path) -> None:
    odd = DnlrxModel(1.6e-4, np.array([1 / 3, 1e-9]), np.array([1e7 / 7, -2e-320]), np.array([[np.pi, -0.0]]), -1e-17)
    write_dnlrx(odd, tmp_path / "odd.yaml", Units("rad", "N m"))
    again, units = read_dnlrx(tmp_path / "odd.yaml")
    assert units == Units("rad", "N m")
    assert (again.sample_time, again.offset) == (odd.sample_time, odd.offset)
    for name in ("thresholds", "position_filter", "deformation_filter"):
        assert getattr(again, name).tobytes() == getattr(odd, name).tobytes()
    plain, _ = dnlrx_from_text(dnlrx_to_text(DnlrxModel(1.0, np.zeros(0), np.ones(3), np.zeros((1, 0)))))
    assert plain.order == (0, 0, 2)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("thresholds: [0.5", "thresholds: [-0.5"), "line 6: 'thresholds.0' is -0.5; input should be greater than 0"),
        (("offset", "ofset"), "unknown key 'ofset'; use only format, units"),
        (("sample_time: 0.001", "sample_time: '0.001'"), "'sample_time' is '0.001'"),
        (("sample_time: 0.001", ""), "'sample_time' is missing"),
        (("- [2.0, 0.7, 1.1]", "- [2.0, 0.7]"), "has 2 numbers for 3 thresholds; give one number for each threshold"),
        (("0.25", ".nan"), "'offset' is nan"),
        (("fric-dnlrx/1", "fric-dnlrx/2"), "'format' is 'fric-dnlrx/2'"),
        (("[3.0,", "[3.0,,"), "line 8"),
    ],
)
def test_a_bad_file_is_refused_with_its_line(change: tuple[str, str], message: str) -> None:
    text = dnlrx_to_text(GENERAL)
    assert change[0] in text
    with pytest.raises(DnlrxError) as refusal:
        dnlrx_from_text(text.replace(*change), "axis.yaml")
    assert str(refusal.value).startswith("axis.yaml")
    assert message in str(refusal.value)


def test_bad_values_are_refused() -> None:
    good = (1e-3, np.array([1.0]), np.array([1.0]), np.array([[1.0]]))
    for at, value, message in (
        (0, 0.0, "sample_time"),
        (1, np.array([0.0]), "not positive"),
        (1, np.array([np.nan]), "finite"),
        (2, np.zeros(0), "is empty"),
        (3, np.array([[1.0, 2.0]]), "for 1 thresholds"),
        (3, np.array([1.0]), "2 dimension"),
    ):
        values = list(good)
        values[at] = value
        with pytest.raises(DnlrxError, match=message):
            DnlrxModel(*values)  # type: ignore[arg-type]
    with pytest.raises(DnlrxError, match="another length"):
        from_mechanics(1.0, 0.0, 0.0, [1.0], [1.0], 1.0, spring_damping=[1.0, 2.0])
    with pytest.raises(DnlrxError, match="no such file"):
        read_dnlrx("/nowhere/at/all.yaml")


def test_a_model_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match="read-only"):
        GENERAL.thresholds[0] = 1.0
