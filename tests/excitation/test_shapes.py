"""What is particular to each excitation: where it turns, rests and stays constant, worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from fric.excitation import EXCITATIONS
from fric.excitation.prbs import maximum_length_sequence
from fric.excitation.presliding_loops import turning_points
from fric.excitation_kind import ExcitationError, Points


def _plan(name: str, seed: int = 3, **changes: float):  # type: ignore[no-untyped-def]
    kind = EXCITATIONS[name]
    values = {parameter.name: parameter.default for parameter in kind.parameters}
    assert set(changes) <= set(values)
    return kind.plan({**values, **changes}, np.random.default_rng(seed))  # type: ignore[misc]


def _sampled(motion, step: float = 1e-3) -> tuple[np.ndarray, Points]:  # type: ignore[no-untyped-def]
    t = np.arange(0.0, motion.duration, step)
    return t, motion.at(t)


def _turns(v: np.ndarray) -> int:
    """Changes of direction; rests between don't count."""
    signs = np.sign(v[np.abs(v) > 1e-12])
    return int(np.count_nonzero(np.diff(signs)))


@pytest.mark.parametrize("corner", [0.0, 0.02])
def test_slow_triangles_turn_as_often_as_asked_at_the_amplitude(corner: float) -> None:
    motion = _plan("slow_triangles", speed=0.001, amplitude=0.001, reversals=7, corner_time=corner, rest=0.1)
    _, (q, v, a) = _sampled(motion, 2e-4)
    assert _turns(v) == 7
    assert q.max() == pytest.approx(0.001, rel=1e-3)
    assert q.min() == pytest.approx(-0.001, rel=1e-3)
    straight = np.abs(np.abs(v) - 0.001) < 1e-15
    assert np.count_nonzero(straight) > 0.9 * len(v)
    if corner == 0.0:
        assert not a.any()
        assert set(np.round(v, 12)) <= {0.0, 0.001, -0.001}
    assert q[-1] == 0.0


def test_ramps_go_to_both_sides_at_every_speed() -> None:
    motion = _plan("ramps", speed_low=0.002, speed_high=0.008, speeds=3, height=0.01, rest=0.5)
    _, (q, v, a) = _sampled(motion)
    for speed in (0.002, 0.004, 0.008):
        for direction in (1.0, -1.0):
            for side in (1.0, -1.0):
                here = (np.abs(v - direction * speed) < 1e-12) & (side * q > 0.0) & (a == 0.0)
                # Two ramps of 10 mm over both directions, less one corner of 0.05 s each.
                assert np.count_nonzero(here) * 1e-3 == pytest.approx(0.01 / speed - 0.05, rel=0.01)
    assert q.max() == pytest.approx(0.01)
    assert q.min() == pytest.approx(-0.01)
    assert _plan("ramps", sides=1.0).at(np.linspace(0.0, 10.0, 1000)).position.min() >= 0.0


def test_stick_slip_ramp_pulls_at_its_rate_and_holds() -> None:
    motion = _plan("stick_slip_ramp", peak=0.01, rate_low=0.001, rate_high=0.001, rates=1, hold=0.5, sides=1, corner_time=0.1)
    q, v, a = motion.at(np.array([0.05, 0.1, 5.0, 9.9, 10.1, 10.6]))
    # The corners are symmetric: half the rate at the middle of them, and half of their time at full rate.
    assert v == pytest.approx([0.0005, 0.001, 0.001, 0.001, 0.0, 0.0], abs=1e-12)
    assert q[[1, 2, 4, 5]] == pytest.approx([0.5e-4, 0.00495, 0.01, 0.01], abs=1e-12)
    assert a[[2, 3]] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_presliding_loops_close_and_are_graded() -> None:
    # One inner loop: half-way, back by c times the way to it.
    assert turning_points(1.0, 1, 0.5) == pytest.approx([0.0, -0.5, 0.0, 1.0, 0.0, 0.5, 0.0, -1.0, 1.0, -1.0])
    points = turning_points(3.0, 2, 0.9)
    up = points[:7]
    assert up[0] == up[2] == pytest.approx(-1.0)
    assert up[3] == up[5] == pytest.approx(1.0)
    assert up[0] - up[1] == pytest.approx(0.9)
    assert up[3] - up[4] == pytest.approx(1.8)
    motion = _plan("presliding_loops", amplitude=1e-5, amplitude_low=1e-6, loops=3, inner=2, inner_share=0.9, rest=0.05)
    _, (q, v, _) = _sampled(motion, 5e-4)
    still = q[1:][(v[1:] == 0.0) & (v[:-1] != 0.0)]
    expected = [0.0]
    for amplitude in (1e-5, 10**-5.5, 1e-6):
        expected += [-amplitude, *turning_points(amplitude, 2, 0.9)]
    assert still[:-1] == pytest.approx(expected[1:], abs=1e-17)


def test_free_decay_holds_and_lets_go() -> None:
    force = _plan(
        "free_decay", force_high=40.0, force_low=10.0, releases=3, rise_time=1.0, hold=2.0, release_time=0.0, decay_time=4.0
    )
    t = np.array([1.0, 2.999, 3.0, 5.0, 6.999, 8.0, 9.999, 10.0, 15.5])
    f, rate, _ = force.at(t)
    assert f.tolist() == [40.0, 40.0, 0.0, 0.0, 0.0, pytest.approx(-20.0), pytest.approx(-20.0), 0.0, pytest.approx(10.0)]
    assert not rate.any()
    assert EXCITATIONS["free_decay"].outputs == ("force",)


