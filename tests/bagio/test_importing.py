"""Files of other programs, made here with the programs' own libraries, imported by a mapping."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from fric.bagio import BagError, ImportingError, import_recording, load_mapping, read_record, write_record
from fric.importers.units import unit
from fric.record import Record, Units
from scipy.io import savemat

N = 50
TIME = np.arange(N) * 0.01
POSITION_MM = np.linspace(0.0, 20.0, N)
VOLTS = np.cos(TIME)
MAP: dict[str, Any] = {
    "joint": "slide",
    "time": {"from": "t", "unit": "s"},
    "position": {"from": "x", "unit": "mm"},
    "effort": {"from": "u", "scale": 10.0, "offset": 1.0, "unit": "N"},
}


def check(record: Record) -> None:
    np.testing.assert_allclose(record.time, TIME, atol=1e-9)
    np.testing.assert_allclose(record.position, POSITION_MM / 1000.0, atol=1e-7)
    np.testing.assert_allclose(record.effort, 10.0 * VOLTS + 1.0, atol=1e-5)
    assert (record.joint, record.units) == ("slide", Units("m", "N"))


def table(path: Path, separator: str = ",", decimal: str = ".", head: str = "t,x,u\n", rows: int = N) -> Path:
    lines = []
    for k in range(rows):
        numbers = [f"{value:.7f}".replace(".", decimal) for value in (TIME[k], POSITION_MM[k], VOLTS[k])]
        lines.append(separator.join(numbers))
    path.write_text(head.replace(",", separator) + "\n".join(lines) + "\n", encoding="utf-8")
    return path


# Every kind of file


def test_mat_with_scale_from_a_variable(tmp_path: Path) -> None:
    file = tmp_path / "a.mat"
    savemat(file, {"t": TIME[:, None], "x": POSITION_MM[None, :], "u": VOLTS, "gain": 10.0, "name": "rig"})
    check(import_recording(file, {**MAP, "effort": {"from": "u", "scale": "gain", "offset": 1, "unit": "N"}}))
    turned = import_recording(file, {**MAP, "effort": {"from": "u", "scale": "-gain", "unit": "N"}})
    np.testing.assert_allclose(turned.effort, -10.0 * VOLTS)


def test_mat_matrix_and_struct(tmp_path: Path) -> None:
    file = tmp_path / "a.mat"
    savemat(file, {"log": {"t": TIME, "data": np.stack([POSITION_MM, VOLTS], axis=1)}})
    mapping = {
        **MAP,
        "time": {"from": "log.t", "unit": "s"},
        "position": {"from": "log.data[0]", "unit": "mm"},
        "effort": {"from": "log.data[1]", "scale": 10, "offset": 1, "unit": "N"},
    }
    check(import_recording(file, mapping))


def test_mat_73_is_named(tmp_path: Path) -> None:
    file = tmp_path / "a.mat"
    file.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512) + b"\x89HDF\r\n\x1a\n")
    with pytest.raises(ImportingError, match=r"is a MATLAB 7.3 file .*; save it in MATLAB with save\(FILE, '-v7'\)"):
        import_recording(file, MAP)


def test_npz(tmp_path: Path) -> None:
    file = tmp_path / "a.npz"
    np.savez(file, t=TIME, x=POSITION_MM, u=VOLTS, gain=10.0)
    check(import_recording(file, {**MAP, "effort": {"from": "u", "scale": "gain", "offset": 1, "unit": "N"}}))


def test_parquet_with_dates(tmp_path: Path) -> None:
    file = tmp_path / "a.parquet"
    stamps = np.datetime64("2024-05-01T12:00:00", "ns") + (TIME * 1e9).round().astype("timedelta64[ns]")
    pq.write_table(pa.table({"t": stamps, "x": POSITION_MM, "u": VOLTS}), file)
    check(import_recording(file, MAP))


@pytest.mark.parametrize(
    ("separator", "decimal"), [(",", "."), *((separator, decimal) for separator in ";\t |" for decimal in ".,")]
)
def test_text_in_many_hands(tmp_path: Path, separator: str, decimal: str) -> None:
    check(import_recording(table(tmp_path / "a.csv", separator, decimal), MAP))


def test_text_without_header_by_number(tmp_path: Path) -> None:
    mapping = {
        **MAP,
        "time": {"from": 0, "unit": "s"},
        "position": {"from": 1, "unit": "mm"},
        "effort": {"from": "2", "scale": 10, "offset": 1, "unit": "N"},
    }
    check(import_recording(table(tmp_path / "a.txt", head=""), mapping))
    check(import_recording(table(tmp_path / "b.txt"), mapping))


def test_text_with_lines_before_and_units_below_the_header(tmp_path: Path) -> None:
    head = 'Date:,2020-01-01\nSampling,10,ms,fast\n"Rig ""A""",1\nt,x,u\ns,mm,V\n'
    check(import_recording(table(tmp_path / "a.csv", head=head), MAP))


