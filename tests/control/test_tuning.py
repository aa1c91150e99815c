"""Tuning and margins against the time domain: the controller and a finely stepped mass, written down here again."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.control.feedbacks.pid import Pid, PidGains
from fric.control.tuning import TuningError, loop_margins, tune

MASS, DAMPING, H = 2.0, 35.0, 0.002
FINE = 20  # steps of the mass per sample


def _closed_loop(
    gains: PidGains, *, delay: float = 0.0, gain: float = 1.0, load: float = 0.0, seconds: float = 2.0
) -> np.ndarray:
    """Position error after a step of load, the mass stepped exactly within each sample and the command arriving late."""
    pid = Pid(gains)
    step = H / FINE
    fall = math.exp(-DAMPING / MASS * step)
    position = velocity = 0.0
    late = round(delay / step)
    held = [0.0] * (late + 1)
    errors = np.empty(int(seconds / H))
    for k in range(errors.size):
        errors[k] = -position
        command = gain * pid.step(0.0, position, H)
        for _ in range(FINE):
            held.append(command)
            force = held[-1 - late] + load
            steady = force / DAMPING
            position += steady * step + (velocity - steady) * (1.0 - fall) * MASS / DAMPING
            velocity = steady + (velocity - steady) * fall
        held = held[-late - 1 :]
    return errors


@pytest.fixture(scope="module", params=[0.0, 0.0005, 0.003])
def tuned(request: pytest.FixtureRequest) -> tuple[float, PidGains]:
    delay = float(request.param)
    gains, margins = tune(MASS, DAMPING, H, delay=delay, filter_time=0.0005)
    assert margins.stable
    assert margins.sensitivity <= 1.701
    assert margins.complementary <= 1.701
    return delay, gains


def test_gain_margin_is_where_the_loop_begins_to_grow(tuned: tuple[float, PidGains]) -> None:
    delay, gains = tuned
    margin = loop_margins(gains, MASS, DAMPING, H, delay=delay).gain_margin
    assert 2.0 < margin < 10.0
    for factor, grows in ((0.97, False), (1.03, True)):
        error = np.abs(_closed_loop(gains, delay=delay, gain=margin * factor, load=1.0, seconds=4.0))
        assert bool(error[-200:].max() > error[200:400].max()) is grows


def test_delay_margin_is_where_the_loop_begins_to_grow(tuned: tuple[float, PidGains]) -> None:
    delay, gains = tuned
    margin = loop_margins(gains, MASS, DAMPING, H, delay=delay).delay_margin
    for factor, grows in ((0.94, False), (1.06, True)):
        error = np.abs(_closed_loop(gains, delay=delay + margin * factor, load=1.0, seconds=6.0))
        assert bool(error[-300:].max() > error[300:600].max()) is grows


def test_integrated_error_after_a_load_step_is_load_over_integral_gain(tuned: tuple[float, PidGains]) -> None:
    delay, gains = tuned
    errors = _closed_loop(gains, delay=delay, load=5.0)
    assert H * errors.sum() == pytest.approx(-5.0 / gains.integral, rel=1e-3)


def test_no_better_gains_nearby() -> None:
    gains, _ = tune(MASS, DAMPING, H, filter_time=0.0005)
    random = np.random.default_rng(1)
    for _ in range(200):
        kp, ki, kd = np.array([gains.proportional, gains.integral, gains.derivative]) * np.exp(0.3 * random.standard_normal(3))
        if ki < 1.03 * gains.integral:
            continue
        other = loop_margins(PidGains(kp, ki, kd, gains.filter_time), MASS, DAMPING, H)
        assert not other.stable or max(other.sensitivity, other.complementary) > 1.7


def test_known_margins_of_a_slow_loop() -> None:
    """Gain 1 on 1/(s (s + 1)) has its crossover at 0.786 rad/s with 51.8 deg."""
    margins = loop_margins(PidGains(1.0), 1.0, 1.0, 1e-4)
    assert 2.0 * math.pi * margins.crossover == pytest.approx(0.786, abs=0.003)
    assert margins.phase_margin == pytest.approx(51.8, abs=0.2)
    assert margins.stable


def test_more_delay_costs_integral_gain() -> None:
    found = [tune(MASS, DAMPING, H, delay=delay)[0].integral for delay in (0.0, 0.001, 0.004)]
    assert found[0] > 2.0 * found[1] > 4.0 * found[2]


@pytest.mark.parametrize(
    "change", [{"mass": 0.0}, {"period": -1.0}, {"sensitivity": 1.0}, {"delay": -1e-3}, {"mass": math.nan}]
)
def test_arguments_out_of_range_are_refused(change: dict[str, float]) -> None:
    with pytest.raises(TuningError):
        tune(**{"mass": MASS, "damping": DAMPING, "period": H, **change})
