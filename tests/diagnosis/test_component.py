"""In which component something unknown sits, on axes that a step method of the test integrates."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from fric.diagnosis.component import Signature, agreed, signatures
from fric.diagnosis.fitting import refit
from fric.diagnosis.track import Track
from fric.model import build_model, term
from fric.record import Record

_STEP, _FINER = 2e-3, 8
_MASS, _LEVEL, _VISCOUS = 2.0, 5.0, 12.0
_SWINGS = ((0.31, 0.05, 0.4), (0.83, 0.02, 2.0), (2.3, 0.004, 5.0))  # [Hz], [m], [rad]


def _in_window(t: float) -> bool:
    return t % 5.0 > 3.2


def _in_short_window(t: float) -> bool:
    """Edges between those of any even grid, some close together."""
    return any(first < t < last for first, last in ((2.13, 2.46), (5.37, 5.91), (9.12, 9.44), (12.88, 13.33), (16.61, 17.4)))


def _recorded(
    friction: Callable[[float], float],
    gain: Callable[[float], float],
    mass: Callable[[float], float],
    n: int = 10_000,
    force: Callable[[float], float] = lambda t: 0.0,
) -> Record:
    """An axis that a controller leads along swings, in ``n`` samples.

    Friction, gain and mass are relative to the usual, over time [s]; a ``force`` [N] acts beside them.
    """
    h = _STEP / _FINER
    position, effort = np.empty(n), np.empty(n)
    q = v = 0.0
    for k in range(n):
        t = k * _STEP
        r = sum(a * math.sin(2 * math.pi * f * t + p) - a * math.sin(p) for f, a, p in _SWINGS)
        w = sum(a * 2 * math.pi * f * math.cos(2 * math.pi * f * t + p) for f, a, p in _SWINGS)
        u = 3000.0 * (r - q) + 120.0 * (w - v) + 0.9 * _LEVEL * math.tanh(w / 0.01)
        position[k], effort[k] = q, u
        for _ in range(_FINER):
            against = _LEVEL * friction(t) * math.tanh(v / 1e-3) + _VISCOUS * v
            v += h / (_MASS * mass(t)) * (u * gain(t) - against + force(t))
            q += h * v
    random = np.random.default_rng(6)
    noisy = effort + 0.05 * random.standard_normal(n)
    return Record(_STEP * np.arange(n), np.round(position / 1e-7) * 1e-7, noisy, effort_hold="following")


def _always(t: float) -> float:
    return 1.0


def _pulled_by_a_chain() -> Record:
    """The axis rests and sticks for two fifths of the time, and a chain behind it, with play, pulls on one side."""
    n, h = 10_000, _STEP / _FINER
    position, effort = np.empty(n), np.empty(n)
    q = v = chain = 0.0
    for k in range(n):
        # Time of the reference: it stands still from 2.4 to 4 s of each four.
        t = 2.4 * (k * _STEP // 4.0) + min(k * _STEP % 4.0, 2.4)
        r = sum(a * math.sin(2 * math.pi * f * t + p) - a * math.sin(p) for f, a, p in _SWINGS)
        u = 3000.0 * (r - q) - 120.0 * v
        position[k], effort[k] = q, u
        for _ in range(_FINER):
            chain = max(q - 0.012, min(q + 0.012, chain))
            drive = u - 150.0 * max(chain + 0.02, 0.0)
            if v == 0.0 and abs(drive) <= _LEVEL:
                continue
            way = math.copysign(1.0, v if v != 0.0 else drive)
            faster = v + h / _MASS * (drive - way * _LEVEL - _VISCOUS * v)
            v = 0.0 if faster * v < 0.0 else faster
            q += h * v
    noisy = effort + 0.05 * np.random.default_rng(8).standard_normal(n)
    return Record(_STEP * np.arange(n), np.round(position / 1e-7) * 1e-7, noisy, effort_hold="following")


@pytest.mark.parametrize("bandwidth", [45.0, 140.0])
def test_what_a_contact_takes_up_at_rest_is_not_missing_there(bandwidth: float) -> None:
    nominal = build_model("rigid", {"mass": _MASS}, [term("coulomb", force=_LEVEL), term("viscous", coefficient=_VISCOUS)])
    record = _pulled_by_a_chain()
    assert np.mean(np.diff(record.position) == 0.0) > 0.2
    track = Track.of([record], bandwidth, nominal)
    found = signatures(track, refit(track, nominal).fit)
    assert (found[0].component, found[0].title) == ("load", "a force that hangs on the position and lags behind it")
    assert found[0].share > 0.85


def test_observers_are_heard_alike() -> None:
    slow = [Signature("command path", "gain", 0.90, -2.20, 40), Signature("guideway friction", "level", 0.89, -2.15, 40)]
    fast = [Signature("guideway friction", "level", 0.95, -2.90, 40), Signature("command path", "gain", 0.85, -1.80, 40)]
    assert agreed([slow]).component == "command path"
    both = agreed([slow, fast])
    assert both.component == "guideway friction"
    assert both.share == 0.89  # as the first of them sees it


@pytest.mark.parametrize(
    ("friction", "gain", "mass", "component"),
    [
        (lambda t: 1.6 if _in_window(t) else 1.0, _always, _always, "guideway friction"),
        (_always, lambda t: 0.75 if _in_window(t) else 1.0, _always, "command path"),
        (_always, _always, lambda t: 1.8 if t > 9.0 else 1.0, "load"),
        (lambda t: 1.4 if _in_short_window(t) else 1.0, _always, _always, "guideway friction"),
        (_always, lambda t: 0.75 if _in_short_window(t) else 1.0, _always, "command path"),
    ],
)
def test_the_component_is_told_by_the_force_that_hangs_on_it(
    friction: Callable[[float], float], gain: Callable[[float], float], mass: Callable[[float], float], component: str
) -> None:
    nominal = build_model("rigid", {"mass": _MASS}, [term("coulomb", force=_LEVEL), term("viscous", coefficient=_VISCOUS)])
    track = Track.of([_recorded(friction, gain, mass)], 45.0, nominal)
    found = signatures(track, refit(track, nominal).fit)
    assert found[0].component == component
    assert found[0].share > 0.7


def test_what_pulls_whichever_way_the_axis_moves_is_no_friction() -> None:
    nominal = build_model("rigid", {"mass": _MASS}, [term("coulomb", force=_LEVEL), term("viscous", coefficient=_VISCOUS)])
    record = _recorded(_always, _always, _always, force=lambda t: -0.9 * _LEVEL if _in_window(t) else 0.0)
    track = Track.of([record], 45.0, nominal)
    found = signatures(track, refit(track, nominal).fit)
    assert found[0].component == "load"
    friction = next(each for each in found if each.component == "guideway friction")
    # With edges free at every reversal friction comes near, by many more numbers.
    assert friction.n_coefficients > 2 * found[0].n_coefficients
    assert found[0].share > 0.9


def test_a_shaking_floor_is_heard_though_the_longest_recording_lacks_something_else() -> None:
    def drifts(t: float) -> float:
        return 1.0 + 0.1 * math.sin(2.0 * math.pi * 0.7 * t)

    def shakes(t: float) -> float:
        return 2.0 * math.sin(2.0 * math.pi * 31.0 * t)

    nominal = build_model("rigid", {"mass": _MASS}, [term("coulomb", force=_LEVEL), term("viscous", coefficient=_VISCOUS)])
    longest = _recorded(drifts, _always, _always)
    shaken = [_recorded(_always, _always, _always, 2500 + 100 * k, shakes) for k in range(4)]
    track = Track.of([longest, *shaken], 140.0, nominal)
    found = signatures(track, refit(track, nominal).fit)
    assert (found[0].component, found[0].title) == ("load", "a force that swings at one frequency")
    # Sine and cosine of each recording: their clocks are not one.
    assert found[0].n_coefficients == 10
