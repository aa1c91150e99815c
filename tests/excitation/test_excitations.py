"""Every excitation of the catalogue, whatever it is: consistent derivatives, rest at both ends, limits, repeatability."""

from __future__ import annotations

import numpy as np
import pytest
from fric_nodes.excitation import EXCITATIONS
from fric_nodes.excitation.sequence import Sequence
from fric_nodes.excitation_kind import Excitation, ExcitationError, Trajectory


def _plan(kind: Excitation, seed: int = 3, **changes: float) -> Trajectory:
    values = {parameter.name: parameter.default for parameter in kind.parameters}
    assert None not in values.values(), "every parameter has a default"
    return kind.plan({**values, **changes}, np.random.default_rng(seed))  # type: ignore[dict-item]


@pytest.fixture(params=EXCITATIONS.values(), ids=list(EXCITATIONS))
def kind(request: pytest.FixtureRequest) -> Excitation:
    found: Excitation = request.param
    return found


def test_catalogue_is_what_the_folder_holds() -> None:
    assert set(EXCITATIONS) >= {"chirp", "multisine", "point_to_point", "reversals", "steps"}


def test_starts_and_ends_at_rest_at_zero(kind: Excitation) -> None:
    motion = _plan(kind)
    q, v, a = motion.at(np.array([0.0, motion.duration]))
    for values in (q, v, a):
        assert values == pytest.approx([0.0, 0.0], abs=1e-9)


def test_velocity_and_acceleration_are_the_derivatives(kind: Excitation) -> None:
    motion = _plan(kind)
    random = np.random.default_rng(0)
    t = random.uniform(0.001, motion.duration - 0.001, 2000)
    h = 1e-4
    before, here, after = (motion.at(t + shift) for shift in (-h, 0.0, h))
    slope = (after.position - before.position) / (2.0 * h)
    curve = (after.velocity - before.velocity) / (2.0 * h)
    assert np.abs(slope - here.velocity).max() < 1e-3 * np.abs(here.velocity).max()
    assert np.abs(curve - here.acceleration).max() < 0.02 * np.abs(here.acceleration).max()


def test_velocity_never_jumps(kind: Excitation) -> None:
    motion = _plan(kind)
    t = np.linspace(0.0, motion.duration, 100_001)
    _, v, a = motion.at(t)
    assert np.abs(np.diff(v)).max() <= 1.05 * np.abs(a).max() * t[1]


def test_limits_are_kept(kind: Excitation) -> None:
    names = {parameter.name: parameter.default for parameter in kind.parameters}
    q, v, a = (np.abs(x).max() for x in _plan(kind).at(np.linspace(0.0, _plan(kind).duration, 100_001)))
    for name, value in (("amplitude", q), ("travel", q), ("speed", v), ("speed_high", v), ("acceleration", a)):
        limit = names.get(name)
        # The fading window of the chirp adds to its acceleration where the amplitude is far from its limit only.
        assert limit is None or value <= limit * 1.001, name


def test_same_seed_same_bits_other_order_of_asking(kind: Excitation) -> None:
    t = np.linspace(0.0, 5.0, 777)
    once, again = _plan(kind).at(t), _plan(kind).at(t[::-1])
    for a, b in zip(once, again, strict=True):
        assert a == pytest.approx(b[::-1], abs=1e-12)


@pytest.mark.parametrize("name", ["multisine", "point_to_point"])
def test_other_seed_other_motion(name: str) -> None:
    t = np.linspace(0.0, 5.0, 50)
    assert not np.allclose(_plan(EXCITATIONS[name], 1).at(t).position, _plan(EXCITATIONS[name], 2).at(t).position)


def test_reversals_dwell_at_every_speed_in_both_directions() -> None:
    motion = _plan(EXCITATIONS["reversals"], speed_low=0.001, speed_high=0.1, speeds=5)
    _, v, a = motion.at(np.arange(0.0, motion.duration, 0.001))
    cruising = v[(a == 0.0) & (v != 0.0)]
    for speed in 0.001 * 10.0 ** (0.5 * np.arange(5)):
        for direction in (1.0, -1.0):
            assert np.count_nonzero(np.abs(cruising - direction * speed) < 1e-9) > 50, direction * speed


def test_steps_do_not_reverse_within_a_staircase() -> None:
    _, v, _ = (motion := _plan(EXCITATIONS["steps"])).at(np.arange(0.0, motion.duration - 0.1, 0.001))
    assert np.count_nonzero(np.diff(np.sign(v[v != 0.0]))) == 1


@pytest.mark.parametrize(
    ("name", "change", "named"),
    [
        ("multisine", {"frequency_low": 3.01, "frequency_high": 3.02, "duration": 2.0}, "no line"),
        ("reversals", {"speed_low": 1.0}, "exceeds"),
        ("reversals", {"stroke": 1e-5}, "is not reached"),
        ("chirp", {"frequency_low": 30.0}, "not below"),
        ("steps", {"travel": 1e-3}, "travel"),
    ],
)
def test_what_cannot_be_planned_is_refused_with_a_remedy(name: str, change: dict[str, float], named: str) -> None:
    with pytest.raises(ExcitationError, match=named) as refusal:
        _plan(EXCITATIONS[name], **change)
    assert refusal.value.remedy


def test_sequence_goes_through_all_with_rests() -> None:
    parts = [_plan(EXCITATIONS["multisine"], duration=2.0, ramp=0.5, frequency_low=0.5), _plan(EXCITATIONS["point_to_point"])]
    whole = Sequence(parts, delay=1.0, pause=0.5)
    assert whole.duration == pytest.approx(1.0 + 2.5 + parts[1].duration + 0.5)
    inside = np.linspace(0.1, 1.9, 50)
    assert whole.at(1.0 + inside).position == pytest.approx(parts[0].at(inside).position)
    assert whole.at(3.5 + inside).velocity == pytest.approx(parts[1].at(inside).velocity)
    outside = whole.at(np.array([-5.0, 0.5, 3.2, whole.duration + 1.0, 1e6]))
    assert all(not values.any() for values in outside)


def test_sequence_repeats() -> None:
    part = _plan(EXCITATIONS["multisine"], duration=2.0, ramp=0.5, frequency_low=0.5)
    whole = Sequence([part], delay=0.3, pause=0.2, repeat=True)
    t = np.linspace(0.0, 2.0, 40)
    assert whole.at(0.3 + 2.2 * 5 + t).position == pytest.approx(part.at(t).position, abs=1e-9)
