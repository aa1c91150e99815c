"""Two-stage identification against Eq. 11 written out sample by sample, and an axis moved by an integrator of its own."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from fric.bench.benchmarks import calibration_two_stage
from fric.friction.dnlrx_file import dnlrx_from_text
from fric.identification import METHODS
from fric.identification.dnlrx.cost import Cost, differences, to_taps
from fric.identification.dnlrx.fit import fit_dnlrx
from fric.identification.dnlrx.linear import rows_of, solve
from fric.identification.dnlrx.order import choose_order
from fric.identification.dnlrx.samples import Prepared, prepare
from fric.identification.dnlrx.search import search
from fric.identification.methods.two_stage import TwoStageIdentification
from fric.identification.result import IdentificationError, Options
from fric.identification.start import start_model
from fric.model import build_model, term
from fric.record import Record
from numpy.typing import NDArray

Array = NDArray[np.float64]

MASS, VISCOUS, BIAS = 2.0, 40.0, 0.3
SPRINGS = np.array([4e5, 2e5, 1e5])
LIMITS = np.array([4e-7, 1.5e-6, 5e-6])
LEVEL = float(SPRINGS @ LIMITS)
STEP = 1e-3


def reference(seed: int, largest: float, turns: int, least: float) -> Array:
    """Smooth moves of random length, after one long stroke."""
    rng = np.random.default_rng(seed)
    points = [0.0, 1.3 * largest, -1.3 * largest]
    for length in np.exp(rng.uniform(math.log(3e-8), math.log(2.0 * largest), turns)):
        way = float(length) * (1.0 if rng.random() < 0.5 else -1.0)
        points.append(points[-1] + way if abs(points[-1] + way) < largest else points[-1] - way)
    parts = [np.zeros(200)]
    for a, b in pairwise(points):
        n = round(max(least, abs(b - a) / 4e-4) / STEP)
        s = np.arange(1, n + 1) / n
        parts.append(a + (b - a) * s**3 * (10.0 - 15.0 * s + 6.0 * s**2))
    return np.concatenate(parts)


def move(seed: int = 1, largest: float = 4e-5, turns: int = 100, least: float = 0.12, fine: int = 20) -> Record:
    """m dv/dt = u - F - c v - b with three springs that slide, under a PD controller; semi-implicit Euler in plain Python."""
    wanted = reference(seed, largest, turns, least).tolist()
    h = STEP / fine
    q = v = 0.0
    last = wanted[0]
    bent = [0.0] * SPRINGS.shape[0]
    springs, limits = SPRINGS.tolist(), LIMITS.tolist()
    positions, forces = [], []
    for target in wanted:
        u = 1e6 * (target - q) + 2500.0 * ((target - last) / STEP - v) + BIAS
        last = target
        positions.append(q)
        forces.append(u)
        for _ in range(fine):
            friction = sum(k * d for k, d in zip(springs, bent, strict=True))
            v += h / MASS * (u - friction - VISCOUS * v - BIAS)
            q += h * v
            bent = [min(max(d + h * v, -limit), limit) for d, limit in zip(bent, limits, strict=True)]
    time = STEP * np.arange(len(wanted), dtype=np.float64)
    return Record(time, np.array(positions), np.array(forces), effort_hold="following", source=f"rig {seed}")


def noisy(record: Record, seed: int, position: float = 1e-10, force: float = 2e-3) -> Record:
    rng = np.random.default_rng(seed)
    n = record.n_samples
    return replace(
        record,
        position=record.position + position * rng.standard_normal(n),
        effort=record.effort + force * rng.standard_normal(n),
    )


@pytest.fixture(scope="module")
def rig() -> Record:
    return move()


@pytest.fixture(scope="module")
def train(rig: Record) -> Record:
    return noisy(rig, 1)


@pytest.fixture(scope="module")
def prepared(train: Record) -> Prepared:
    return prepare([train], Options())


def written_out(prepared: Prepared, thresholds: Array, n: int, n_delta: int, every: int) -> tuple[Array, Array]:
    """The regression of Eq. 17 by a loop over all samples, with Eq. 11 as it is printed."""
    rows, force = [], []
    for part in prepared.parts:
        delta = part.start.direction * thresholds
        history = [delta]
        for before, here in pairwise(part.position.tolist()):
            s = here - before + delta
            delta = np.sign(s) * np.minimum(np.abs(s), thresholds)
            history.append(delta)
        for k in range(max(n, n_delta), part.position.shape[0], every):
            moved = [part.position[k - j] for j in range(n + 1)]
            rows.append(np.concatenate([moved, *(history[k - j] for j in range(n_delta + 1)), [1.0]]))
            force.append(part.force[k])
    return np.array(rows), np.array(force)


@pytest.mark.parametrize(("n", "n_delta", "every"), [(2, 0, 1), (3, 0, 100), (2, 1, 7), (1, 2, 50)])
def test_the_cost_is_that_of_the_regression_written_out(rig: Record, n: int, n_delta: int, every: int) -> None:
    # Two parts, which slide in opposite directions at first.
    other = replace(rig, position=-rig.position, effort=-rig.effort).slice(0, 9000)
    both = prepare([noisy(rig.slice(0, 9000), 4), noisy(other, 5)], Options())
    assert {part.start.direction for part in both.parts} == {-1.0, 1.0}
    thresholds = np.array([7e-7, 3e-6])
    columns, force = written_out(both, thresholds, n, n_delta, every)
    scale = np.linalg.norm(columns, axis=0)
    left = force - columns @ (np.linalg.lstsq(columns / scale, force, rcond=1e-14)[0] / scale)
    expected = 100.0 * float(left @ left) / float(np.sum((force - force.mean()) ** 2))
    order = (2, n_delta, n)
    cost = Cost(both.parts, order, rows_of(both.parts, order, every))
    assert cost.n_rows == force.shape[0]
    assert cost(thresholds) == pytest.approx(expected, rel=1e-6)
    linear = solve(both, thresholds, order, rows_of(both.parts, order, every))
    measured = [part.force[max(n, n_delta) :: every] for part in both.parts]
    off = np.concatenate(measured) - np.concatenate([part.predicted(linear.model)[::every] for part in both.parts])
    assert 100.0 * float(off @ off) / float(np.sum((force - force.mean()) ** 2)) == pytest.approx(expected, rel=1e-4)
    assert linear.undetermined == ()


def test_differences_and_taps_say_the_same() -> None:
    x = np.random.default_rng(2).standard_normal(30)
    rows = np.arange(4, 30)
    coefficients = np.array([1.0, -2.0, 0.5, 3.0])
    by_differences = coefficients @ differences(x, rows, 3)
    by_taps = sum(g * x[rows - j] for j, g in enumerate(to_taps(3) @ coefficients))
    assert by_differences == pytest.approx(by_taps, abs=1e-12)
    assert differences(x, rows, 2)[2] == pytest.approx(x[rows] - 2 * x[rows - 1] + x[rows - 2], abs=1e-12)


def test_springs_that_are_the_same_are_said_and_cost_nothing(prepared: Prepared) -> None:
    once, twice = (2, 0, 2), (3, 0, 2)
    rows = rows_of(prepared.parts, once, 10)
    one = Cost(prepared.parts, once, rows)(np.array([5e-7, 3e-6]))
    two = Cost(prepared.parts, twice, rows)(np.array([5e-7, 3e-6, 3e-6]))
    assert two == pytest.approx(one, rel=1e-9)
    linear = solve(prepared, np.array([5e-7, 3e-6, 3e-6]), twice, rows)
    assert len(linear.undetermined) == 1
    assert linear.undetermined[0] in ("Theta_0_2", "Theta_0_3")
    assert np.all(np.isfinite(linear.model.deformation_filter))


def test_the_search_finds_the_thresholds(prepared: Prepared) -> None:
    order = (3, 0, 3)
    cost = Cost(prepared.parts, order, rows_of(prepared.parts, order, 25))
    found = search(cost, prepared.lowest, prepared.highest)
    assert found.thresholds == pytest.approx(LIMITS, rel=0.02)
    assert found.noe <= found.first_stage * (1.0 + 1e-9)
    assert found.noe <= 1.02 * cost(LIMITS)
    again = search(Cost(prepared.parts, order, rows_of(prepared.parts, order, 25)), prepared.lowest, prepared.highest)
    assert np.array_equal(again.thresholds, found.thresholds), "the same seed gives the same bits"


def test_held_out_samples_choose_the_number_of_springs(prepared: Prepared) -> None:
    order, trials = choose_order(prepared, 25, most_springs=5)
    assert order[0] == 3
    assert order[1] == 0
    by_order = {trial.order: trial for trial in trials}
    assert by_order[(2, 0, 3)].held_out_noe > 3.0 * by_order[(3, 0, 3)].held_out_noe
    assert {trial.order[1] for trial in trials} == {0, 1, 3}, "a second filter is shown beside"


def test_a_dnlrx_predicts_a_recording_that_it_has_not_seen(train: Record) -> None:
    fit = fit_dnlrx([train], (3, 0, 3), Options(decimation=10))
    assert fit.noe < 0.1
    assert fit.validate([noisy(move(seed=8, turns=60), 9)]) < 0.1
    assert fit.decimation == 10
    assert fit.covariance.shape == (len(fit.names),) * 2
    slower = move(seed=8, turns=60)
    half = replace(slower, time=slower.time[::2], position=slower.position[::2], effort=slower.effort[::2])
    with pytest.raises(IdentificationError, match="record at the rate"):
        fit.validate([half])


def test_the_mechanism_is_that_of_the_rig(train: Record) -> None:
    structure = start_model(["coulomb", "viscous", "bias"], "axis", train.units)
    result = METHODS["two-stage"].fit(structure, [train], Options())
    assert isinstance(result, TwoStageIdentification)
    truth = {"mass": MASS, "coulomb.force": LEVEL, "bias.force": BIAS}
    truth |= {f"presliding.stiffness_{k}": value for k, value in enumerate(SPRINGS.tolist(), start=1)}
    truth |= {f"presliding.limit_{k}": value for k, value in enumerate(LIMITS.tolist(), start=1)}
    errors = result.model.standard_errors
    for name, value in truth.items():
        assert result.model.value(name) == pytest.approx(value, rel=0.02), name
        assert 0.0 < errors[name] < 0.02 * abs(value), name
    assert set(truth) | {"viscous.coefficient"} == set(result.fitted)
    assert result.train.noe < 1e-3
    dnlrx, units = dnlrx_from_text(result.attachments["dnlrx.yaml"])
    assert dnlrx.order[0] == 3
    assert units == result.model.units
    remark = result.remarks_on([noisy(move(seed=8, turns=60), 9)])
    assert len(remark) == 1
    assert "NOE" in remark[0]


def test_a_structure_with_springs_says_how_many(train: Record) -> None:
    springs = term("presliding", "maxwell_slip", stiffness_1=1.0, limit_1=1.0, stiffness_2=1.0, limit_2=1.0)
    structure = build_model("rigid", {"mass": MASS}, [term("coulomb", force=1.0), springs, term("viscous", coefficient=1.0)])
    result = METHODS["two-stage"].fit(structure, [train], Options(held=("mass",)))
    assert isinstance(result, TwoStageIdentification)
    assert result.dnlrx is not None
    assert result.dnlrx.model.order[:2] == (2, 0)
    assert result.model.value("mass") == MASS
    assert "mass" not in result.fitted
    assert "bias.force" not in result.fitted


def test_intervals_hold_the_truth(rig: Record) -> None:
    """90 % intervals of all parameters, over seeds of the noise."""
    structure = build_model(
        "rigid",
        {"mass": MASS},
        [
            term("coulomb", force=1.0),
            term("presliding", "maxwell_slip", **{f"{w}_{k}": 1.0 for w in ("stiffness", "limit") for k in (1, 2, 3)}),
            term("viscous", coefficient=1.0),
            term("bias", force=0.0),
        ],
    )
    truth = {"mass": MASS, "viscous.coefficient": VISCOUS, "bias.force": BIAS, "coulomb.force": LEVEL}
    truth |= {f"presliding.stiffness_{k}": value for k, value in enumerate(SPRINGS.tolist(), start=1)}
    truth |= {f"presliding.limit_{k}": value for k, value in enumerate(LIMITS.tolist(), start=1)}
    hits = []
    for seed in range(12):
        result = METHODS["two-stage"].fit(structure, [noisy(rig, 100 + seed, force=0.02)], Options(decimation=25))
        for name, value in truth.items():
            hits.append(abs(result.model.value(name) - value) <= 1.645 * result.model.standard_errors[name])
    assert len(hits) == 120
    # Four standard deviations of what 120 intervals, some of them correlated, scatter by.
    assert 0.75 <= np.mean(hits) <= 0.99


def test_strokes_that_are_too_short_are_said(rig: Record) -> None:
    short = noisy(move(seed=3, largest=3e-6, turns=80), 3)
    fit = fit_dnlrx([short], (3, 0, 3))
    assert "longer strokes" in fit.status


def test_a_part_that_never_slides_is_left_out(train: Record) -> None:
    small = noisy(move(seed=3, largest=1e-6, turns=40), 3)
    both = prepare([train, small], Options())
    assert len(both.parts) == 1
    assert any("begin every recording with a long stroke" in note for note in both.notes)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda r: replace(r, position=np.zeros(r.n_samples)), "doesn't move"),
        (lambda r: replace(r, effort=np.ones(r.n_samples)), "the force doesn't change"),
        (lambda r: replace(r, effort=-r.effort), "same sign"),
        (lambda r: r.slice(0, 700), "record"),
    ],
)
def test_recordings_of_no_use_are_refused(train: Record, spoil: object, message: str) -> None:
    structure = start_model(["viscous"], "axis", train.units)
    with pytest.raises(IdentificationError, match=message):
        METHODS["two-stage"].fit(structure, [spoil(train)], Options())  # type: ignore[operator]


def test_two_rates_are_refused(train: Record) -> None:
    half = replace(train, time=train.time[::2], position=train.position[::2], effort=train.effort[::2])
    with pytest.raises(IdentificationError, match="one rate"):
        fit_dnlrx([train, half])


def test_what_it_can_t_fit_is_refused(train: Record) -> None:
    fit = METHODS["two-stage"].fit
    with pytest.raises(IdentificationError, match="stribeck"):
        fit(start_model(["coulomb", "stribeck"], "axis", train.units), [train], Options())
    with pytest.raises(IdentificationError, match="hold"):
        fit(start_model(["coulomb", "viscous"], "axis", train.units), [train], Options(held=("coulomb.force",)))


def test_a_mass_that_slow_strokes_leave_at_its_bound_is_refused() -> None:
    # Two kilograms take hardly any force in strokes of half a second; in this recording noise leaves none of it.
    record = calibration_two_stage.recorded(61061, 0.5)
    with pytest.raises(IdentificationError, match="excite faster motion"):
        METHODS["two-stage"].fit(calibration_two_stage.structure(), [record], Options(decimation=25))
