"""What depends on the amplitude, backlash from the backbone, and modes on wavelet ridges, held against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from fric.identification.methods.hilbert import hilbert, hilbert_envelope
from fric.identification.methods.wavelet_ridge import wavelet_envelope
from fric.identification.oscillation.backlash import backbone, free_play
from fric.identification.oscillation.envelope import cycle_mean, natural_of, reading
from fric.identification.oscillation.morlet import modes, morlet
from fric.identification.oscillation.recording import find_oscillation
from fric.record import Record
from fric.verification.free_oscillation_reference import Pendulum, recorded, swing
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]


def _record(time: Array, position: Array, noise: float, seed: int = 0) -> Record:
    return Record(time, position + noise * np.random.default_rng(seed).standard_normal(time.shape[0]), np.zeros_like(time))


def test_a_wavelet_reads_the_amplitude_of_a_cosine() -> None:
    step, w = 1e-3, 2.0 * np.pi * 5.0
    time = step * np.arange(4001)
    row = morlet(1.7 * np.cos(w * time), step, (w,), 6.0)[0]
    assert np.max(np.abs(np.abs(row) - 1.7)) < 1e-3
    # Off its centre by 10 % it falls as the Gaussian does.
    off = morlet(1.7 * np.cos(w * time), step, (w / 1.1,), 6.0)[0]
    assert np.mean(np.abs(off)) == pytest.approx(1.7 * np.exp(-0.5 * 0.6**2), rel=1e-3)


@pytest.mark.parametrize("envelope", [hilbert_envelope, wavelet_envelope])
def test_averaging_holds_for_many_cycles(envelope: object) -> None:
    """With small friction the averaged equations are exact, so the uncorrected reading must be right to their order."""
    pendulum = Pendulum(20.0, 0.002, 0.001, 0.002, 0.001)
    motion = swing(pendulum, 1.0)
    found = find_oscillation(recorded(motion, 0, noise=0.0, step=0.0))
    last = int(found.turns[-10])
    part = slice(int(found.turns[0]), last + 1, 4)
    result = natural_of(reading(envelope(found.time[part], found.position[part], found.half_period)))  # type: ignore[operator]
    assert result.frequency == pytest.approx(20.0, rel=1e-3)
    assert result.damping == pytest.approx(0.002, rel=0.03)
    assert result.offset == pytest.approx(0.002, rel=0.03)
    assert result.offset_difference == pytest.approx(0.001, rel=0.15)
    assert result.damping_difference == pytest.approx(0.001, rel=0.15)


def test_equivalent_damping_grows_as_the_amplitude_shrinks() -> None:
    pendulum = Pendulum(20.0, 0.01, 0.0, 0.01, 0.0)
    curves = hilbert(find_oscillation(recorded(swing(pendulum, 1.0), 0))).curves
    expected = 0.01 + 2.0 / np.pi * 0.01 / curves.amplitude
    assert curves.damping == pytest.approx(expected, rel=0.1)
    assert curves.frequency[curves.amplitude > 0.1] == pytest.approx(20.0, rel=0.003)
    assert np.max(np.abs(curves.centre)) < 0.01


def test_the_mean_over_a_cycle_takes_the_cycle_away() -> None:
    time = 1e-3 * np.arange(2001)
    x = 0.3 + np.cos(2.0 * np.pi * 5.0 * time)
    assert cycle_mean(x, 200) == pytest.approx(0.3, abs=0.01)


# ---- backlash --------------------------------------------------------------------------------------------------------


def _with_play(half: float, w: float, damping: float, start: float, duration: float) -> Record:
    """A body between two springs with a gap of ``2 half``, led through each edge of the gap as an event."""
    step = 1e-3
    time = np.arange(0.0, duration, step)
    position = np.empty_like(time)
    t, y = 0.0, [start, 0.0]
    while t < time[-1]:
        side = 0 if abs(y[0]) < half or (abs(y[0]) == half and y[0] * y[1] < 0) else (1 if y[0] > 0 else -1)

        def right_side(_: float, s: Array, side: int = side) -> list[float]:
            pull = w**2 * (s[0] - side * half) if side else 0.0
            return [s[1], -pull - 2.0 * damping * w * s[1]]

        def edge(_: float, s: Array, side: int = side) -> float:
            return (abs(s[0]) - half) if side == 0 else side * s[0] - half

        edge.terminal = True  # type: ignore[attr-defined]
        edge.direction = 1.0 if side == 0 else -1.0  # type: ignore[attr-defined]
        answer = solve_ivp(right_side, (t, time[-1] + step), y, rtol=1e-10, atol=1e-12, events=edge, dense_output=True)
        here = (time >= t) & (time <= answer.t[-1])
        position[here] = answer.sol(time[here])[0]
        t, y = float(answer.t[-1]), answer.y[:, -1].tolist()
        if answer.status == 1:
            y[0] = float(np.sign(y[0])) * half
    return _record(time, position, 2e-4)


@pytest.mark.parametrize("half", [0.02, 0.1])
def test_free_play_bends_the_backbone(half: float) -> None:
    found = find_oscillation(_with_play(half, 30.0, 0.01, 1.0, 5.0))
    curve = backbone(found)
    assert curve.frequency[0] > curve.frequency[-1]
    result = free_play(curve)
    assert result.play == pytest.approx(2.0 * half, rel=0.03)
    assert result.frequency == pytest.approx(30.0, rel=0.003)
    assert "free play" in result.status
    assert result.standard_error < 0.03 * result.play


def test_without_play_none_is_found() -> None:
    result = free_play(backbone(find_oscillation(recorded(swing(Pendulum(30.0, 0.01, 0.0, 0.002, 0.0), 1.0), 0))))
    assert "no free play" in result.status
    assert abs(result.play) < 0.005


# ---- modes -----------------------------------------------------------------------------------------------------------


def test_three_modes_of_one_decay() -> None:
    truth = [(40.0, 0.010, 1.0), (62.0, 0.006, 0.6), (150.0, 0.004, 0.3)]
    step = 1e-3
    time = step * np.arange(6000)
    x = sum(a * np.exp(-z * w * time) * np.cos(w * np.sqrt(1.0 - z**2) * time + k) for k, (w, z, a) in enumerate(truth))
    x = np.asarray(x) + 1e-3 * np.random.default_rng(0).standard_normal(6000)
    found = modes(x, step, 3)
    assert len(found) == 3
    for mode, (w, z, a) in zip(found, truth, strict=True):
        assert mode.frequency == pytest.approx(w, rel=1e-3)
        assert mode.damping == pytest.approx(z, rel=0.02)
        assert mode.amplitude == pytest.approx(a, rel=0.03)
        assert 0.0 < mode.damping_error < 0.05 * mode.damping


def test_no_more_modes_than_there_are() -> None:
    time = 1e-3 * np.arange(6000)
    x = np.exp(-0.4 * time) * np.cos(40.0 * time)
    found = modes(x, 1e-3, 4)
    assert [round(mode.frequency) for mode in found] == [40]
