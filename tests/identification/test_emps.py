"""The EMPS axis (Janot, Gautier, Brunot 2019): the published parameters come back from the published recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fric_nodes.identification import METHODS
from fric_nodes.identification.online import OnlineIdentifier
from fric_nodes.identification.result import Options
from fric_nodes.model import Model, Term, build_model, term
from fric_nodes.record import Record
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
        assert got == pytest.approx(offline.value(name), rel=0.03), name
