"""The verdict on recordings at constant speeds, from means that lie on curves written out by hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from fric.diagnosis.by_means import concluded_by_means
from fric.diagnosis.ladder import Ladder
from fric.diagnosis.result import Diagnosis
from fric.effects import EFFECTS
from fric.identification.static_maps.load import MeanForce
from fric.model import build_model, term
from fric.record import Array, Record

ERROR = 0.02  # [N], of each mean
SPEEDS = np.geomspace(0.005, 0.3, 16)
NOMINAL = build_model(
    "rigid", {"mass": 1.0}, [term("coulomb", force=5.0), term("viscous", coefficient=2.0), term("bias", force=0.0)]
)
Curve = Callable[[float], float]


def plain(v: float) -> float:
    """Friction of 4 N and 8 N s/m, and a bias of 0.7 N."""
    return 4.0 * np.sign(v) + 8.0 * v + 0.7


def means(curve: Curve, seed: int = 0) -> tuple[list[MeanForce], list[MeanForce]]:
    """Every other speed to learn from, in both directions, each mean off by its error."""
    random = np.random.default_rng(seed)
    held: tuple[list[MeanForce], list[MeanForce]] = ([], [])
    for k, speed in enumerate(SPEEDS.tolist()):
        for v in (speed, -speed):
            force = curve(v) + ERROR * random.standard_normal()
            held[k % 2].append(MeanForce(f"at {v:.4g}", v, (force, ERROR), float("nan"), 5))
    return held


def recordings(held: list[MeanForce]) -> list[Record]:
    """Two seconds at each speed."""
    time = 0.01 * np.arange(201)
    return [Record(time, mean.velocity * time, np.full(201, mean.force[0]), source=mean.source) for mean in held]


def concluded(curve: Curve, seed: int = 0) -> tuple[Diagnosis, list[MeanForce], list[MeanForce]]:
    train, held = means(curve, seed)
    return concluded_by_means(Ladder(train, held, ("a note",)), recordings(held), NOMINAL, (), ("corrected",)), train, held


def columns(velocity: Array) -> Array:
    return np.stack([np.sign(velocity), velocity, np.ones_like(velocity)], axis=1)


def arrays(held: list[MeanForce]) -> tuple[Array, Array]:
    return np.array([mean.velocity for mean in held]), np.array([mean.force[0] for mean in held])


def dragged(v: float) -> float:
    return plain(v) + 30.0 * v * abs(v)


def test_where_the_means_lie_on_the_nominal_curve_nothing_is_missing() -> None:
    found, train, _ = concluded(plain)
    assert not found.mismatch
    assert found.findings == ()
    assert found.where is None
    assert found.by_means
    # By ordinary least squares, since all errors are alike.
    (velocity, force) = arrays(train)
    least = np.linalg.lstsq(columns(velocity), force, rcond=None)[0]
    refit = found.nominal.refit_parameters
    assert [refit[name] for name in ("coulomb.force", "viscous.coefficient", "bias.force")] == pytest.approx(least)
    assert found.nominal.parameter_error_percent["coulomb.force"] == pytest.approx(100.0 * (5.0 - least[0]) / least[0])
    assert {each.effect for each in found.rejected} == {each.id for each in EFFECTS.values()} - {"coulomb", "viscous", "bias"}
    assert {"corrected", "a note"} <= set(found.notes)


def test_the_term_that_is_missing_is_found_with_its_size() -> None:
    found, _, held = concluded(dragged)
    assert [each.effect for each in found.findings] == ["quadratic_drag"]
    drag = found.findings[0]
    value = drag.parameters["quadratic_drag.coefficient"]
    assert value.value == pytest.approx(30.0, abs=3.0 * (value.std or 0.0))
    assert 0.0 < (value.std or 0.0) < 5.0
    assert drag.share > 0.95
    assert drag.confidence > 0.9
    assert found.model.value("quadratic_drag.coefficient") == value.value
    assert "quadratic_drag" not in {each.effect for each in found.rejected}
    assert [each.term for each in found.grown] == ["", "quadratic_drag"]
    assert found.grown[1].left < 0.05
    assert len(held) == 16


def test_the_errors_are_those_of_the_means_held_back_over_their_spread() -> None:
    found, train, held = concluded(dragged)
    (velocity, force), (there, measured) = arrays(train), arrays(held)
    spread = np.sum((measured - np.mean(measured)) ** 2)
    given = columns(there) @ np.array([5.0, 2.0, 0.0])
    again = columns(there) @ np.linalg.lstsq(columns(velocity), force, rcond=None)[0]
    assert found.validation.noe_nominal == pytest.approx(100.0 * np.sum((measured - given) ** 2) / spread)
    assert found.validation.noe_refit == pytest.approx(100.0 * np.sum((measured - again) ** 2) / spread)
    assert found.validation.noise_floor == pytest.approx(100.0 * 16 * ERROR**2 / spread)
    assert found.validation.noe_augmented < 3.0 * found.validation.noise_floor
    assert (found.findings[0].noe_before, found.findings[0].noe_after) == (
        found.validation.noe_refit,
        found.validation.noe_augmented,
    )


def test_a_drag_sits_at_the_fast_runs_and_a_surplus_at_the_slow_ones() -> None:
    fast = concluded(dragged)[0].findings[0].where
    slow = concluded(lambda v: plain(v) + np.sign(v) * 1.5 * np.exp(-((v / 0.02) ** 2)))[0].findings[0].where
    for where in (fast, slow):
        assert where.quantity == "speed"
        assert where.share >= 0.8
        assert where.regime.endswith("both directions")
    # The drag's energy goes with the fourth power of the speed: the fastest run held back, at 0.3 m/s, holds it.
    assert fast.range == pytest.approx((float(SPEEDS[-1]), float(SPEEDS[-1])))
    assert fast.time_share == pytest.approx(2.0 / 16.0)
    assert [bool(spans) for spans in fast.time] == [False] * 14 + [True, True]
    assert fast.time[-1] == ((0.0, 2.0),)
    assert slow.range[0] == pytest.approx(float(SPEEDS[1]))
    assert slow.range[1] < 0.025


def test_a_curve_of_no_known_form_is_unknown_and_the_others_are_less_sure() -> None:
    found = concluded(lambda v: plain(v) + np.sign(v) * 0.6 * np.sin(2.0 * np.pi * np.log(abs(v)) / 1.1))[0]
    assert found.findings[0].effect == "unknown"
    for each in found.findings[1:]:
        assert each.confidence <= 1.0 - found.findings[0].confidence + 1e-9
    assert found.unexplained.share == found.findings[0].share > 0.5
    assert found.unexplained.where is not None


def test_each_recording_held_back_is_predicted_by_the_force_at_its_speed() -> None:
    found, _, held = concluded(dragged)
    assert [each.source for each in found.prediction] == [mean.source for mean in held]
    for each, mean in zip(found.prediction, held, strict=True):
        v = mean.velocity
        model = {p.name: p.value for p in found.model.parameters()}
        force = model["coulomb.force"] * np.sign(v) + model["viscous.coefficient"] * v + model["bias.force"]
        assert each.force_augmented == pytest.approx(force + model["quadratic_drag.coefficient"] * v * abs(v))
        assert each.force_nominal == pytest.approx(5.0 * np.sign(v) + 2.0 * v)
        assert each.force_measured == pytest.approx(mean.force[0])
        assert each.time.shape == (201,)
