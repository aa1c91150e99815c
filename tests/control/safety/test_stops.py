"""Every stop of a simulated axis ends at rest within the time and distance stated for it; limits hold on the way."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fric.control.safety import SafetyError, State, stop_from
from fric.model import Model

H = 0.002  # [s]
MODELS = {
    "light, little friction": {"mass": 1.6, "coulomb": 0.5, "viscous": 1.0},
    "heavy, little friction": {"mass": 2.4, "coulomb": 0.5, "viscous": 1.0},
    "much friction": {"mass": 2.0, "coulomb": 15.0, "viscous": 35.0},
}
Make = Callable[..., Any]


def swing(size: float, frequency: float) -> Callable[[float, float], float]:
    """A force [N] that moves the axis to and fro about the middle of its range."""
    return lambda t, x: size * math.sin(2.0 * math.pi * frequency * t) - 400.0 * x


def assert_inside(rig: Any) -> None:
    forces, positions = np.array(rig.forces), np.array(rig.positions)
    assert np.abs(forces).max() <= rig.limits.force
    assert np.abs(np.diff(forces)).max() <= rig.limits.force_rate * H * (1.0 + 1e-9)
    assert np.abs(np.diff(positions)).max() / H <= rig.limits.speed
    assert rig.limits.position_min <= positions.min() <= positions.max() <= rig.limits.position_max


@pytest.mark.parametrize("kind", MODELS)
@pytest.mark.parametrize("how", ["disable", "command lost", "drive fault"])
@pytest.mark.parametrize("at", [0.31, 0.47, 0.62])
def test_a_stop_ends_within_the_stated_time_and_distance(
    rig: type[Any], model: Callable[..., Model], kind: str, how: str, at: float
) -> None:
    moved = rig(model(**MODELS[kind]), wanted=swing(30.0, 1.7))
    moved.enable()
    moved.run(at)
    assert moved.layer.state is State.ENABLED, moved.layer.cause
    if how == "command lost":
        moved.speaks = False
        moved.run(1.0, lambda: moved.layer.state is not State.ENABLED)
        assert "command lost" in moved.layer.faults
    elif how == "disable":
        moved.layer.disable(moved.now)
    else:
        moved.layer.fail("drive", "of the test", moved.now)
    assert moved.layer.state is State.STOPPING
    begin, speed, force = moved.positions[-1], moved.speed, moved.layer.force
    stated = stop_from(moved.limits, speed, force)
    samples = moved.run(5.0, lambda: moved.layer.state is not State.STOPPING)
    assert samples * H <= stated.time + H
    assert moved.layer.state is (State.DISABLED if how == "disable" else State.FAULT)
    moved.run(0.3)
    assert moved.layer.force == 0.0
    assert abs(moved.speed) < moved.limits.at_rest
    assert abs(moved.positions[-1] - begin) <= stated.distance
    assert_inside(moved)
    # The bound is of use: it isn't ten times what really happens, wherever there is something to stop.
    if abs(speed) > 0.1 and kind == "heavy, little friction":
        assert stated.distance < 10.0 * abs(moved.positions[-1] - begin)


@pytest.mark.parametrize("kind", MODELS)
@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("size", [12.0, 40.0, 100.0, 1e4])
def test_a_force_that_pushes_on_and_on_leaves_the_axis_inside(
    rig: type[Any], model: Callable[..., Model], kind: str, sign: float, size: float
) -> None:
    moved = rig(model(**MODELS[kind]), wanted=lambda t, x: sign * size)
    moved.enable()
    moved.run(3.0)
    assert_inside(moved)
    assert abs(moved.speed) < moved.limits.at_rest
    if size > 15.0:
        assert abs(moved.positions[-1]) > 0.08  # but it does go there
        assert moved.layer.counters["position limit"] > 0
    # And it can come back.
    moved.wanted = lambda t, x: -sign * 30.0
    moved.run(0.2)
    assert sign * moved.positions[-1] < 0.08


def test_the_speed_limit_holds_where_there_is_room(rig: type[Any], model: Callable[..., Model]) -> None:
    limits = replace(rig().limits, position_max=10.0, speed=0.3)
    moved = rig(model(coulomb=1.0, viscous=5.0), limits, wanted=lambda t, x: 90.0)
    moved.enable()
    moved.run(2.0)
    assert_inside(moved)
    assert moved.speed > 0.2
    assert moved.layer.state is State.ENABLED
    assert moved.layer.counters["speed limit"] > 0


def test_a_loaded_axis_is_stopped_and_held(rig: type[Any], model: Callable[..., Model]) -> None:
    weight = 15.0
    limits = replace(rig().limits, load=20.0, hold=True)
    moved = rig(model(coulomb=1.0, viscous=5.0, bias=weight), limits, wanted=lambda t, x: weight - 300.0 * x)
    moved.enable()
    moved.run(0.5)
    moved.speaks = False
    moved.run(1.0)
    assert moved.layer.state is State.FAULT
    moved.run(2.0)
    rest = moved.positions[-1]
    moved.run(1.0)
    assert abs(moved.positions[-1] - rest) < 1e-5
    assert moved.layer.force == pytest.approx(weight, abs=1.5)
    assert_inside(moved)


def test_without_readings_the_force_goes_to_zero_and_the_axis_coasts(rig: type[Any]) -> None:
    moved = rig(wanted=swing(40.0, 1.3))
    moved.enable()
    moved.run(0.3)
    moved.measures = False
    at = len(moved.forces)
    moved.run(1.0)
    assert moved.layer.cause.startswith("joint state lost")
    assert moved.layer.state is State.FAULT
    timeout, ramp = moved.limits.state_timeout, moved.limits.force / moved.limits.force_rate
    late = moved.forces[at + math.ceil((timeout + ramp) / H) + 2 :]
    assert set(late) == {0.0}
    assert_inside(moved)


def test_enabling_again_after_a_fault_is_free_of_jumps(rig: type[Any]) -> None:
    moved = rig(wanted=swing(25.0, 2.0))
    moved.enable()
    moved.run(0.4)
    moved.speaks = False
    moved.run(1.0)
    with pytest.raises(SafetyError, match="command lost"):
        moved.layer.enable(moved.now)
    moved.layer.reset(moved.now)
    assert moved.layer.state is State.DISABLED
    with pytest.raises(SafetyError, match="no joint state"):
        moved.layer.enable(moved.now)
    moved.speaks = True
    moved.run(0.02)
    moved.layer.enable(moved.now)
    moved.run(0.5)
    assert moved.layer.state is State.ENABLED
    assert max(map(abs, moved.forces[-100:])) > 5.0
    assert_inside(moved)


def test_where_it_is_told_so_it_resumes_by_itself(rig: type[Any]) -> None:
    moved = rig(limits=replace(rig().limits, resume=True), wanted=swing(25.0, 2.0))
    moved.enable()
    for silence in (0.06, 1.0):
        moved.run(0.3)
        assert moved.layer.state is State.ENABLED
        moved.speaks = False
        moved.run(silence)
        assert moved.layer.state is not State.ENABLED
        moved.speaks = True
        moved.run(1.0)
        assert moved.layer.state is State.ENABLED
    assert moved.layer.counters["command lost"] == 2
    assert_inside(moved)


@pytest.mark.parametrize("at", np.linspace(0.3, 0.8, 9).round(3))
@pytest.mark.parametrize("kind", ["frozen", "reversed", "jump", "doubled"])
def test_a_wrong_encoder_is_found_out_before_it_does_harm(rig: type[Any], kind: str, at: float) -> None:
    last: list[float] = []
    begin = math.inf

    def seen(t: float, x: float) -> float:
        if t < begin:
            last[:] = [x]
            return x
        return {"frozen": last[0], "reversed": -x, "jump": x + 0.02, "doubled": 2.0 * x}[kind]

    # A stiff position controller, which answers a wrong reading with all its force.
    def wanted(t: float, x: float) -> float:
        return 6000.0 * (0.03 * math.sin(6.0 * t) - x)

    moved = rig(wanted=wanted, seen=seen)
    moved.enable()
    moved.run(at)
    assert moved.layer.state is State.ENABLED, moved.layer.cause
    begin = 1e-9 * (moved.now - moved.origin)
    moved.run(3.0)
    assert_inside(moved)
    if kind != "doubled":  # a wrong scale is nothing that bounds on the inertia can always tell
        assert moved.layer.faults.keys() & {"motion contradicts force", "joint state implausible", "overspeed"}
