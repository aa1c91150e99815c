"""Two recordings of one excitation: the offset and ratio of their clocks, how much they differ, and where."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from fric.bagio import write_record
from fric.diagnosis.align import Alignment
from fric.diagnosis.compare import CompareError, compare
from fric.errors import InputError
from fric.record import Array, Record, Units
from fric.report.compare import comparison_report
from fric_nodes.cli.main import build_app
from typer.testing import CliRunner

OFFSET, RATIO = 0.371234, 1.0003


def place(time: Array) -> Array:
    """Position [m] of a motion that does not repeat itself."""
    return np.asarray(
        sum(a * np.sin(2.0 * np.pi * f * time + p) for a, f, p in ((0.05, 0.31, 0.2), (0.02, 1.07, 1.0), (0.004, 3.3, 2.0)))
    )


def force(time: Array) -> Array:
    """Effort [N] of the motion: 2 kg, 20 N s/m and 8 N."""
    h = 1e-5
    v = (place(time + h) - place(time - h)) / (2.0 * h)
    a = (place(time + h) - 2.0 * place(time) + place(time - h)) / h**2
    return np.asarray(2.0 * a + 20.0 * v + 8.0 * np.tanh(v / 1e-3))


def simulated(seconds: float = 20.0, rate: float = 1000.0) -> Record:
    time = np.arange(int(seconds * rate)) / rate
    return Record(time, place(time), force(time), source="simulated")


def real(first: float = 2.0, seconds: float = 12.0, rate: float = 800.0, noise: float = 1e-6) -> Record:
    """A part of the same, by another clock that was started ``first`` seconds later, with noise."""
    time = np.arange(int(seconds * rate)) / rate
    there = (time - OFFSET) / RATIO + first
    random = np.random.default_rng(5)
    return Record(
        time,
        place(there) + noise * random.standard_normal(time.size),
        force(there) + 0.2 * random.standard_normal(time.size),
        source="real",
    )


def test_offset_and_ratio_of_the_clocks_are_found_between_the_samples() -> None:
    found = compare(simulated(), real())
    expected = OFFSET - RATIO * 2.0
    assert found.clocks.offset == pytest.approx(expected, abs=1e-5)
    assert found.clocks.ratio == pytest.approx(RATIO, abs=2e-6)
    assert abs(found.clocks.offset - expected) < 4.0 * found.clocks.offset_error
    assert abs(found.clocks.ratio - RATIO) < 4.0 * found.clocks.ratio_error
    assert found.clocks.offset_error < 1e-5
    held = {each.signal: each for each in found.agreements}
    assert held["position"].rmse == pytest.approx(1e-6, rel=0.1)
    assert held["effort"].rmse == pytest.approx(0.2, rel=0.15)


def test_the_figures_are_those_of_their_definitions_and_the_regime_is_found() -> None:
    machine = real()
    rate = np.gradient(machine.position, machine.sample_time)
    more = 3.0 * (np.abs(rate) < 0.03) * np.sign(rate)
    worn = Record(machine.time, machine.position, machine.effort + more, source="real")
    found = compare(simulated(), worn)
    effort = next(each for each in found.agreements if each.signal == "effort")
    measured, model = found.signals["effort"]
    off, spread = model - measured, measured - np.mean(measured)
    assert effort.noe == pytest.approx(100.0 * np.sum(off**2) / np.sum(spread**2))
    assert effort.rmse == pytest.approx(np.sqrt(np.mean(off**2)))
    assert effort.rmse > 0.5
    assert found.located_by == "effort"
    assert found.where is not None
    assert found.where.quantity == "speed"
    assert found.where.range[1] == pytest.approx(0.03, rel=0.35)


def drifting(more: float) -> Record:
    """A free run of a model with too little friction: it has the force of the real one, and moves further and further away."""
    time = np.arange(12_000) / 1000.0
    return Record(time, place(time) + more * (0.1 * time**2 + 0.3 * np.sin(0.9 * time)), force(time), source="simulated")


def test_what_the_recordings_do_not_determine_is_not_stated() -> None:
    """An error of the free run that grows to many times the travel: no share of it, and no time shift to a millisecond."""
    found = compare(drifting(0.05), real(first=0.0))
    position = next(each for each in found.agreements if each.signal == "position")
    assert position.noe > 1000.0
    assert not position.is_share
    assert found.drifts
    assert f"{position.noe:.3g} %" not in found.sentence
    assert "the position drifts" in found.sentence
    assert not found.clocks.ratio_told
    assert found.clocks.ratio_in_words.startswith("cannot be told from this recording")
    assert found.report()["clock_ratio"]["determined"] is False  # type: ignore[index]
    page = comparison_report(found)
    assert f"{position.noe:.3g} %" not in page
    assert "no share is stated" in page
    sure = compare(simulated(), real())
    assert sure.clocks.offset_told
    assert sure.clocks.ratio_told
    assert not sure.drifts


def test_efforts_align_where_the_motion_drifts_away() -> None:
    found = compare(drifting(0.2), real(first=0.0))
    assert found.clocks.by_effort
    # At the middle of the recording, since the ratio of the clocks is not told.
    assert found.clocks.offset == pytest.approx(OFFSET + 6.0 * (RATIO - 1.0), abs=2.5e-3)
    effort = next(each for each in found.agreements if each.signal == "effort")
    assert effort.noe < 1.0


def test_an_offset_that_is_wider_than_the_motion_is_not_stated() -> None:
    wide = Alignment(0.2, 0.7, 1.0, 1e-5, motion_time=0.05)
    assert not wide.offset_told
    assert wide.offset_in_words.startswith("cannot be told from this recording")
    assert "0.7" not in wide.offset_in_words
    assert "± 1.4 s" in Alignment(0.2, 0.7, 1.0, 1e-5, motion_time=20.0).offset_in_words


def test_what_cannot_be_compared_is_refused() -> None:
    other = real()
    random = np.random.default_rng(2)
    walk = np.cumsum(np.cumsum(random.standard_normal(other.time.size))) * 1e-7
    cases = (
        (Record(other.time, walk - walk[0], other.effort, source="real"), "no motion in common"),
        (Record(other.time, np.zeros(other.time.size), other.effort, source="real"), "nothing but rest"),
        (Record(other.time, other.position, other.effort, units=Units("rad", "N m"), source="real"), "positions in m and rad"),
        (real(seconds=0.5), "is 0.5 s long"),
    )
    for record, reason in cases:
        with pytest.raises(CompareError, match=reason) as caught:
            compare(simulated(), record)
        assert "\n" not in str(caught.value)


def test_without_effort_the_motion_is_compared_and_it_is_said() -> None:
    still = Record(real().time, real().position, np.zeros(real().time.size), source="real")
    found = compare(simulated(), still)
    assert [each.signal for each in found.agreements] == ["position", "velocity"]
    assert found.notes[0] == "effort was left out: real has no effort that changes"


def test_the_command_writes_a_page_and_a_report(tmp_path: Path) -> None:
    first, second = (write_record(record, tmp_path / name) for record, name in ((simulated(8.0), "a"), (real(1.0, 5.0), "b")))
    out = tmp_path / "out"
    result = CliRunner().invoke(build_app(), ["compare", str(first), str(second), "--out", str(out), "--json"])
    assert result.exit_code == 0, result.output
    printed = json.loads(result.stdout)
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert printed == report
    assert report["format"] == "fric-comparison/1"
    low, high = report["offset"]["interval"]
    assert low < report["offset"]["value"] < high
    page = (out / "report.html").read_text(encoding="utf-8")
    assert report["verdict"][:40] in page
    with pytest.raises(InputError):
        build_app()(["compare", str(first), str(tmp_path / "none")], standalone_mode=False)