@pytest.mark.parametrize("stages", range(2, 17))
def test_prbs_is_of_maximum_length(stages: int) -> None:
    period = 2**stages - 1
    bits = maximum_length_sequence(stages, 1)
    signs = 1.0 - 2.0 * bits
    # One more 1 than 0, and an autocorrelation of -1 at every shift: what only a maximum-length sequence has.
    assert bits.sum() == (period + 1) // 2
    spectrum = np.abs(np.fft.fft(signs)) ** 2
    correlation = np.fft.ifft(spectrum).real
    assert correlation[0] == pytest.approx(period)
    assert correlation[1:] == pytest.approx(np.full(period - 1, -1.0), abs=1e-6)
    other = maximum_length_sequence(stages, period)
    assert any(np.array_equal(np.roll(bits, shift), other) for shift in range(period)) if stages < 10 else True


def test_prbs_motion_is_the_sequence() -> None:
    motion = _plan("prbs", amplitude=2.0, stages=5, clock=0.1, edge_time=0.04, periods=2)
    q, v, _ = motion.at(0.1 * np.arange(62) + 0.07)
    assert set(np.abs(q)) == {2.0}
    assert not v.any()
    assert np.array_equal(q[:31], q[31:])
    assert abs(q[:31].sum()) == 2.0


def test_velocity_ladder_is_settled_where_it_says() -> None:
    motion = _plan("velocity_ladder", speed_low=0.001, speed_high=0.1, speeds=5, settle=0.2, measure=1.0, travel=0.05)
    assert len(motion.rungs) == 10
    for pair, speed in zip(np.reshape(motion.rungs, (5, 2, 3)), np.geomspace(0.001, 0.1, 5), strict=True):
        for (velocity, first, last), direction in zip(pair, (1.0, -1.0), strict=True):
            assert velocity == pytest.approx(direction * speed)
            q, v, a = motion.at(np.linspace(first - 0.1999, last, 100))
            assert v == pytest.approx(np.full(100, velocity), rel=1e-12)
            assert np.abs(a).max() < 1e-9
            assert q.min() >= -1e-12
            assert q.max() <= 0.05 + 1e-12
            wanted = min(1.0, 0.05 / speed - max(1.5 * speed / 2.0, 0.02) - 0.2)
            assert last - first == pytest.approx(wanted)


@pytest.mark.parametrize("shuffle", [0.0, 1.0])
def test_graded_rests_come_as_often_as_asked_before_both_directions(shuffle: float) -> None:
    motion = _plan("graded_rests", rest_low=0.1, rest_high=1.6, rests=5, repeats=2, shuffle=shuffle)
    lengths = np.array([length for length, _ in motion.rests])
    for direction in (0, 1):
        assert np.sort(lengths[direction::2]) == pytest.approx(np.repeat([0.1, 0.2, 0.4, 0.8, 1.6], 2))
    ordered = np.all(np.diff(lengths[::2]) >= 0.0)
    assert ordered == (shuffle == 0.0)
    for number, (length, end) in enumerate(motion.rests):
        _, v, a = motion.at(np.linspace(end - length, end - 1e-9, 20))
        assert not v.any()
        assert not a.any()
        _, v, _ = motion.at(np.array([end + 0.05, end + 0.1]))
        assert v == pytest.approx(np.full(2, 0.005 if number % 2 == 0 else -0.005))


def test_two_axes_of_a_circle_keep_the_radius_and_the_feed() -> None:
    first, second = (_plan("circle", axis=axis, radius=0.03, feed=0.06) for axis in (1.0, 2.0))
    t = np.linspace(0.0, first.duration, 2000)
    x, y = first.at(t), second.at(t)
    np.testing.assert_allclose(np.hypot(x.position + 0.03, y.position), 0.03, rtol=1e-12)
    steady = (t > 0.5) & (t < first.duration - 0.5)
    np.testing.assert_allclose(np.hypot(x.velocity, y.velocity)[steady], 0.06, rtol=1e-9)
    np.testing.assert_allclose(np.hypot(x.acceleration, y.acceleration)[steady], 0.06**2 / 0.03, rtol=1e-9)
    with pytest.raises(ExcitationError, match="less than ramp_time"):
        _plan("circle", turns=1.0, feed=1.0)


def test_a_scan_steps_while_its_lines_turn() -> None:
    line, step = (_plan("scanning", axis=axis, lines=4.0) for axis in (1.0, 2.0))
    assert line.duration == pytest.approx(step.duration)
    t = np.linspace(0.0, line.duration - 1.0, 4000)
    along, across = line.at(t), step.at(t)
    steady = np.abs(np.abs(along.velocity) - 0.02) < 1e-9
    assert np.mean(steady) > 0.8
    assert np.max(np.abs(across.velocity[steady])) < 1e-12
    assert np.unique(np.round(across.position[steady] / 1e-4)).tolist() == [0.0, 1.0, 2.0, 3.0]
