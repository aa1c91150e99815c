"""Whatever comes in: the force is finite, within its limit, and changes no faster than its rate limit."""

from __future__ import annotations

import contextlib
import math
from dataclasses import replace

import pytest
from fric.control.safety import Limits, SafetyError, SafetyLayer, State
from hypothesis import given, settings
from hypothesis import strategies as st

LIMITS = Limits(
    100.0, 2000.0, speed=0.5, position_min=-0.1, position_max=0.1, following_error=0.02, temperature=80.0,
    inertia_min=1.6, inertia_max=2.4, friction=25.0, position_noise=1e-7,
)  # fmt: skip
KINDS = (
    LIMITS,
    replace(LIMITS, load=20.0, hold=True),
    replace(LIMITS, resume=True),
    Limits(5.0, speed=1.0, position_min=-1.0, position_max=1.0),
    Limits(5.0),
)
H = 2_000_000  # [ns]

numbers = st.one_of(
    st.floats(-0.12, 0.12), st.floats(), st.sampled_from([math.nan, math.inf, -math.inf, 1e308, -1e308, 0.0, 99.0, -1e3])
)
stamps = st.one_of(st.integers(-H, 0), st.sampled_from([0, 10**10, -(10**10), -H, H, 10**18]))  # [ns], to the present
now_changes = st.one_of(st.just(H), st.sampled_from([0, 1, -H, -(10**10), 10**9, 10**18, H // 2]))
calls = st.one_of(
    st.tuples(st.just("command"), numbers, stamps, st.sampled_from(["a", "b"])),
    st.tuples(st.just("reading"), numbers, stamps, numbers),
    st.tuples(st.just("still"), st.just(0.0), stamps, st.just(20.0)),
    st.tuples(st.sampled_from(["enable", "disable", "reset", "fail"]), numbers, stamps, numbers),
    st.tuples(st.just("step"), numbers, now_changes, numbers),
    st.tuples(st.just("step"), numbers, st.just(H), numbers),
)


def started(limits: Limits, enabled: bool) -> tuple[SafetyLayer, int]:
    """A layer with a resting axis, and its time."""
    layer, now = SafetyLayer(limits), 10**18
    for _ in range(6):
        now += H
        assert layer.reading(now, now, 0.0)
        layer.step(now)
    if enabled:
        layer.enable(now)
        layer.command(now, now, 10.0, "a")
    return layer, now


def call(layer: SafetyLayer, now: int, what: str, number: float, offset: int, other: object) -> None:
    with contextlib.suppress(SafetyError):
        match what:
            case "command":
                layer.command(now, now + offset, number, str(other))
            case "reading" | "still":
                layer.reading(now, now + offset, number, float(str(other)))
            case "fail":
                layer.fail("drive", "of the test", now)
            case _:
                getattr(layer, what)(now)


@settings(max_examples=300, deadline=None)
@given(st.sampled_from(KINDS), st.booleans(), st.lists(calls, max_size=60))
def test_the_force_is_finite_limited_and_no_faster_than_its_rate(
    limits: Limits, enabled: bool, sequence: list[tuple[str, float, int, object]]
) -> None:
    layer, now = started(limits, enabled)
    before = layer.force
    for what, number, offset, other in sequence:
        if what != "step":
            call(layer, now, what, number, offset, other)
            assert layer.force == before, "only a step changes the force"
            continue
        now += offset
        force = layer.step(now, number)
        passed = min(max(offset * 1e-9, 0.0), limits.longest_step)
        assert math.isfinite(force)
        assert abs(force) <= limits.force
        allowed = limits.force_rate * passed if passed > 0.0 else 0.0
        assert abs(force - before) <= allowed * (1.0 + 1e-9) + 1e-12
        if layer.state is not State.ENABLED:
            assert not (layer.state is State.DISABLED and abs(force) > max(abs(before) - allowed, 0.0) + 1e-9)
        before = force


def test_a_fault_while_it_waits_to_resume_ends_the_waiting() -> None:
    layer, now = started(replace(LIMITS, resume=True), True)
    now += 10**8
    layer.step(now)  # both inputs are lost
    assert layer.state is not State.ENABLED
    layer.fail("drive", "of the test", now)
    for _ in range(100):
        now += H
        layer.reading(now, now, 0.0)
        layer.command(now, now, 10.0, "a")
        layer.step(now)
    assert layer.state is State.FAULT
    assert layer.force == 0.0


def test_no_first_reading_can_be_absurd() -> None:
    for limits in KINDS:
        layer, now = SafetyLayer(limits), 10**18
        for position in (1e308, -1e308, 1e13):
            for _ in range(10):
                now += H
                assert not layer.reading(now, now, position)
        now += H
        assert layer.reading(now, now, 0.05)


@settings(max_examples=200, deadline=None)
@given(st.lists(calls, max_size=40))
def test_nothing_stays_poisoned(sequence: list[tuple[str, float, int, object]]) -> None:
    layer, now = started(LIMITS, True)
    for what, number, offset, other in sequence:
        if what == "step":
            now += offset
            layer.step(now, number)
        else:
            call(layer, now, what, number, offset, other)
    # A second later every input is in order again.
    layer.disable(now)
    now += 10**9
    for _ in range(400):
        now += H
        layer.reading(now, now, 0.0, 20.0)
        layer.step(now)
    layer.reset(now)
    for _ in range(6):
        now += H
        layer.reading(now, now, 0.0, 20.0)
        layer.step(now)
    layer.enable(now)
    for _ in range(5):
        now += H
        assert layer.reading(now, now, 0.0, 20.0)
        assert layer.command(now, now, 5.0, "c")
        force = layer.step(now)
    assert layer.state is State.ENABLED
    assert force == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"force": 0.0}, "force is 0"),
        ({"force": math.inf}, "force is inf"),
        ({"force_rate": math.nan}, "force_rate is nan"),
        ({"force_rate": math.inf}, "finite force_rate"),
        ({"position_min": 0.2}, "is not below"),
        ({"load": 100.0}, "load"),
        ({"inertia_max": 1.0}, "inertia_min is 1.6"),
        ({"friction": -1.0}, "friction is -1"),
        ({"brake_time": 0.01}, "brake_time"),
    ],
)
def test_limits_that_make_no_sense_are_refused(change: dict[str, float], named: str) -> None:
    with pytest.raises(SafetyError, match=named):
        replace(LIMITS, **change)
