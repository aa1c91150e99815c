"""A term more never makes a fit worse; on published recordings with --long and FRIC_DATA."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from fric.bagio.importing import import_recording
from fric.identification import METHODS
from fric.identification.free_parameters import FreeParameters
from fric.identification.nested import searched_terms
from fric.identification.result import Options
from fric.identification.screen import screened
from fric.identification.start import start_model
from fric.model_file import read_model
from fric.record import Record, Units
from scipy.io import loadmat

WORSE = 1e-3  # relative growth of the training error that is allowed
PUBLISHED = Path(__file__).parents[2] / "config" / "published"
TERMS = ("coulomb", "viscous", "bias", "asymmetry", "stribeck", "quadratic_drag", "actuator_lag")


def driven(lag: float, seed: int = 1, noise: float = 0.3) -> Record:
    """A slide of 2 kg under a multisine command that acts ``lag`` [s] late, stepped after Moreau."""
    random = np.random.default_rng(seed)
    h, n, fine = 1e-3, 6000, 10
    time = h * np.arange(n)
    frequency = np.array([0.4, 1.1, 2.7, 6.1])
    command = np.sin(2.0 * np.pi * np.outer(time, frequency) + random.uniform(0.0, 6.28, 4)) @ np.array([14.0, 12.0, 10.0, 8.0])
    q = v = 0.0
    force = command[0]
    positions = []
    for u in command:
        positions.append(q)
        for _ in range(fine):
            force = u if lag == 0.0 else force + (u - force) * (1.0 - np.exp(-h / fine / lag))
            free = v + h / fine / 2.0 * (force - 12.0 * v)
            v = float(np.sign(free)) * max(abs(free) - h / fine / 2.0 * 5.0, 0.0)
            q += h / fine * v
    position = np.array(positions) + 1e-6 * random.standard_normal(n)
    measured = command + noise * random.standard_normal(n)
    return Record(time, position, measured, units=Units("m", "N"), effort_hold="following")


def error(method: str, terms: Sequence[str], records: Sequence[Record], mass: float | None = None) -> float:
    """Of the training [%], or in a free run [x]; ``mass`` is held where it is given."""
    record = records[0]
    model = start_model(terms, record.joint, record.units)
    model = model if mass is None else model.with_value("mass", mass)
    options = Options(held=() if mass is None else ("mass",))
    found = METHODS[method].fit(model, list(records), options).train
    return found.relative_force_error_percent if method == "inverse-dynamics" else found.position_rmse


def growth(method: str, records: Sequence[Record], terms: Sequence[str], mass: float | None = None) -> dict[str, float]:
    """Relative growth of the training error with each of ``terms`` from the fourth on, added to those before it."""
    found, before = {}, error(method, terms[:3], records, mass)
    for n in range(4, len(terms) + 1):
        after = error(method, terms[:n], records, mass)
        found["+".join(terms[:n])] = after / before - 1.0
        before = after
    return found


@pytest.mark.parametrize("lag", [0.0, 0.0003, 0.004])
def test_a_lag_never_makes_inverse_dynamics_worse(lag: float) -> None:
    record = driven(lag)
    base = ("coulomb", "viscous", "bias")
    without, with_lag = (error("inverse-dynamics", terms, [record]) for terms in (base, (*base, "actuator_lag")))
    assert with_lag <= without * (1.0 + WORSE)
    if lag > 0.001:
        model = start_model((*base, "actuator_lag"), record.joint, record.units)
        found = METHODS["inverse-dynamics"].fit(model, [record], Options()).model
        assert found.value("actuator_lag.time") == pytest.approx(lag, rel=0.03)


@pytest.mark.long
@pytest.mark.parametrize("order", [TERMS, ("coulomb", "viscous", "bias", "stribeck", "actuator_lag", "quadratic_drag")])
def test_terms_that_are_not_there_leave_the_error_as_it_is(order: Sequence[str]) -> None:
    assert max(growth("inverse-dynamics", [driven(0.0, seed=2)], order).values()) <= WORSE


def test_output_error_starts_from_the_smaller_structure_too() -> None:
    record = driven(0.0, seed=3)
    assert max(growth("output-error", [record], ("coulomb", "viscous", "bias", "stribeck")).values()) <= WORSE


def test_a_term_that_is_held_is_meant_to_act() -> None:
    model = start_model(("coulomb", "viscous", "stribeck", "actuator_lag"), "axis", Units("m", "N"))
    assert [each.prefix for each in searched_terms(model, FreeParameters.of(model, Options()))] == ["actuator_lag", "stribeck"]
    model = model.with_value("stribeck.force", 2.0)
    free = FreeParameters.of(model, Options(held=("stribeck.force", "actuator_lag.time")))
    assert searched_terms(model, free) == []


def _published(folder: Path, name: str) -> list[Record]:
    if name == "emps":
        signals = loadmat(folder / "emps" / "DATA_EMPS.mat")
        effort = (signals["gtau"] * signals["vir"]).ravel()
        return [Record(signals["t"].ravel(), signals["qm"].ravel(), effort, source="EMPS")]
    if name == "torso":
        return [screened(import_recording(folder / "tiago_torso" / "tiago_effort.csv", PUBLISHED / "torso.yaml", repair=True))]
    files = sorted((folder / "screw_drives" / name / "steady_state" / "0.096kg").glob("*.csv"))
    return [import_recording(file, PUBLISHED / "screw.yaml") for file in files]


@pytest.mark.long
@pytest.mark.real_data
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", ["emps", "torso", "driveNo1", "driveNo2"])
@pytest.mark.parametrize("seed", [1, 2])
def test_published_recordings(data_folder: Path, name: str, seed: int) -> None:
    records = _published(data_folder, name)
    others = np.random.default_rng(seed).permutation(TERMS[3:]).tolist()
    # At constant speed a screw shows no inertia.
    mass = read_model(PUBLISHED / "screw_nominal.yaml").value("mass") if name.startswith("drive") else None
    found = growth("inverse-dynamics", records, [*TERMS[:3], *others], mass)
    assert max(found.values()) <= WORSE, found