def test_text_options(tmp_path: Path) -> None:
    file = table(tmp_path / "a.csv", ";", ",", head="9,9,9\nt,x,u\n")
    check(import_recording(file, {**MAP, "delimiter": ";", "decimal": ",", "skip_rows": 1, "header": True}))
    check(import_recording(file, MAP, delimiter=";", decimal=",", skip_rows=1, header=True))


def test_windows_text(tmp_path: Path) -> None:
    file = table(tmp_path / "a.csv")
    file.write_bytes(b"\xef\xbb\xbf" + file.read_bytes().replace(b"\n", b"\r\n"))
    check(import_recording(file, MAP))


def test_signals_from_several_files(tmp_path: Path) -> None:
    table(tmp_path / "a.csv")
    (tmp_path / "more").mkdir()
    table(tmp_path / "more" / "b.csv", head="time,where,volts\n")
    effort = {"from": "volts", "scale": 10, "offset": 1, "unit": "N", "file": "more/b.csv"}
    check(import_recording(tmp_path / "a.csv", {**MAP, "effort": effort}))
    table(tmp_path / "more" / "b.csv", head="time,where,volts\n", rows=N - 1)
    with pytest.raises(
        ImportingError, match=f"signal 'position' has {N} samples, time has {N - 1}|has {N - 1} samples, time has {N}"
    ):
        import_recording(tmp_path / "a.csv", {**MAP, "effort": effort})


# Signals and units


def test_a_signal_less_another(tmp_path: Path) -> None:
    """A load cell that feels a pressure on a bore, too: in another unit and from another file."""
    file = table(tmp_path / "a.csv")
    (tmp_path / "b.csv").write_text("p\n" + "\n".join(f"{0.1 * k}" for k in range(N)) + "\n")
    minus = {"from": "p", "file": "b.csv", "scale": 2.0, "unit": "kN"}
    record = import_recording(file, {**MAP, "effort": {**MAP["effort"], "minus": minus}})
    np.testing.assert_allclose(record.effort, 10.0 * VOLTS + 1.0 - 200.0 * np.arange(N), atol=1e-5)
    for wrong, message in (
        ({"from": "p", "file": "b.csv", "unit": "A"}, "in N, what is taken away 50 in A"),
        ({"from": "p", "file": "b.csv", "unit": "mm"}, "no unit of force or torque"),
        ({"from": "q", "file": "b.csv", "unit": "N"}, "not there"),
    ):
        with pytest.raises(ImportingError, match=message):
            import_recording(file, {**MAP, "effort": {**MAP["effort"], "minus": wrong}})


def test_all_signals_and_a_period_for_time(tmp_path: Path) -> None:
    file = tmp_path / "a.npz"
    np.savez(file, x=POSITION_MM, u=VOLTS, v=np.full(N, 60.0), k=np.full(N, 300.0), f=np.full(N, 2.0), p=np.full(N, 6.0))
    mapping = {
        "time": {"period": 10, "unit": "ms"},
        "position": {"from": "x", "unit": "deg"},
        "velocity": {"from": "v", "unit": "rpm"},
        "reference": {"from": "x", "unit": "rev", "scale": -1},
        "effort": {"from": "u", "unit": "A"},
        "normal_load": {"from": "f", "unit": "kN"},
        "temperature": {"from": "k", "unit": "K"},
        "extra": {"pressure": {"from": "p", "unit": "bar"}, "side_force": {"from": "f", "unit": "mN"}},
        "effort_hold": "linear",
    }
    record = import_recording(file, mapping)
    np.testing.assert_allclose(record.time, TIME, atol=1e-12)
    np.testing.assert_allclose(record.position[-1], 20.0 * np.pi / 180.0)
    np.testing.assert_allclose(record.reference[-1], -20.0 * 2 * np.pi)  # type: ignore[index]
    np.testing.assert_allclose(record.velocity, 2 * np.pi)  # type: ignore[arg-type]
    np.testing.assert_array_equal(record.effort, VOLTS)
    first = {name: signal[0] for name, signal in record.extra.items()}
    assert first == pytest.approx({"normal_load": 2000.0, "temperature": 26.85, "pressure": 6e5, "side_force": 0.002})
    assert (record.units, record.effort_hold) == (Units("rad", "A"), "linear")


