"""Spikes of position and effort: found, named and filled; what a machine really does is left alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from fric.identification import METHODS
from fric.identification.result import Options
from fric.identification.screen import screened
from fric.identification.start import start_model
from fric.record import Record, Units
from fric.signals.conditioning import conditioned
from fric.signals.spikes import spikes_of, without_spikes
from numpy.typing import NDArray

Array = NDArray[np.float64]
Turn = Callable[..., Record]


def with_spikes(signal: Array, at: list[int], height: float, length: int = 1) -> Array:
    spoilt = signal.copy()
    for k in at:
        spoilt[k : k + length] += height
    return spoilt


@pytest.mark.parametrize("length", [1, 2, 3])
@pytest.mark.parametrize("height", [0.01, 0.5, -40.0])
def test_spikes_of_the_position(turn: Turn, height: float, length: int) -> None:
    true = turn()
    at = [700, 3301, 3400, 9000]
    found = without_spikes(replace(true, position=with_spikes(true.position, at, height, length)))
    assert np.max(np.abs(found.position - true.position)) < 2e-4
    assert "spikes (4) of the position at 0.700 s" in found.notes[-1]
    assert f"{4 * length} samples filled" in found.notes[-1]


@pytest.mark.parametrize("length", [1, 2, 3])
@pytest.mark.parametrize("height", [4.0, -30.0])
def test_spikes_of_the_effort(turn: Turn, height: float, length: int) -> None:
    true = turn()
    at = [700, 3301, 9000]
    found = without_spikes(replace(true, effort=with_spikes(true.effort, at, height, length)))
    assert np.max(np.abs(found.effort - true.effort)) < 0.1
    assert "spikes (3) of the effort at 0.700 s" in found.notes[-1]


def test_a_sample_that_was_lost_and_filled_with_zero(turn: Turn) -> None:
    true = turn(force_noise=0.002)
    away = int(np.argmax(np.abs(true.position)))
    position = true.position.copy()
    position[away] = 0.0
    found = without_spikes(replace(true, position=position))
    assert np.max(np.abs(found.position - true.position)) < 1e-3


def _identified(record: Record) -> dict[str, tuple[float, float]]:
    model = start_model(("coulomb", "viscous", "bias"), record.joint, record.units)
    found = METHODS["inverse-dynamics"].fit(model, [record], Options()).model
    return {name: (found.value(name), found.standard_errors[name]) for name in ("mass", "coulomb.force", "viscous.coefficient")}


def test_the_fit_of_a_recording_with_spikes(turn: Turn) -> None:
    true = replace(turn(), velocity=None)
    position = with_spikes(true.position, [1200, 4400, 8000], 1.5)
    record = screened(replace(true, position=position, effort=with_spikes(true.effort, [2500, 6100], 50.0)))
    found = _identified(record)
    for name, value in (("mass", 0.02), ("coulomb.force", 0.4), ("viscous.coefficient", 0.06)):
        assert abs(found[name][0] - value) < max(0.01 * value, 3.0 * found[name][1])


H = 1e-3
N = 4000


def body(force: Array, h: float, wall: float = np.inf, surplus: float = 0.0) -> Array:
    """Positions of 2 kg with dry friction of 5 N, more at low speed, between walls."""
    q, v, fine, positions = 0.0, 0.0, 10, []
    for u in force:
        positions.append(q)
        for _ in range(fine):
            push = v + h / fine / 2.0 * (u - 10.0 * v)
            level = 5.0 + surplus * np.exp(-((v / 0.01) ** 2))
            v = float(np.sign(push)) * max(abs(push) - h / fine / 2.0 * level, 0.0)
            q += h / fine * v
            if abs(q) > wall:
                q, v = float(np.sign(q)) * wall, -0.6 * v
    return np.array(positions)


def honest_forces(rate: float) -> dict[str, Array]:
    random = np.random.default_rng(5)
    time = np.arange(N) / rate
    sine = 15.0 * np.sin(2.0 * np.pi * time * rate / 400.0)
    return {
        "every sample": 12.0 * random.choice([-1.0, 1.0], N),
        "prbs": 12.0 * np.repeat(random.choice([-1.0, 1.0], N // 20), 20),
        "sine": sine,
        "relay": 10.0 * np.sign(np.sin(2.0 * np.pi * time * rate / 150.0)),
        "heavy tails": sine + 2.0 * random.laplace(size=N),
        "white": 15.0 * random.standard_normal(N),
        "blows": sine + np.where(random.random(N) < 0.004, 60.0, 0.0),
        "triangle": 12.0 * (2.0 * np.abs((time * rate / 200.0) % 2.0 - 1.0) - 1.0),
    }


@pytest.mark.parametrize("kind", sorted(honest_forces(1000.0)))
@pytest.mark.parametrize("rate", [1000.0, 50.0])
def test_what_a_machine_does_is_no_spike(kind: str, rate: float) -> None:
    force = honest_forces(rate)[kind]
    random = np.random.default_rng(6)
    for wall, surplus in ((np.inf, 0.0), (0.01, 0.0), (np.inf, 3.0)):
        motion = body(force, 1.0 / rate, wall, surplus)
        for position in (
            np.round(motion / 1e-6) * 1e-6,
            np.round(motion / 2e-5) * 2e-5,
            motion + 1e-5 * random.standard_normal(N),
        ):
            record = Record(np.arange(N) / rate, position, force + 0.1 * random.standard_normal(N), units=Units("m", "N"))
            assert conditioned(record).notes == ()


@pytest.mark.parametrize("seed", range(5))
def test_noise_has_no_spikes(seed: int) -> None:
    random = np.random.default_rng(seed)
    for noise in (random.standard_normal(20000), random.laplace(size=20000), np.round(random.standard_normal(20000))):
        record = Record(H * np.arange(20000), noise, noise[::-1].copy())
        assert spikes_of(record, "position") == []
        assert spikes_of(record, "effort") == []


@pytest.mark.parametrize("scale", [1.0, 1.0 / 32768.0])
def test_an_effort_of_16_bits_that_wraps(turn: Turn, scale: float) -> None:
    true = turn(force_noise=0.002)
    counts = np.round(true.effort / np.max(np.abs(true.effort)) * 45000.0)
    wrapped = (counts + 32768.0) % 65536.0 - 32768.0
    found = conditioned(replace(true, effort=scale * wrapped))
    assert np.max(np.abs(found.effort - scale * counts)) < 1e-9
    assert "taken as a number that wraps" in found.notes[-1]
