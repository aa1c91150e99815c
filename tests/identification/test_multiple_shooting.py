"""Runs with starts of their own: on an axis that falls over, on several recordings, and what ties do to the starts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fric.errors import InputError
from fric.identification import METHODS
from fric.identification.equations import equations
from fric.identification.force_errors import force_errors
from fric.identification.free_parameters import FreeParameters
from fric.identification.multiple_shooting import Shooting, shooting
from fric.identification.result import Identification, Options
from fric.model import Model, build_model, term
from fric.record import Record

FIT = METHODS["output-error"].fit
UPRIGHT = {"inertia": 0.5, "gravity": 6.0, "coulomb.force": 0.15, "viscous.coefficient": 0.2}


def upright(seed: int, n: int = 4000, step: float = 1e-3, fine: int = 10) -> Record:
    """A pendulum that a PD law holds upright, by semi-implicit Euler steps; without the law it falls within half a second."""
    rng = np.random.default_rng(seed)
    rate = 2.0 * np.pi * np.geomspace(0.3, 4.0, 6)
    phase = rng.uniform(0.0, 2.0 * np.pi, 6)
    q, v, h = math.pi + 0.05, 0.0, step / fine
    before, positions, torques = q, [], []
    for k in range(n):
        seen = round(q / 1e-5) * 1e-5
        wish = math.pi + 0.08 * float(np.sum(np.sin(rate * k * step + phase)))
        u = 60.0 * (wish - seen) - 6.0 * (seen - before) / step
        before = seen
        positions.append(seen)
        torques.append(u)
        for _ in range(fine):
            free = v + h / UPRIGHT["inertia"] * (u - UPRIGHT["viscous.coefficient"] * v - UPRIGHT["gravity"] * math.sin(q))
            v = math.copysign(max(abs(free) - h / UPRIGHT["inertia"] * UPRIGHT["coulomb.force"], 0.0), free)
            q += h * v
    noise = 0.05 * rng.standard_normal(n)
    return Record(step * np.arange(n), np.array(positions), np.array(torques) + noise, effort_hold="following")


def pendulum() -> Model:
    terms = [term("coulomb", force=0.01), term("viscous", coefficient=0.01)]
    return build_model("pendulum", {"inertia": 1.0, "gravity": 1.0}, terms)


def test_an_axis_that_falls_over_without_its_controller_is_identified() -> None:
    record = upright(1)
    options = Options(held=("proportional", "derivative", "start"))
    found = FIT(pendulum(), [record], replace(options, horizon=0.5))
    for name, value in UPRIGHT.items():
        error = abs(found.model.value(name) - value)
        assert error < 0.05 * value, name
        assert error < 5.0 * found.model.standard_errors[name], name
    # From the measured force alone it falls, whichever parameters it has, and the fit says that it found nothing.
    whole = FIT(pendulum(), [record], options)
    assert any(said in whole.status for said in ("not to be relied on", "not converged", "does not describe"))


def axis() -> Model:
    terms = [term("coulomb", force=1.0), term("viscous", coefficient=1.0), term("bias", force=0.0), term("asymmetry")]
    return build_model("rigid", {"mass": 1.0}, terms)


@pytest.fixture(scope="module")
def three(mover: Callable[..., Any]) -> list[Record]:
    """6 s at 1 kHz, 11 s at 500 Hz, 4 s at 250 Hz of one axis."""
    records = []
    for duration, seed, every in ((6.0, 3, 1), (11.0, 5, 2), (4.0, 7, 4)):
        run = mover(duration=duration, seed=seed)
        # The mean force over the interval is what acted on average: a step of the controller is held for one sample only.
        held = run.force[: run.force.shape[0] // every * every].reshape(-1, every).mean(axis=1)
        noise = 0.2 * np.random.default_rng(seed).standard_normal(held.shape[0])
        records.append(Record(run.time[::every], np.round(run.position[::every], 6), held + noise, effort_hold="following"))
    return records


@pytest.mark.parametrize("horizon", [None, 0.5])
def test_recordings_of_different_length_and_rate_together(three: list[Record], horizon: float | None) -> None:
    true = {"mass": 2.0, "coulomb.force": 8.0, "viscous.coefficient": 15.0, "bias.force": 0.8, "asymmetry.coefficient": 2.0}
    together = FIT(axis(), three, Options(horizon=horizon))
    alone = [FIT(axis(), [record], Options(horizon=horizon)) for record in three]
    for name, value in true.items():
        error = together.model.standard_errors[name]
        assert abs(together.model.value(name) - value) < 4.0 * error, name
        if horizon is not None:  # over a whole recording the one that drifts most has the largest say
            assert error < 1.3 * min(found.model.standard_errors[name] for found in alone), name
    np.testing.assert_allclose(together.model.value("mass"), 2.0, rtol=0.03)


def prepared(record: Record, states: str, continuity: float = 0.0) -> tuple[Model, FreeParameters, Shooting, Any]:
    options = Options(horizon=0.5, start_states=states, continuity=continuity)
    model = axis().with_values(np.array([2.0, *axis().values[1:]]))
    for name, value in (("coulomb.force", 8.0), ("viscous.coefficient", 15.0), ("bias.force", 0.8)):
        model = model.with_value(name, value)
    model = model.with_value("asymmetry.coefficient", 2.0)
    found = equations([record], options)
    return model, FreeParameters.of(model, options), shooting(model, found, 0.5, states, continuity), found


def test_a_tie_and_continuity_hold_the_starts(slider: Any) -> None:
    record = slider.record(noise=1.0, resolution=1e-6, seed=4).slice(0, 6000)

    def jumps(states: str, continuity: float = 0.0) -> tuple[float, float]:
        model, free, runs, found = prepared(record, states, continuity)
        runs = runs.weighed(model, force_errors(model, free, found)).settled(model)
        _, ends = runs.errors(model)
        away = np.abs(runs.start - runs.measured)[:, 1]
        return float(np.max(away)), float(np.sqrt(np.mean((ends[:-1, 0] - runs.start[1:, 0]) ** 2)))

    measured, tied, free, joined = jumps("measured"), jumps("tied"), jumps("free"), jumps("free", 1e3)
    assert measured[0] == 0.0
    assert 0.0 < tied[0] < free[0]
    assert joined[1] < 0.01 * free[1]


def test_starts_that_were_recorded_wrong_are_found(slider: Any) -> None:
    record = slider.record(resolution=1e-7).slice(0, 6000)
    model, _, runs, _ = prepared(record, "free")
    # So that nothing but the motion itself speaks for a start.
    off = runs.start + np.array([2e-3, 0.05])
    found = replace(runs, start=off, measured=off, weight=np.full(2, 1e-6)).settled(model)
    moving = np.abs(runs.measured[:, 1]) > 0.05
    np.testing.assert_allclose(found.start[moving, 1], runs.measured[moving, 1], atol=0.01)
    np.testing.assert_allclose(found.start[:, 0], runs.measured[:, 0], atol=2e-4)


def test_force_errors_are_the_noise_that_never_acted(slider: Any) -> None:
    record = slider.record(noise=0.4, resolution=1e-7)
    model, free, _, found = prepared(record, "free")
    errors = force_errors(model.with_value("mass", 2.02), free, found)
    # Means over ten samples of white noise, and a wrong mass is no error of the axis.
    assert errors.error.std() == pytest.approx(0.4 / math.sqrt(10.0), rel=0.12)
    # White noise needs no long blocks: those of the axis's memory, 2 kg over 15 N s/m, in bins of 10 ms.
    assert 0.5 * 13.3 < errors.length < 1.5 * 13.3


def test_an_unknown_start_is_refused(slider: Any) -> None:
    with pytest.raises(InputError, match="tied"):
        FIT(axis(), [slider.record()], Options(start_states="anywhere"))


def several(found: Identification) -> str:
    return next(note for note in found.notes if "starts ended" in note)


def test_several_starts_end_where_one_does_and_say_so(slider: Any) -> None:
    record = slider.record(noise=0.1, resolution=1e-6).slice(0, 8000)
    one, four = (FIT(axis(), [record], Options(starts=n)) for n in (1, 4))
    assert several(four).startswith(("4 of 4", "3 of 4"))
    assert four.model.value("mass") == pytest.approx(one.model.value("mass"), rel=2e-3)
    assert not any("another minimum" in warning for warning in four.warnings)


def test_bounds_are_respected(slider: Any) -> None:
    record = slider.record(noise=0.1, resolution=1e-6).slice(0, 8000)
    for starts in (1, 3):
        found = FIT(axis(), [record], Options(bounds=(("viscous.coefficient", 15.5, 30.0),), starts=starts))
        assert found.model.value("viscous.coefficient") >= 15.5