@pytest.mark.parametrize(
    ("text", "si", "factor"),
    [
        ("mm", "m", 1e-3),
        ("um", "m", 1e-6),
        ("\u00b5m", "m", 1e-6),
        ("\u03bcm", "m", 1e-6),
        ("nm", "m", 1e-9),
        ("Nm", "N m", 1.0),
        ("N m", "N m", 1.0),
        ("mN m", "N m", 1e-3),
        ("mN·m", "N m", 1e-3),
        ("N*mm", "N m", 1e-3),
        ("kN", "N", 1e3),
        ("uN", "N", 1e-6),
        ("°", "rad", 0.017453292519943295),
        ("rpm", "rad/s", 0.10471975511965978),
        ("mm/min", "m/s", 1.6666666666666667e-05),
        ("us", "s", 1e-6),
    ],
)
def test_units(text: str, si: str, factor: float) -> None:
    found = unit(text)
    assert found is not None
    assert (found.si, found.factor) == (si, pytest.approx(factor))


def test_velocity_is_integrated_when_there_is_no_position(tmp_path: Path) -> None:
    file = tmp_path / "a.npz"
    np.savez(file, t=TIME, v=2.0 * TIME, u=VOLTS)
    mapping = {**MAP, "velocity": {"from": "v", "unit": "m/s"}}
    del mapping["position"]
    record = import_recording(file, mapping)
    np.testing.assert_allclose(record.position, TIME**2, atol=1e-12)  # the rule is exact for a straight line
    assert any("velocity integrated" in note for note in record.notes)


def test_import_to_a_bag_and_back(tmp_path: Path) -> None:
    record = import_recording(table(tmp_path / "a.csv"), MAP)
    check(read_record(write_record(record, tmp_path / "bag")))


# What does not fit


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"position": {"from": "xx", "unit": "mm"}},
            "'position' is to come from 'xx', which is not there.*columns there: t, x, u",
        ),
        ({"position": {"from": 3, "unit": "mm"}}, "is to come from '3', which is not there"),
        (
            {"position": {"from": "x", "unit": "N"}},
            "'position' has the unit 'N', which is no unit of length or angle; use one of m,",
        ),
        ({"effort": {"from": "u", "unit": "mm"}}, "'effort' has the unit 'mm', which is no unit of force or torque"),
        ({"effort": {"from": "u", "unit": ""}}, "'effort' has the unit ''"),
        (
            {"effort": {"from": "u", "unit": "N", "scale": "gain"}},
            "scale of signal 'effort' is 'gain', which is no scalar variable",
        ),
        ({"velocity": {"from": "u", "unit": "rad/s"}}, "position is in m but velocity in a unit of rad"),
        ({"extra": {"position": {"from": "u", "unit": "V"}}}, "extra signal has the name of a usual one: position"),
        ({"postion": {"from": "x", "unit": "mm"}}, "unknown key 'postion', the closest is 'position'"),
        ({"effort": {"from": "u", "unit": "N", "factor": 2}}, "unknown key 'effort.factor'.*allowed here: from, unit, scale"),
        ({"effort": {"from": "u"}}, "key 'effort.unit' is missing"),
        ({"time": {"period": 0, "unit": "s"}}, "time.period: .*greater than 0"),
        ({"time": {"from": "t"}}, "key 'time.unit' is missing"),
        ({"effort": {"from": "u", "unit": "N", "scale": float("nan")}}, "effort.scale"),
        ({"position": None}, "a position or a velocity is needed"),
        ({"effort": {"from": "u", "unit": "N", "file": "none.csv"}}, "none.csv: is not there"),
    ],
)
def test_mapping_that_does_not_fit(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    with pytest.raises(ImportingError, match=message) as caught:
        import_recording(table(tmp_path / "a.csv"), {**MAP, **change})
    assert "\n" not in str(caught.value)


def test_mapping_from_yaml_names_the_line(tmp_path: Path) -> None:
    text = "joint: slide\ntime: {from: t, unit: s}\nposition: {from: x, unit: mm}\n"
    text += "effort:\n  from: u\n  scale: 10\n  offset: 1\n  unit: N\n"
    good = tmp_path / "map.yaml"
    good.write_text(text)
    check(import_recording(table(tmp_path / "a.csv"), good))
    bad = tmp_path / "bad.yaml"
    bad.write_text(text.replace("scale:", "scael:"))
    with pytest.raises(ImportingError, match=r"bad.yaml: line 6: unknown key 'effort.scael', the closest is 'scale'"):
        load_mapping(bad)
    bad.write_text("time: {from: t\nposition")
    with pytest.raises(ImportingError, match=r"bad.yaml: line \d+: not YAML"):
        load_mapping(bad)
    bad.write_text("just words")
    with pytest.raises(ImportingError, match="holds no mapping"):
        load_mapping(bad)
    with pytest.raises(ImportingError, match="mapping cannot be read"):
        load_mapping(tmp_path / "none.yaml")


@pytest.mark.parametrize("name", ["a.mat", "a.npz", "a.parquet", "a.csv", "a.xlsx"])
@pytest.mark.parametrize("content", [b"", b"no numbers in here at all\n" * 30])
def test_files_that_are_not_what_they_say(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ImportingError) as caught:
        import_recording(tmp_path / name, MAP)
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)


