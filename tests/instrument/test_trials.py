"""A few of the recordings of ``fric bench instrument``, by other seeds."""

from __future__ import annotations

from dataclasses import replace

import pytest
from fric.instrument import CHECKS, Evidence
from fric.instrument.trials.axes import draw_rig, record_of, run_rig
from fric.instrument.trials.faults import FAULTS, Fault
from fric.instrument.trials.score import false_alarms, ordinary_alarms


def test_every_check_that_a_recording_alone_can_fail_has_a_fault() -> None:
    assert set(CHECKS) - {fault.check for fault in FAULTS} == {"sensor_side"}


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_the_fault_is_found(fault: Fault) -> None:
    trial = fault.make(404)
    findings = CHECKS[fault.check].run(Evidence(trial.records, trial.model))
    assert any(finding.verdict in fault.verdicts for finding in findings), findings


@pytest.mark.long
def test_clean_recordings_raise_no_alarm() -> None:
    wrong, _ = false_alarms(range(30_000, 30_012))
    assert wrong == []


def test_a_loop_at_its_margin_vibrates_faster_than_its_samples_show() -> None:
    rig = draw_rig(30_009, "two masses", "graded_rests")
    # With about twice its damping the motor oscillates at 90 Hz, of which 400 Hz keep four samples.
    vibrating = replace(rig, gains=(3.5 * rig.gains[0], 1.9 * rig.gains[1]))
    verdicts = []
    for each in (rig, vibrating):
        record = record_of(each, run_rig(each), 30_009)
        verdicts.append(CHECKS["sampling"].run(Evidence((record,), None))[0].verdict)
    assert verdicts == ["ok", "fault"]


@pytest.mark.long
def test_ordinary_recordings_have_no_fault() -> None:
    said = ordinary_alarms(range(30_000, 30_042))  # every kind three times
    assert said.faults == ()
    # A false warning in one of ten would be many.
    assert sum(said.warnings.values()) < 0.2 * said.trials


@pytest.mark.long
def test_more_ordinary_recordings_have_hardly_a_fault() -> None:
    said = ordinary_alarms(range(31_000, 31_280))
    assert said.wrong <= 0.01 * said.trials, said.faults
