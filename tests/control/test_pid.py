"""The PID controller against closed forms and against what a controller must not do."""

from __future__ import annotations

import itertools
import math

import pytest
from fric.control.feedbacks.pid import Pid, PidError, PidGains

H = 0.002


def test_each_part_by_hand() -> None:
    pid = Pid(PidGains(proportional=100.0, integral=50.0, derivative=2.0, filter_time=0.006))
    first = pid.step(reference=0.1, measured=0.0, duration=H)
    # P = 100 * 0.1, I = 50 * 0.002 * 0.1, no change yet for D.
    assert first == pytest.approx(10.0 + 0.01, rel=1e-12)
    second = pid.step(reference=0.1, measured=0.02, duration=H)
    # D = 2 * (-0.02) / (0.006 + 0.002)
    assert second == pytest.approx(8.0 + 0.01 + 0.008 - 5.0, rel=1e-12)


def test_derivative_of_a_ramp_settles_at_gain_times_slope() -> None:
    pid = Pid(PidGains(proportional=0.0, derivative=3.0, filter_time=0.01))
    output = 0.0
    for k in range(200):
        output = pid.step(reference=0.5 * k * H, measured=0.0, duration=H)
    assert output == pytest.approx(1.5, rel=1e-6)


def test_weights_zero_leave_the_reference_out() -> None:
    pid = Pid(PidGains(proportional=10.0, derivative=5.0, position_weight=0.0, velocity_weight=0.0))
    pid.step(0.0, 0.0, H)
    assert pid.step(reference=1.0, measured=0.0, duration=H) == 0.0


def _output_after_windup(tracking_time: float, seconds: float) -> list[float]:
    pid = Pid(PidGains(proportional=10.0, integral=100.0, tracking_time=tracking_time), limit=1.0)
    for _ in range(int(seconds / H)):
        assert pid.step(1.0, 0.0, H) == 1.0
    return [pid.step(0.0, 0.05, H) for _ in range(100)]


def test_output_leaves_the_limit_at_once_however_long_it_was_there() -> None:
    short, long = _output_after_windup(0.0, 5.0), _output_after_windup(0.0, 50.0)
    assert short[0] < 1.0
    assert long == pytest.approx(short, abs=1e-9)
    # Without anti-windup the integral has 5000 to get rid of, and the output stays at the limit.
    assert _output_after_windup(1e9, 50.0)[-1] == 1.0


def test_feedforward_counts_against_the_limit() -> None:
    pid = Pid(PidGains(proportional=1.0), limit=5.0)
    assert pid.step(1.0, 0.0, H, feedforward=10.0) == 5.0
    assert pid.saturated == 1


def test_change_of_gains_makes_no_jump() -> None:
    pid = Pid(PidGains(200.0, 30.0, 4.0, 0.01))
    before = [pid.step(math.sin(3.0 * k * H), 0.9 * math.sin(3.0 * k * H - 0.1), H) for k in range(300)]
    k = 300
    pid.set_gains(PidGains(50.0, 300.0, 9.0, 0.01))
    after = pid.step(math.sin(3.0 * k * H), 0.9 * math.sin(3.0 * k * H - 0.1), H)
    ordinary = max(abs(b - a) for a, b in itertools.pairwise(before))
    assert abs(after - before[-1]) < 2.0 * ordinary


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", ["reference", "measured", "feedforward", "duration"])
def test_non_finite_inputs_are_refused_and_leave_no_trace(bad: float, place: str) -> None:
    inputs = {"reference": 0.2, "measured": 0.1, "duration": H, "feedforward": 0.0}
    disturbed, plain = Pid(PidGains(10.0, 5.0, 1.0)), Pid(PidGains(10.0, 5.0, 1.0))
    for pid in (disturbed, plain):
        pid.step(**inputs)
    with pytest.raises(PidError):
        disturbed.step(**{**inputs, place: bad})
    assert disturbed.step(**inputs) == plain.step(**inputs)


@pytest.mark.parametrize("bad", [-1.0, math.nan, math.inf])
def test_bad_gains_are_refused(bad: float) -> None:
    with pytest.raises(PidError, match="integral"):
        PidGains(1.0, bad)
