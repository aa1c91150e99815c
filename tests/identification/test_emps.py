"""The EMPS axis (Janot, Gautier, Brunot 2019): the published parameters come back from the published recording."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from fric.identification import METHODS
from fric.identification.online import OnlineIdentifier
from fric.identification.result import Options
from fric.model import Model, Term, build_model, term
from fric.record import Record
from scipy.io import loadmat

pytestmark = pytest.mark.real_data

PUBLISHED = {"mass": 95.1089, "viscous.coefficient": 203.5034, "coulomb.force": 20.3935, "bias.force": -3.1648}


@pytest.fixture(scope="module")
def emps() -> Record:
    import os

    signals = loadmat(Path(os.environ["FRIC_DATA"]) / "emps" / "DATA_EMPS.mat")
    return Record(signals["t"].ravel(), signals["qm"].ravel(), (signals["gtau"] * signals["vir"]).ravel(), source="EMPS")


def structure(*more: Term) -> Model:
    terms = [term("coulomb", force=1.0), term("viscous", coefficient=1.0), term("bias", force=0.0), *more]
    return build_model("rigid", {"mass": 1.0}, terms)


@pytest.mark.parametrize("options", [Options(), Options(cutoff=100.0, decimation=10)])
def test_published_values_within_one_percent(emps: Record, options: Options) -> None:
    found = METHODS["inverse-dynamics"].fit(structure(), [emps], options)
    for name, expected in PUBLISHED.items():
        assert found.model.value(name) == pytest.approx(expected, rel=0.01), name
    assert found.train.relative_force_error_percent <= 4.1


def test_asymmetric_friction_explains_more(emps: Record) -> None:
    found = METHODS["inverse-dynamics"].fit(structure(term("asymmetry")), [emps], Options())
    assert found.train.relative_force_error_percent <= 3.1
    assert "asymmetry.force" not in found.fitted  # while sliding it can't be told from the bias
    assert found.model.value("asymmetry.coefficient") < -20.0


def test_output_error_follows_the_whole_recording_in_free_run(emps: Record) -> None:
    found = METHODS["output-error"].fit(structure(term("asymmetry")), [emps], Options())
    assert found.train.position_rmse < 0.0025
    assert found.train.position_rmse < 0.01 * np.ptp(emps.position)
    assert found.model.value("mass") == pytest.approx(95.1, rel=0.03)


def test_online_ends_near_offline(emps: Record) -> None:
    identifier = OnlineIdentifier(structure(), float("inf"))
    for t, q, u in zip(emps.time.tolist(), emps.position.tolist(), emps.effort.tolist(), strict=True):
        identifier.update(t, q, u)
    found = identifier.estimate()
    offline = METHODS["inverse-dynamics"].fit(structure(), [emps], Options()).model
    for name, got in zip(found.names, found.values, strict=True):
        assert got == pytest.approx(offline.value(name), rel=0.03, abs=offline.standard_errors[name]), name


@pytest.mark.parametrize("method", ["inverse-dynamics", "prediction-error", "output-error"])
def test_intervals_of_one_half_contain_the_estimate_of_the_other(emps: Record, method: str) -> None:
    """Halves made of contiguous sixths in every way; the structure has the asymmetric friction that the axis shows."""
    n = emps.n_samples
    blocks = [emps.slice(k * n // 6, (k + 1) * n // 6) for k in range(6)]
    options = Options(held=("asymmetry.force",))
    hits = []
    for ours in combinations(range(1, 6), 2):
        halves = ([0, *ours], [k for k in range(1, 6) if k not in ours])
        one, other = (
            METHODS[method].fit(structure(term("asymmetry")), [blocks[k] for k in half], options).model for half in halves
        )
        for name in ("mass", "coulomb.force", "viscous.coefficient", "asymmetry.coefficient", "bias.force"):
            off = abs(one.value(name) - other.value(name))
            hits += [off <= 1.96 * model.standard_errors[name] for model in (one, other)]
    assert np.mean(hits) >= 0.85
