"""Every check: finds its fault, with the right number, and says nothing about a clean recording."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from fric.instrument import CHECKS, Evidence, Finding, inspect
from fric.model import Model, build_model, term
from fric.record import Record, Units

Write = Callable[..., Record]


def found(check: str, *records: Record, model: Model | None = None) -> Finding:
    return CHECKS[check].run(Evidence(records, model))[0]


@pytest.fixture(scope="module")
def clean(write: Write) -> Record:
    return write()


@pytest.fixture(scope="module")
def nominal() -> Model:
    return build_model("rigid", {"mass": 2.0}, [term("coulomb", force=8.0), term("viscous", coefficient=10.0)])


def test_a_clean_recording_has_neither_faults_nor_warnings(clean: Record, nominal: Model) -> None:
    findings = inspect([clean], nominal)
    assert {finding.check for finding in findings} == set(CHECKS)
    assert {finding.check: finding.detail for finding in findings if finding.verdict in {"fault", "warning"}} == {}
    assert [finding.check for finding in findings if finding.verdict == "unknown"] == ["sensor_side"]


def test_the_same_twice(clean: Record) -> None:
    assert [f.as_json() for f in inspect([clean])] == [f.as_json() for f in inspect([clean])]


@pytest.mark.parametrize("late", [-0.012, 0.004, 0.02])
def test_a_delay_has_its_size_and_its_sign(write: Write, late: float) -> None:
    finding = found("delay", write(late=late))
    assert finding.verdict == "fault"
    assert finding.value == pytest.approx(late, abs=3e-4)
    assert finding.interval is not None
    assert finding.interval[0] < finding.value < finding.interval[1]
    assert finding.correction is not None
    assert found("delay", finding.correction.apply(write(late=late))).verdict == "ok"


def test_drift_is_no_delay(write: Write) -> None:
    record = write(growth=1.5e-3)
    finding = found("clock_drift", record)
    assert finding.verdict == "fault"
    assert finding.value == pytest.approx(1500.0, rel=0.05)
    assert finding.correction is not None
    mended = finding.correction.apply(record)
    assert found("clock_drift", mended).verdict == "ok"
    assert found("delay", mended).verdict == "ok"
    assert found("clock_drift", write(late=0.01)).verdict == "ok"


def test_a_single_tone_does_not_tell_a_delay_from_damping() -> None:
    time = 1e-3 * np.arange(8000)
    angle = 2.0 * np.pi * 0.2 * time
    effort = 8.0 * np.sign(np.cos(angle)) + 0.1 * np.random.default_rng(1).standard_normal(8000)
    slow = Record(time, 0.01 * np.sin(angle), effort)
    assert found("delay", slow).verdict == "unknown"


def test_signs(clean: Record) -> None:
    wrong = replace(clean, effort=-clean.effort)
    assert found("effort_sign", wrong).verdict == "fault"
    assert found("effort_sign", wrong).value == pytest.approx(-9.5, abs=2.5)
    turned = replace(clean, position=-clean.position)
    assert found("position_sign", turned).verdict == "fault"
    assert found("effort_sign", turned).verdict == "ok"  # the reference tells that it is the position


@pytest.mark.parametrize(("factor", "name"), [(1000.0, "milli"), (2.0 * np.pi, "2 pi"), (1.0 / 60.0, "60")])
@pytest.mark.parametrize("signal", ["position", "effort"])
def test_units_against_a_model(clean: Record, nominal: Model, signal: str, factor: float, name: str) -> None:
    wrong = replace(clean, reference=None, velocity=None, **{signal: factor * getattr(clean, signal)})
    finding = found("units", wrong, model=nominal)
    assert finding.verdict == "fault"
    assert finding.value == pytest.approx(factor, rel=0.2)
    assert f"the {signal} is" in finding.detail
    assert name in finding.detail
    assert finding.correction is not None
    assert found("units", finding.correction.apply(wrong), model=nominal).verdict == "ok"


def test_a_command_far_beyond_the_limit_of_the_drive_is_no_unit(clean: Record, nominal: Model) -> None:
    """The force stays what the drive can give, whatever is asked for: no factor explains what is recorded."""
    asked = 40.0 * (1.0 + 0.9 * np.sin(2.0 * np.pi * 0.37 * clean.time) * np.sin(2.0 * np.pi * 1.1 * clean.time))
    finding = found("units", replace(clean, reference=None, velocity=None, effort=asked * clean.effort), model=nominal)
    assert finding.verdict == "warning"
    assert finding.value > 10.0
    assert "no single factor" in finding.detail


def test_a_known_gear_ratio_is_named(clean: Record, nominal: Model) -> None:
    wrong = replace(clean, reference=None, velocity=None, position=37.0 * clean.position)
    finding = CHECKS["units"].run(Evidence([wrong], nominal, {"gear_ratio": 37.0}))[0]
    assert finding.verdict == "fault"
    assert "gear ratio" in finding.detail


def test_a_drive_that_compensates_friction(clean: Record, nominal: Model) -> None:
    v = clean.velocity
    assert v is not None
    helped = replace(clean, effort=clean.effort - 7.5 * np.sign(v) - 9.0 * v)
    assert found("compensated_drive", helped, model=nominal).verdict == "fault"
    overdone = replace(clean, effort=clean.effort - 12.0 * np.sign(v) - 10.0 * v)
    assert found("compensated_drive", overdone).verdict == "fault"
    assert found("effort_sign", overdone).verdict == "ok"


def test_velocity(clean: Record) -> None:
    assert clean.velocity is not None
    degrees = found("velocity_signal", replace(clean, velocity=np.degrees(clean.velocity)))
    assert degrees.verdict == "fault"
    assert "180/pi" in degrees.detail
    late = replace(clean, velocity=np.interp(clean.time - 0.02, clean.time, clean.velocity))
    finding = found("velocity_signal", late)
    assert finding.verdict == "warning"
    assert finding.value == pytest.approx(0.02, abs=1e-3)


def test_a_velocity_that_is_repeated_is_still_that_of_the_position(clean: Record) -> None:
    """Read by a loop that gets a new value of the drive every 80 ms, and the position at other times."""
    assert clean.velocity is not None
    stale = np.arange(clean.n_samples)
    last = stale - stale % 80
    finding = found(
        "velocity_signal", replace(clean, velocity=clean.velocity[last], position=clean.position[last - last % 120])
    )
    assert finding.verdict == "warning"
    assert "only below" in finding.detail
    other = np.random.default_rng(4).standard_normal(clean.n_samples)
    finding = found("velocity_signal", replace(clean, velocity=other))
    assert finding.verdict == "warning"
    assert "not that of the position" in finding.detail


def test_a_sign_that_a_velocity_does_not_tell(clean: Record) -> None:
    other = np.random.default_rng(4).standard_normal(clean.n_samples)
    finding = found("position_sign", replace(clean, reference=None, velocity=other))
    assert finding.verdict == "unknown"
    assert "doesn't clearly move with it" in finding.detail
    still = found("position_sign", replace(clean, reference=np.zeros(clean.n_samples), velocity=None))
    assert still.detail == "the reference stands still"
    finding = found("position_sign", replace(clean, reference=None, velocity=None))
    assert finding.detail == "neither a reference nor a velocity was recorded"


def test_offset(clean: Record) -> None:
    finding = found("offset", replace(clean, effort=clean.effort + 6.0))
    assert finding.verdict == "warning"
    assert finding.value == pytest.approx(6.0, abs=0.2)
    level = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=8.0), term("bias", force=6.0)])
    assert found("offset", replace(clean, effort=clean.effort + 6.0), model=level).verdict == "ok"


def test_sampled_too_slowly(write: Write) -> None:
    slow = found("sampling", write(step=0.04))
    assert slow.verdict == "fault"
    # The fastest tone has 0.04 s * 4 Hz: about six samples in a period.
    assert 5.0 < slow.value < 10.0
    assert found("sampling", write(step=0.01)).verdict == "ok"


def test_a_folded_line(clean: Record) -> None:
    # 710 Hz at 1000 Hz shows at 290 Hz; a force of that frequency would move 2 kg by 0.45 um, half a step of the encoder.
    finding = found("aliasing", replace(clean, effort=clean.effort + 3.0 * np.sin(2.0 * np.pi * 710.0 * clean.time)))
    assert finding.verdict == "fault"
    assert "290" in finding.detail
    assert finding.value == pytest.approx(3.0, rel=0.1)


def test_stamps(clean: Record) -> None:
    random = np.random.default_rng(5)
    keep = random.uniform(size=clean.n_samples) > 0.1
    keep[0] = True
    dropped = Record(clean.time[keep], clean.position[keep], clean.effort[keep])
    finding = found("stamps", dropped)
    assert finding.verdict == "fault"
    assert finding.value == pytest.approx(0.1, abs=0.01)
    last = np.maximum.accumulate(np.where(keep, np.arange(clean.n_samples), 0))
    repeats = found("stamps", replace(clean, position=clean.position[last], effort=clean.effort[last]))
    assert repeats.verdict == "fault"
    assert repeats.value == pytest.approx(0.1, abs=0.03)


def test_samples_that_were_read_unevenly_are_not_missing(clean: Record) -> None:
    steps = np.random.default_rng(5).exponential(20.0, clean.n_samples // 25) + 3.0
    at = np.cumsum(steps.astype(int))
    at = at[at < clean.n_samples]
    finding = found("stamps", Record(clean.time[at], clean.position[at], clean.effort[at]))
    assert finding.verdict == "warning"
    assert "read unevenly" in finding.detail
    assert "missing" not in finding.detail
    assert finding.value == 0.0


def test_steps(clean: Record) -> None:
    coarse = found("resolution", replace(clean, position=np.round(clean.position / 0.01) * 0.01))
    assert coarse.verdict == "fault"
    assert "0.01 m" in coarse.detail
    effort = found("resolution", replace(clean, effort=np.round(clean.effort / 4.0) * 4.0))
    assert effort.verdict == "fault"
    assert effort.value < 16.0


def test_one_direction_and_too_short(clean: Record) -> None:
    v = clean.velocity
    assert v is not None
    rising = np.flatnonzero(v > 0.02)
    n = rising.size
    forward = Record(clean.time[:n], np.cumsum(v[rising]) * 1e-3, clean.effort[rising])
    assert found("direction", forward).verdict == "warning"  # what was recorded is what the axis did
    # Both directions in two recordings are both directions.
    falling = np.flatnonzero(v < -0.02)
    m = falling.size
    backward = Record(clean.time[:m], np.cumsum(v[falling]) * 1e-3, clean.effort[falling])
    assert found("direction", forward, backward).verdict == "ok"
    assert found("length", clean.between(2.0, 2.1)).verdict == "warning"
    assert found("length", clean).verdict == "ok"


def test_not_excited(clean: Record) -> None:
    rest = replace(clean, position=np.full(clean.n_samples, 0.1), velocity=None, reference=None)
    assert found("excitation", rest).verdict == "warning"
    time = 1e-3 * np.arange(10_000)
    triangle = 0.05 * np.abs((time + 1.0) % 4.0 - 2.0)
    direction = np.sign(np.gradient(triangle))
    one_speed = Record(time, triangle, 8.0 * direction + 0.1 * np.random.default_rng(2).standard_normal(time.size))
    finding = found("excitation", one_speed)
    assert finding.verdict == "warning"
    assert finding.value < 4
    assert "Coulomb friction and viscous friction" in finding.detail


def test_missing_and_frozen(clean: Record) -> None:
    assert found("frozen", replace(clean, effort=np.zeros(clean.n_samples))).verdict == "fault"
    effort = clean.effort.copy()
    effort[5000:5300] = effort[5000]
    finding = found("frozen", replace(clean, effort=effort))
    assert finding.verdict == "fault"
    assert finding.value == pytest.approx(0.3, abs=0.01)
    assert finding.time[0][0] == pytest.approx(5.0)


def test_saturated_sensor_and_drive_at_its_limit(clean: Record) -> None:
    top = 0.7 * float(np.max(np.abs(clean.effort)))
    clipped = found("saturation", replace(clean, effort=np.clip(clean.effort, -top, top)))
    assert clipped.verdict == "fault"
    assert clipped.time


def test_a_noisy_force_that_is_level_at_its_limit_is_cut_off_at_constant_speed_too() -> None:
    rng = np.random.default_rng(6)
    time = 2e-3 * np.arange(20_000)
    stroke = np.where(time % 8.0 < 4.0, 1.0, -1.0)
    speed = (
        stroke
        * (0.3 + 0.2 * np.floor(time / 8.0) / 4.0)
        * np.clip((time % 4.0) / 0.2, 0.0, 1.0)
        * np.clip((4.0 - time % 4.0) / 0.2, 0.0, 1.0)
    )
    position = np.cumsum(speed) * 2e-3
    force = 10.0 * np.gradient(speed, 2e-3) + 8.0 * np.tanh(speed / 1e-3) + 40.0 * speed + 0.3 * rng.standard_normal(time.size)
    free = Record(time, position, force)
    assert found("saturation", free).verdict == "ok"
    finding = found("saturation", replace(free, effort=np.clip(force, -24.0, 24.0)))
    assert finding.verdict in {"warning", "fault"}
    assert "24" in finding.detail
    assert finding.value > 0.2


def test_two_sensors(clean: Record) -> None:
    assert clean.velocity is not None
    load = clean.position - 5e-4 * np.sign(clean.velocity)
    other = found("sensor_side", replace(clean, extra={"load_position": load}))
    assert other.verdict == "warning"
    assert other.value == pytest.approx(1e-3, rel=0.2)
    assert found("sensor_side", replace(clean, extra={"load_position": clean.position})).verdict == "ok"


def test_a_velocity_of_the_same_instant_is_in_order_however_the_recording_ends(write: Write) -> None:
    record = write(duration=9.0)
    for end in (7.5, 8.0, 8.5):
        finding = found("velocity_signal", record.between(0.0, end))
        assert finding.verdict == "ok"
        assert finding.value == pytest.approx(1.0, abs=0.01)
    # A single tone late by a whole period is not late.
    time = 1e-3 * np.arange(8000)
    tone = Record(time, 0.1 * np.sin(time), np.cos(time) + 0.01 * np.random.default_rng(1).standard_normal(8000))
    assert found("velocity_signal", replace(tone, velocity=0.1 * np.cos(time))).verdict == "ok"


@pytest.mark.parametrize("constant", [12.5, 3.3, 28.0])
def test_a_factor_that_is_none_of_the_known_ones_is_not_called_one(clean: Record, nominal: Model, constant: float) -> None:
    current = replace(clean, reference=None, velocity=None, effort=clean.effort / constant)
    finding = found("units", current, model=nominal)
    assert finding.verdict == "fault"
    assert finding.value == pytest.approx(1.0 / constant, rel=0.03)
    assert finding.interval is not None
    assert finding.interval[0] < 1.0 / constant < finding.interval[1]
    assert "a current without its torque constant" in finding.detail
    assert "a likely reason" not in finding.detail


def test_an_effort_that_never_changes_may_be_right(clean: Record) -> None:
    time = 1e-3 * np.arange(4000)
    pushed = Record(time, 0.5 * time**2, np.full(4000, 3.0))
    assert found("frozen", pushed).verdict == "unknown"
    coasting = Record(time, 1.0 - np.exp(-time), np.zeros(4000))
    assert found("frozen", coasting).verdict == "unknown"
    assert found("frozen", replace(clean, effort=np.zeros(clean.n_samples))).verdict == "fault"


def test_the_weight_of_an_arm_is_told_from_friction() -> None:
    rng = np.random.default_rng(4)
    time = 5e-3 * np.arange(8000)
    angle = 1.4 * np.sin(0.7 * time) + 0.8 * np.sin(1.9 * time + 1.0)
    speed, acceleration = np.gradient(angle, 5e-3), np.gradient(np.gradient(angle, 5e-3), 5e-3)
    torque = 0.05 * acceleration + 0.4 * np.sign(speed) + 0.1 * speed + 0.02 * rng.standard_normal(time.size)
    level = Record(time, angle, torque, units=Units("rad", "N m"))
    hanging = replace(level, effort=torque + 3.3 * np.sin(angle + 0.3))
    assert "weight" not in found("offset", level).detail
    finding = found("offset", hanging)
    assert finding.verdict == "ok"
    assert "weight" in finding.detail
    assert "3.3" in finding.detail
    # Without it the friction along the motion would be anything.
    for record in (level, hanging):
        assert found("effort_sign", record).value == pytest.approx(0.4 + 0.1 * float(np.mean(np.abs(speed))), rel=0.1)
    # Along a line there are no arms.
    assert "weight" not in found("offset", replace(hanging, units=Units("m", "N"))).detail
