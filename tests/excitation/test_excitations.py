"""Every excitation of the catalogue, whatever it is: consistent derivatives, rest at both ends, limits, repeatability."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fric.excitation import EXCITATIONS
from fric.excitation.sequence import Sequence
from fric.excitation_kind import OUTPUTS, Excitation, ExcitationError, Trajectory

PLANNED = {name: kind for name, kind in EXCITATIONS.items() if kind.plan is not None}
MJ = 10.0 / 3.0**0.5  # largest acceleration of a minimum-jerk move, times T^2 over its way
PEAKS = {  # position, velocity, acceleration at the default values, by hand
    "ramps": (0.02, 0.05, 1.5 * 0.05 / 0.05),
    "slow_triangles": (0.001, 0.001, 1.5 * 0.002 / 0.02),
    "stick_slip_ramp": (0.01, 0.01, 1.5 * 0.01 / 0.05),
    "presliding_loops": (1e-5, 5e-5, MJ * (5e-5 * 0.1 / 1.875) / 0.1**2),
    "free_decay": (50.0, 1.875 * 50.0 / 0.005, MJ * 50.0 / 0.005**2),
    "prbs": (0.001, 1.875 * 0.002 / 0.03, MJ * 0.002 / 0.03**2),
    "velocity_ladder": (0.05, 0.1, 2.0),
    "graded_rests": (0.002, 0.005, 1.5 * 0.005 / 0.05),
    "recorded": (0.1, 0.3, 0.9),
}


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A reference of 0.1 sin 3t, starting and ending in full motion."""
    t = np.arange(0.0, 6.0, 0.01)
    file = tmp_path_factory.mktemp("recorded") / "motion.csv"
    np.savetxt(file, np.stack([t, 0.1 * np.sin(3.0 * t)], axis=1), delimiter=",", header="time,reference", comments="")
    return file


def _plan(kind: Excitation, table: Path | None = None, seed: int = 3, **changes: float) -> Trajectory:
    values = {parameter.name: parameter.default for parameter in kind.parameters}
    assert None not in values.values(), "every parameter has a default"
    texts = {text.name: text.default for text in kind.texts}
    if "file" in texts:
        texts["file"] = str(table)
    return kind.part({**values, **changes}, texts, np.random.default_rng(seed))  # type: ignore[dict-item, return-value]


@pytest.fixture(params=PLANNED)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def motion(name: str, table: Path) -> Trajectory:
    return _plan(EXCITATIONS[name], table)


def test_catalogue_is_what_the_folder_holds() -> None:
    asked_for = {"multisine", "chirp", "steps", "ramps", "slow_triangles", "stick_slip_ramp", "presliding_loops", "free_decay"}
    asked_for |= {"parametric_oscillation", "prbs", "velocity_ladder", "graded_rests", "recorded"}
    assert set(EXCITATIONS) >= asked_for | {"point_to_point", "reversals"}
    for kind in EXCITATIONS.values():
        assert (kind.plan is None) != (kind.answer is None), kind.id
        assert set(kind.outputs) <= set(OUTPUTS)
        assert kind.outputs
        assert len(kind.shows) > 20


def test_starts_and_ends_at_rest_at_zero(motion: Trajectory) -> None:
    q, v, a = motion.at(np.array([0.0, motion.duration]))
    for values in (q, v, a):
        assert values == pytest.approx([0.0, 0.0], abs=1e-9)


def test_velocity_and_acceleration_are_the_derivatives(motion: Trajectory) -> None:
    random = np.random.default_rng(0)
    t = random.uniform(0.001, motion.duration - 0.001, 4000)
    h = 1e-5
    before, here, after = (motion.at(t + shift) for shift in (-h, 0.0, h))
    slope = (after.position - before.position) / (2.0 * h)
    curve = (after.velocity - before.velocity) / (2.0 * h)
    assert np.abs(slope - here.velocity).max() < 1e-4 * np.abs(here.velocity).max()
    assert np.abs(curve - here.acceleration).max() < 5e-3 * np.abs(here.acceleration).max()


