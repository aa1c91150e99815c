"""A status that is true: what is not determined is refused, and a model that does not describe the recording is said not to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric.identification import METHODS
from fric.identification.free_parameters import FreeParameters
from fric.identification.misfit import gap
from fric.identification.result import Identification, IdentificationError, Options
from fric.identification.start import start_model
from fric.identification.verdict import warnings_of
from fric.model import build_model, term
from fric.record import Record, Units
from numpy.typing import NDArray

Array = NDArray[np.float64]
H = 2e-3


def motion(seed: int = 1, n: int = 6000, speed: float = 1.0) -> tuple[Array, Array, Array, Array]:
    """Time, position, velocity and acceleration of a multisine."""
    random = np.random.default_rng(seed)
    time = H * np.arange(n)
    frequency = np.array([0.3, 0.9, 2.1, 4.3]) * random.uniform(0.9, 1.1, 4)
    amplitude, omega = speed * 0.05 / frequency, 2.0 * np.pi * frequency
    angle = np.outer(time, omega) + random.uniform(0.0, 6.28, 4)
    return (
        time,
        np.sin(angle) @ amplitude,
        np.cos(angle) @ (amplitude * omega),
        -np.sin(angle) @ (amplitude * omega**2),
    )


def recorded(seed: int = 1, coulomb: float = 5.0, noise: float = 0.2, extra: float = 0.0, speed: float = 1.0) -> Record:
    """2 kg on Coulomb and viscous friction; ``extra`` [N/m] times the position besides."""
    time, q, v, a = motion(seed, speed=speed)
    force = 2.0 * a + coulomb * np.sign(v) + 8.0 * v + extra * q
    force += noise * np.random.default_rng(seed).standard_normal(time.size)
    return Record(time, q, force, units=Units("m", "N"))


def fitted(record: Record, *terms: str) -> Identification:
    model = start_model(terms or ("coulomb", "viscous", "bias"), record.joint, record.units)
    return METHODS["inverse-dynamics"].fit(model, [record], Options())


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_force_that_does_not_move_the_joint_is_refused(seed: int) -> None:
    record = recorded(seed)
    noise = np.convolve(np.random.default_rng(seed).standard_normal(record.n_samples), np.ones(50) / 7.0, mode="same")
    for other in (noise, recorded(seed + 40).effort, np.zeros(record.n_samples) + 1e-3 * noise):
        with pytest.raises(IdentificationError, match=r"^[^\n]*; check [^\n]*$|; give its value and hold it"):
            fitted(replace(record, effort=other))


def test_an_inertia_that_does_not_show_is_refused_and_can_be_held() -> None:
    time, q, v, _ = motion(speed=0.2)
    force = 5.0 * np.sign(v) + 8.0 * v + 0.1 * np.random.default_rng(1).standard_normal(time.size)
    _, _, _, a = motion(speed=0.2)
    record = Record(time, q, force - 0.5 * a, units=Units("m", "N"))
    with pytest.raises(IdentificationError, match=r"mass is not determined: .* --hold mass"):
        fitted(record)
    model = start_model(("coulomb", "viscous", "bias"), record.joint, record.units).with_value("mass", 0.001)
    found = METHODS["inverse-dynamics"].fit(model, [record], Options(held=("mass",)))
    assert found.model.value("mass") == 0.001


def test_a_wrong_sign_is_named() -> None:
    record = recorded()
    with pytest.raises(IdentificationError, match="the sign of the effort or of the position"):
        fitted(replace(record, effort=-record.effort))


def test_what_leaves_more_than_half_of_the_force_is_said() -> None:
    record = recorded()
    other = 25.0 * np.sin(2.0 * np.pi * 1.37 * record.time)
    found = fitted(replace(record, effort=record.effort + other))
    assert found.train.relative_force_error_percent > 50.0
    assert "does not describe the recording: it leaves" in found.status
    assert "another joint's motion" in found.status


def test_a_spring_that_the_model_does_not_have_is_named() -> None:
    with pytest.raises(IdentificationError, match="gravity or a spring"):
        fitted(recorded(extra=600.0))


def test_a_constant_that_is_left_over_is_named() -> None:
    record = recorded()
    with pytest.raises(IdentificationError, match="add the term bias"):
        fitted(replace(record, effort=record.effort + 400.0), "coulomb", "viscous")


def test_what_has_no_standard_error_is_not_called_determined() -> None:
    model = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=5.0)])
    free = FreeParameters.of(model, Options())
    warnings, status = warnings_of(model, free, np.diag([np.nan, 0.01]))
    assert "mass is not determined" in warnings[0]
    assert "not to be relied on: mass" in status
    _, status = warnings_of(model, free, np.diag([1e-4, 0.01]))
    assert "better than 20 %" in status


def test_a_plant_without_a_spring_is_fitted_without_one() -> None:
    plant = {"inertia": 0.1, "proportional": 0.0, "derivative": 0.0, "gravity": 2.0}
    model = build_model("pendulum", plant, [term("viscous", coefficient=0.0)])
    assert FreeParameters.of(model, Options()).names == ("inertia", "gravity", "viscous.coefficient")
    assert "proportional" in FreeParameters.of(model, Options(freed=("proportional",))).names


def test_a_gap_between_training_and_validation_is_said_and_chance_is_not() -> None:
    train = recorded(1)
    found = fitted(train)
    for seed in range(2, 12):
        assert gap(found.model, [train], [recorded(seed)], Options()) == ""
    assert "validation error" in gap(found.model, [train], [recorded(2, coulomb=7.0)], Options())
