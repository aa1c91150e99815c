"""Whether intervals cover, and how the cover is counted."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.identification import METHODS
from fric.identification.calibration import AXES, Calibration, calibrate, recording
from fric.identification.result import Options
from fric.identification.uncertainty import KINDS, assess


def test_coverage_of_right_and_of_too_small_errors() -> None:
    rng = np.random.default_rng(1)
    estimates = 3.0 + 0.1 * rng.standard_normal((4000, 1))
    truth = np.array([3.0])
    right = Calibration(("p",), truth, estimates, np.full((4000, 1), 0.1))
    assert right.coverage(0.9)[0] == pytest.approx(0.9, abs=0.015)
    assert right.spread[0] == pytest.approx(1.0, rel=0.03)
    half = Calibration(("p",), truth, estimates, np.full((4000, 1), 0.05))
    assert half.coverage(0.9)[0] == pytest.approx(math.erf(0.5 * 1.645 / math.sqrt(2.0)), abs=0.02)
    missing = Calibration(("p",), truth, estimates, np.full((4000, 1), math.nan))
    assert missing.coverage(0.9)[0] == 0.0


def test_recordings_differ_by_seed_and_repeat() -> None:
    one, again, other = (recording(AXES["rigid"], seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.effort, again.effort)
    assert np.max(np.abs(one.position - other.position)) > 1e-3
    steps = one.position / AXES["rigid"].resolution
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-5)


@pytest.mark.parametrize("method", ["inverse-dynamics", "output-error", "prediction-error"])
def test_errors_over_standard_errors_have_the_size_they_should(method: str) -> None:
    found = calibrate(AXES["rigid"], method, range(500, 512), Options())
    score = (found.estimates - found.truth) / found.errors
    # Root mean square of 12 recordings' errors, four parameters: 1 if right. The plain sandwich of output error gave 4, inverse
    # dynamics with the rows around rests 2.
    assert 0.5 < float(np.sqrt(np.mean(score**2))) < 1.5


@pytest.mark.long
def test_force_noise_makes_bristles_neither_softer_nor_damped() -> None:
    found = calibrate(AXES["bristled"], "prediction-error", range(500, 504), Options())
    mean = dict(zip(found.names, np.mean(found.estimates, axis=0) / found.truth, strict=True))
    # Plain least squares ends 3 % below and 40 % above.
    assert mean["presliding.stiffness"] == pytest.approx(1.0, abs=0.012)
    assert mean["presliding.damping"] == pytest.approx(1.0, abs=0.08)
    assert mean["mass"] == pytest.approx(1.0, abs=0.004)


def test_inverse_dynamics_sees_bristles_through_its_filters() -> None:
    found = calibrate(AXES["bristled"], "inverse-dynamics", range(500, 510), Options())
    score = dict(zip(found.names, np.sqrt(np.mean(((found.estimates - found.truth) / found.errors) ** 2, axis=0)), strict=True))
    # With the filters' part left in, and at a cutoff of a tenth of the sampling rate, the damping was 90 % off: 10 here.
    assert all(each < 1.8 for each in score.values()), score
    assert found.estimates[:, found.names.index("presliding.damping")] == pytest.approx(400.0, rel=0.12)


@pytest.mark.parametrize("kind", [pytest.param(kind, marks=[pytest.mark.long] * (kind == "bootstrap")) for kind in KINDS])
def test_every_kind_gives_intervals_of_about_the_same_width(kind: str) -> None:
    axis = AXES["rigid"]
    records = [recording(axis, seed) for seed in (21, 22)]
    result = METHODS["prediction-error"].fit(axis.start, records, Options())
    found = assess(result, records, Options(), kind)
    assert found.names == ("mass", "coulomb.force", "viscous.coefficient", "bias.force")
    wide = np.array([1.645 * result.model.standard_errors[name] for name in found.names])
    np.testing.assert_allclose(0.5 * (found.upper - found.lower), wide, rtol=0.5)
    assert np.all(found.lower < found.estimate)
    assert np.all(found.estimate < found.upper)
    assert np.all(found.restarts < 0.1 * wide)
    assert np.all(np.isfinite(found.recordings))


def test_an_unknown_kind_or_method_is_refused() -> None:
    from dataclasses import replace

    from fric.errors import InputError

    axis = AXES["rigid"]
    records = [recording(axis, 21)]
    result = METHODS["inverse-dynamics"].fit(axis.start, records, Options())
    with pytest.raises(InputError, match="use one of sandwich, bootstrap, profile"):
        assess(result, records, Options(), "guess")
    with pytest.raises(InputError, match="not available for the method 'hilbert'"):
        assess(replace(result, method="hilbert"), records, Options(), "profile")