def test_velocity_never_jumps(motion: Trajectory) -> None:
    t = np.linspace(0.0, motion.duration, 100_001)
    _, v, a = motion.at(t)
    assert np.abs(np.diff(v)).max() <= 1.05 * np.abs(a).max() * t[1]


def test_limits_are_kept(name: str, motion: Trajectory) -> None:
    names = {parameter.name: parameter.default for parameter in EXCITATIONS[name].parameters}
    q, v, a = (np.abs(x).max() for x in motion.at(np.linspace(0.0, motion.duration, 100_001)))
    for limited, value in (("amplitude", q), ("travel", q), ("speed", v), ("speed_high", v), ("acceleration", a)):
        limit = names.get(limited)
        # The fading window of the chirp adds to its acceleration where the amplitude is far from its limit only.
        assert limit is None or value <= limit * 1.001, limited


@pytest.mark.parametrize("of", PEAKS)
def test_peaks_are_those_of_the_values(of: str, table: Path) -> None:
    motion = _plan(EXCITATIONS[of], table)
    t = np.linspace(0.0, motion.duration, 1_000_001)
    if of == "recorded":
        t = t[(t > 1.0) & (t < motion.duration - 1.0)]  # without the lead, which is faster
    for value, peak in zip(motion.at(t), PEAKS[of], strict=True):
        assert 0.98 * peak <= np.abs(value).max() <= 1.0005 * peak


def test_same_seed_same_bits_other_order_of_asking(name: str, table: Path) -> None:
    t = np.linspace(0.0, 5.0, 777)
    kind = EXCITATIONS[name]
    once, again = _plan(kind, table).at(t), _plan(kind, table).at(t[::-1])
    for a, b in zip(once, again, strict=True):
        assert a == pytest.approx(b[::-1], abs=1e-12)


@pytest.mark.parametrize("of", ["multisine", "point_to_point", "prbs", "graded_rests"])
def test_other_seed_other_motion(of: str) -> None:
    t = np.linspace(0.0, 5.0, 50)
    kind = EXCITATIONS[of]
    assert not np.allclose(_plan(kind, seed=1).at(t).position, _plan(kind, seed=2).at(t).position)


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
    ("of", "change", "named"),
    [
        ("ramps", {"speed_low": 1.0}, "exceeds"),
        ("ramps", {"height": 1e-4}, "is not reached"),
        ("slow_triangles", {"corner_time": 10.0}, "no straight part"),
        ("stick_slip_ramp", {"rate_low": 1.0}, "exceeds"),
        ("stick_slip_ramp", {"return_rate": 1.0}, "is not reached"),
        ("presliding_loops", {"amplitude_low": 1.0}, "exceeds"),
        ("free_decay", {"force_low": 100.0}, "exceeds"),
        ("prbs", {"edge_time": 0.06}, "longer than clock"),
        ("velocity_ladder", {"speed_low": 1.0}, "exceeds"),
        ("velocity_ladder", {"travel": 0.01}, "to measure"),
        ("graded_rests", {"rest_low": 10.0}, "exceeds"),
        ("graded_rests", {"stroke": 1e-4}, "is not reached"),
        ("multisine", {"frequency_low": 3.01, "frequency_high": 3.02, "duration": 2.0}, "no line"),
        ("reversals", {"speed_low": 1.0}, "exceeds"),
        ("reversals", {"stroke": 1e-5}, "is not reached"),
        ("chirp", {"frequency_low": 30.0}, "not below"),
        ("steps", {"travel": 1e-3}, "travel"),
    ],
)
def test_what_cannot_be_planned_is_refused_with_a_remedy(of: str, change: dict[str, float], named: str) -> None:
    with pytest.raises(ExcitationError, match=named) as refusal:
        _plan(EXCITATIONS[of], **change)
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
