"""Diagnoses of published recordings from nominal models that leave physics out, judged on parts that nothing is learnt from."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from fric_nodes.diagnosis import Diagnosis, diagnose
from fric_nodes.model import Model, build_model, term
from fric_nodes.record import Record, Units
from scipy.io import loadmat

pytestmark = pytest.mark.real_data


def symmetric(mass: float, level: float, viscous: float, bias: float, units: Units | None = None) -> Model:
    """Coulomb friction, viscous friction and an offset: what every axis is assumed to have at first."""
    terms = [term("coulomb", force=level), term("viscous", coefficient=viscous), term("bias", force=bias)]
    return build_model("rigid", {"mass": mass}, terms, units=units or Units())


def blocks(record: Record, n_blocks: int) -> tuple[list[Record], list[Record]]:
    """Contiguous blocks of equal length, every other one held back."""
    cuts = [k * record.n_samples // n_blocks for k in range(n_blocks + 1)]
    parts = [record.slice(first, last) for first, last in pairwise(cuts)]
    return parts[::2], parts[1::2]


def error(found: Diagnosis, which: str) -> float:
    """RMS of the force error on what was held back [F]; ``which``: nominal, refit or augmented."""
    off = [getattr(each, f"force_{which}") - each.force_measured for each in found.prediction]
    return float(np.sqrt(np.mean(np.concatenate(off) ** 2)))


def named(found: Diagnosis) -> list[str]:
    return [finding.effect for finding in found.findings if finding.effect != "unknown"]


@pytest.fixture(scope="module")
def emps() -> Diagnosis:
    import os

    signals = loadmat(Path(os.environ["FRIC_DATA"]) / "emps" / "DATA_EMPS.mat")
    effort = (signals["gtau"] * signals["vir"]).ravel()
    record = Record(signals["t"].ravel(), signals["qm"].ravel(), effort, source="EMPS")
    return diagnose(*blocks(record, 6), symmetric(95.0, 20.0, 200.0, -3.0))


def test_the_axis_has_direction_dependent_friction_that_survives_on_blocks_held_back(emps: Diagnosis) -> None:
    assert emps.mismatch
    assert named(emps)[0] == "asymmetry"
    found = next(each for each in emps.findings if each.effect == "asymmetry")
    # As inverse dynamics finds it, too: less viscous friction forward than backward.
    assert -50.0 < found.parameters["asymmetry.coefficient"].value < -25.0
    assert error(emps, "augmented") < 0.75 * error(emps, "refit")