def test_cell_that_is_no_number(tmp_path: Path) -> None:
    file = table(tmp_path / "a.csv")
    lines = file.read_text().splitlines()
    lines[10] = "0.09,broken,0.5"
    file.write_text("\n".join(lines))
    with pytest.raises(ImportingError, match="column 'x', line 11: 'broken' is not a number"):
        import_recording(file, MAP)


def test_checks_of_bags_hold_for_files(tmp_path: Path) -> None:
    position, time = POSITION_MM.copy(), TIME.copy()
    position[7] = np.nan
    file = tmp_path / "a.npz"
    np.savez(file, t=time, x=position, u=VOLTS)
    with pytest.raises(BagError, match=r"position is not finite \(NaN or inf\) at 1 of 50 samples, first at 0\.070 s"):
        import_recording(file, MAP)
    record = import_recording(file, MAP, repair=True)
    np.testing.assert_allclose(record.position, POSITION_MM / 1000.0, atol=1e-9)
    assert any("1 filled" in note for note in record.notes)
    time[20] = time[19]
    np.savez(file, t=time, x=POSITION_MM, u=VOLTS)
    with pytest.raises(BagError, match="1 of 50 stamps repeat"):
        import_recording(file, MAP)
    time[20] = np.nan
    np.savez(file, t=time, x=POSITION_MM, u=VOLTS)
    with pytest.raises(ImportingError, match=r"time is not finite .* at 1 of 50 samples, first at row 20"):
        import_recording(file, MAP)
    repaired = import_recording(file, MAP, repair=True)
    np.testing.assert_allclose(repaired.time, TIME, atol=1e-12)
    assert any("time is not finite" in note for note in repaired.notes)


def test_empty_cells_are_found(tmp_path: Path) -> None:
    file = table(tmp_path / "a.csv")
    lines = file.read_text().splitlines()
    lines[10] = "0.09,,0.5"
    file.write_text("\n".join(lines))
    with pytest.raises(BagError, match="position is not finite"):
        import_recording(file, MAP)


def test_what_a_table_has_not_is_not_advised(tmp_path: Path) -> None:
    lines = table(tmp_path / "run.csv").read_text().splitlines()
    lines[20] = lines[19]
    (tmp_path / "run.csv").write_text("\n".join(lines))
    with pytest.raises(BagError, match="repeat an earlier one") as refused:
        import_recording(tmp_path / "run.csv", load_mapping(MAP))
    assert "--repair" in str(refused.value)
    assert "--time log" not in str(refused.value)
