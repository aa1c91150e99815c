"""What a model lacks, held against a force that is known because it was added."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from fric_nodes.diagnosis.track import Track
from fric_nodes.diagnosis.twin import twins
from fric_nodes.model import Model, build_model, term
from fric_nodes.record import Record
from scipy.integrate import solve_ivp

MASS, VISCOUS, LACKING = 2.0, 300.0, 5.0
H = 0.001


@cache
def recorded() -> Record:
    """An axis in thick oil against a constant force, by an integrator of scipy."""
    time = np.arange(8000) * H
    effort = 40.0 * np.sin(2.0 * np.pi * 0.7 * time) + 25.0 * np.sin(2.0 * np.pi * 3.1 * time)

    def motion(t: float, state: np.ndarray) -> list[float]:
        # The command is held from sample to sample.
        u = effort[min(int(t / H + 1e-9), effort.shape[0] - 1)]
        return [state[1], (u - VISCOUS * state[1] - LACKING) / MASS]

    found = solve_ivp(motion, (0.0, time[-1]), [0.0, 0.0], t_eval=time, max_step=H, rtol=1e-9, atol=1e-12)
    return Record(time, found.y[0], effort, effort_hold="following")


def model(viscous: float = VISCOUS, **extra: float) -> Model:
    terms = [term("viscous", coefficient=viscous)]
    return build_model("rigid", {"mass": MASS}, [*terms, term("bias", **extra)] if extra else terms)


@pytest.mark.parametrize("bandwidth", [45.0, 140.0, 400.0])
def test_a_constant_force_is_lacking_in_full_however_much_friction_the_model_has(bandwidth: float) -> None:
    track = Track.of([recorded()], bandwidth, model())
    lacking = track.residual(model())
    lacking = lacking[lacking.shape[0] // 2 :]  # so much friction makes the observer slow to settle
    # Positive is what the model would have to be given besides.
    assert float(np.mean(lacking)) == pytest.approx(-LACKING, rel=2e-3)
    assert float(np.std(lacking)) < 0.02 * LACKING


def test_nothing_is_lacking_with_the_force_there() -> None:
    track = Track.of([recorded()], 140.0, model())
    assert float(np.max(np.abs(track.residual(model(force=LACKING))))) < 0.02 * LACKING


def test_friction_that_is_too_much_does_not_hide_what_is_lacking() -> None:
    """With its position set at each sample a model would be given the motion that its friction costs."""
    track = Track.of([recorded()], 400.0, model())
    v = np.gradient(track.runs[0].position, H)
    slow = track.seen([(2.0 * VISCOUS - VISCOUS) * v - LACKING])
    lacking = track.residual(model(2.0 * VISCOUS))
    assert float(np.std(lacking)) == pytest.approx(float(np.std(slow)), rel=0.05)


def test_a_fit_finds_mass_and_friction_from_far_away() -> None:
    track = Track.of([recorded()], 45.0, model())
    start = build_model("rigid", {"mass": 3.5}, [term("viscous", coefficient=40.0), term("bias", force=0.0)])
    found = {p.name: p.value for p in track.fit(start, start.names, 20).model.parameters()}
    assert found["mass"] == pytest.approx(MASS, rel=0.02)
    assert found["viscous.coefficient"] == pytest.approx(VISCOUS, rel=0.01)
    assert found["bias.force"] == pytest.approx(LACKING, rel=0.01)


def test_a_twin_lacks_nothing_but_noise() -> None:
    complete = model(force=LACKING)
    track = Track.of([recorded()], 140.0, complete)
    for twin in twins(track, complete, 2):
        assert float(np.std(track.residual(complete, twin))) < 0.02 * LACKING
