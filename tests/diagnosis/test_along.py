"""What a model lacks along the measured motion: against forces known in closed form, as the observer's two poles pass them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.diagnosis.along import Along
from fric.diagnosis.candidates import scales_of
from fric.diagnosis.fitting import bounds_of, free_names
from fric.diagnosis.track import Track
from fric.model import build_model, term
from fric.record import Array, Record

from .small_axis import NOMINAL, followed

W, RATE = 45.0, 4.0  # [rad/s] of the observer and of the motion
FREE = build_model("rigid", {"mass": 2.0}, [term("viscous", coefficient=5.0)])


def passed(rate: float) -> complex:
    """Gain and phase of what the observer lets through: two poles at W."""
    return (W / (W + 1j * rate)) ** 2


@pytest.fixture(scope="module")
def swing() -> tuple[Along, Array]:
    """A sine of 0.1 m, under a force of next to nothing; and the time of the rows in which the axis moves."""
    time = 2e-3 * np.arange(4000)
    track = Track.of([Record(time, 0.1 * np.sin(RATE * time), 1e-3 * np.cos(time))], W, FREE)
    along = Along(track)
    # An interval's motion stands in its middle, and what the observer makes of it at its end.
    return along, track.joined(list(track.time))[along.moving] - 1e-3


def at(time: Array, amplitude: float, phase: complex) -> Array:
    """``amplitude`` times the cosine of the motion's rate, as ``phase`` lets it through."""
    return np.asarray(amplitude * np.real(phase * np.exp(1j * RATE * time)))


def inside(signal: Array) -> Array:
    """Without the ends, where a filter without phase has nothing before or behind."""
    return signal[300:-300]


def test_the_missing_force_is_what_moves_the_mass_and_overcomes_friction(swing: tuple[Along, Array]) -> None:
    """m a + F_v v of the motion: -2 kg 0.1 m 16/s^2 sin + 5 N s/m 0.1 m 4/s cos, low-passed."""
    along, time = swing
    expected = at(time, 2.0, passed(RATE)) + at(time, 0.1 * 2.0 * RATE**2, 1j * passed(RATE))
    assert inside(along.residual(FREE)) == pytest.approx(inside(expected), abs=0.02)


def test_a_signal_is_as_late_as_a_force_and_keeps_its_mean(swing: tuple[Along, Array]) -> None:
    along, time = swing
    expected = at(time, 0.1 * RATE, passed(RATE))
    assert inside(along.seen("velocity")) == pytest.approx(inside(expected), abs=2e-3)
    moved = Record(2e-3 * np.arange(4000), 7.0 + 0.1 * np.sin(RATE * 2e-3 * np.arange(4000)), np.cos(np.arange(4000)))
    elsewhere = Along(Track.of([moved], W, FREE))
    # From the very first row on: a filter that began at zero would take long to come to seven metres.
    assert elsewhere.seen("position") == pytest.approx(7.0 + along.seen("position"), abs=1e-6)


def test_a_further_term_adds_its_force(swing: tuple[Along, Array]) -> None:
    along, time = swing
    base = along.residual(FREE)
    assert inside(along.residual(FREE, term("bias", force=3.0)) - base) == pytest.approx(3.0, abs=0.02)
    spring = along.residual(FREE, term("stiffness", stiffness=50.0, position=0.0)) - base
    assert inside(spring) == pytest.approx(inside(at(time, 5.0, -1j * passed(RATE))), abs=0.02)


def test_changes_are_per_scale_of_each_parameter(swing: tuple[Along, Array]) -> None:
    along, time = swing
    changes = along.changes(FREE, ["mass", "viscous.coefficient"], np.array([0.5, 20.0]))
    acceleration = at(time, -0.1 * RATE**2, -1j * passed(RATE))
    assert inside(changes[:, 0]) == pytest.approx(inside(0.5 * acceleration), abs=0.01)
    assert inside(changes[:, 1]) == pytest.approx(inside(20.0 * along.seen("velocity")), abs=0.02)
    assert along.changes(FREE, [], np.zeros(0)).shape == (time.size, 0)


def test_where_the_axis_rests_nothing_is_told() -> None:
    """It moves for two seconds, rests for three and moves on."""
    time = 2e-3 * np.arange(4000)
    clock = np.where(time < 2.0, time, np.where(time < 5.0, 2.0, time - 3.0))
    position = 0.1 * (1.0 - np.cos(math.pi * clock))  # at rest at 2 s
    track = Track.of([Record(time, position, np.sin(time))], W, FREE)
    along = Along(track)
    rows = track.joined(list(track.time))
    assert not np.any(along.moving[(rows > 2.1) & (rows < 4.9)])
    assert np.mean(along.moving[(rows > 0.2) & (rows < 1.9)]) > 0.95
    assert along.residual(FREE).shape == (int(np.sum(along.moving)),)


def test_values_far_off_are_found_along_the_motion() -> None:
    """A wrong Coulomb force would let a simulated axis stick: here the motion is the measured one."""
    track = followed(term("bias", force=2.0))
    start = NOMINAL.with_terms((*NOMINAL.terms, term("bias", force=1.0)))
    for name, value in (("mass", 3.0), ("coulomb.force", 9.0), ("viscous.coefficient", 12.0)):
        start = start.with_value(name, value)
    along, names = Along(track), free_names(start)
    found = along.fitted(start, names, track.scale(start, names), bounds_of(start, scales_of(track)))
    true = {"mass": 2.0, "coulomb.force": 4.0, "viscous.coefficient": 20.0, "bias.force": 2.0}
    for name, value in true.items():
        assert found.value(name) == pytest.approx(value, rel=0.05), name
    lacks = [float(np.mean(along.residual(model) ** 2)) for model in (found, start)]
    assert lacks[0] < 5e-3 * lacks[1]


def test_a_value_is_not_fitted_beyond_its_bounds() -> None:
    track = followed()
    start = NOMINAL.with_value("coulomb.force", 6.0)
    names = ["coulomb.force"]
    found = Along(track).fitted(start, names, track.scale(start, names), {"coulomb.force": (5.5, 9.0)})
    assert found.value("coulomb.force") == pytest.approx(5.5)


def test_the_motion_at_the_sensor_tells_nothing_of_a_load_behind_a_transmission() -> None:
    track = followed()
    along = Along(track)
    behind = build_model("rigid", {"mass": 2.0, "load_share": 0.5}, [*NOMINAL.terms, term("backlash", gap=1e-4)])
    contact = build_model("contact", {"mass": 2.0}, NOMINAL.terms)
    assert along.can(NOMINAL)
    assert not along.can(behind)
    assert not along.can(contact)  # it needs no such way: it is led along the motion anyway


def test_rows_that_are_told_from_each_other_are_some_part_of_the_observers_time_apart() -> None:
    slow, fast = (Along(followed(bandwidth=bandwidth)) for bandwidth in (20.0, 200.0))
    assert slow.stride in (9, 10)  # a sample of 2 ms is 0.04 of the slow one's time, and as much of the fast one's as counts
    assert fast.stride == 1
    assert (slow.bandwidth, fast.bandwidth) == (20.0, 200.0)
