"""The facade: arrays, tables, paths in; results that say, show and write themselves; the same numbers as the layers below."""

from __future__ import annotations

import doctest
import importlib
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import fric
import numpy as np
import pandas as pd
import pytest
from fric.bagio import write_record
from fric.model import build_model, term

TRUE = {"mass": 2.0, "coulomb.force": 5.0, "viscous.coefficient": 12.0}


def _axis(seed: int, duration: float = 12.0, noise: float = 1e-7) -> fric.Record:
    """A controlled mass with friction, by the integrator of this file."""
    random = np.random.default_rng(seed)
    h, fine = 1e-3, 10
    n = round(duration / h)
    t = h * np.arange(n)
    phases = random.uniform(0.0, 2.0 * np.pi, 4)
    wanted = (np.array([0.05, 0.03, 0.012, 0.004]) * np.sin(2.0 * np.pi * np.outer(t, [0.4, 0.9, 2.1, 4.3]) + phases)).sum(
        axis=1
    )
    wanted -= wanted[0]
    speed = np.gradient(wanted, t)
    x = v = 0.0
    q, u = np.empty(n), np.empty(n)
    for k in range(n):
        u[k], q[k] = 900.0 * (wanted[k] - x) + 80.0 * (speed[k] - v), x
        for _ in range(fine):
            free = v + h / fine / 2.0 * (u[k] - 12.0 * v)
            v = np.sign(free) * max(abs(free) - h / fine * 2.5, 0.0)
            x += h / fine * v
    return fric.Record.from_arrays(t, q + noise * random.standard_normal(n), u, effort_hold="following", source=f"axis {seed}")


@pytest.fixture(scope="module")
def records() -> tuple[fric.Record, fric.Record]:
    return _axis(1), _axis(2)


@pytest.fixture(scope="module")
def found(records: Any) -> fric.Identified:
    return fric.identify(records[0], "coulomb,viscous", validate=records[1])


def test_the_values_are_those_of_the_axis(found: fric.Identified) -> None:
    for name, value in TRUE.items():
        row = found.parameters.loc[name]
        assert abs(found[name] - value) <= max(4.0 * row["standard_error"], 2e-3 * value), name
        assert row["unit"] == {"mass": "kg", "coulomb.force": "N", "viscous.coefficient": "N s/m"}[name]


def test_a_result_says_shows_and_writes_itself(found: fric.Identified, tmp_path: Path) -> None:
    text = found.summary()
    assert "coulomb.force" in text
    assert "recordings kept apart: relative force error" in text
    assert "status:" in text
    page = found.report(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == page
    assert "<html" in page
    written = found.save(tmp_path / "out")
    assert all(path.is_file() for path in written)
    assert json.loads((tmp_path / "out/identification.json").read_text(encoding="utf-8")) == json.loads(
        json.dumps(found.to_dict())
    )
    assert fric.read_model(tmp_path / "out/model.yaml").value("coulomb.force") == pytest.approx(
        found["coulomb.force"], rel=1e-6
    )


def test_arrays_a_table_and_a_bag_give_the_same(records: Any, found: fric.Identified, tmp_path: Path) -> None:
    record = records[0]
    write_record(record, tmp_path / "bag")
    table = record.to_frame()
    assert list(table.columns) == ["time", "position", "effort"]
    by_bag = fric.identify(tmp_path / "bag", ["coulomb", "viscous"])
    assert by_bag["mass"] == pytest.approx(found["mass"], rel=1e-6)
    by_table = fric.identify(table, "coulomb,viscous")
    # A table doesn't say how its force is held: that is found, within its uncertainty.
    assert by_table["mass"] == pytest.approx(found["mass"], rel=5e-3)
    csv = tmp_path / "run.csv"
    table.to_csv(csv, index=False)
    mapping = {
        "time": {"from": "time", "unit": "s"},
        "position": {"from": "position", "unit": "m"},
        "effort": {"from": "effort", "unit": "N"},
        "effort_hold": "following",
    }
    by_csv = fric.identify(fric.read(csv, mapping=mapping), "coulomb,viscous")
    assert by_csv["mass"] == pytest.approx(found["mass"], rel=1e-6)


def test_simulating_under_the_force_of_a_recording_is_comparing_with_it(records: Any, found: fric.Identified) -> None:
    motion = fric.simulate(found.model, records[1])
    compared = fric.compare(motion, records[1])
    assert "position within" in compared.summary()
    assert compared.to_dict()["signals"]["effort"]["rmse"] < 1e-6
    np.testing.assert_allclose(motion.reference, records[1].position)


def test_a_constant_force_gives_the_motion_of_the_textbook() -> None:
    axis = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=5.0), term("viscous", coefficient=4.0)])
    motion = fric.simulate(axis, np.full(2001, 9.0), 1e-3)
    assert motion.velocity is not None
    expected = (9.0 - 5.0) / 4.0 * (1.0 - np.exp(-4.0 / 2.0 * motion.time))
    np.testing.assert_allclose(motion.velocity, expected, atol=2e-6)


def test_what_is_missing_is_told(records: Any) -> None:
    train, validation = records
    nominal = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=5.0)])
    diagnosis = fric.diagnose(train, nominal, validate=validation)
    assert diagnosis.findings[0].effect == "viscous"
    assert "viscous" in diagnosis.summary()
    assert diagnosis.to_dict()["mismatch"] is True
    assert set(diagnosis.prediction.columns) >= {"time", "force_measured", "force_augmented"}
    assert len(fric.plot(diagnosis).data) >= 3


def test_pictures(records: Any, found: fric.Identified) -> None:
    assert len(fric.plot(records[0]).data) == 2
    assert len(fric.plot(list(records)).data) == 4
    curve = fric.plot(found.model, fastest=0.2).data[-1]
    at = int(np.argmax(curve.x))
    assert curve.y[at] == pytest.approx(found["coulomb.force"] + 0.2 * found["viscous.coefficient"], rel=1e-6)
    assert len(fric.plot(found).data) == 2


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fric.read(pd.DataFrame({"time": [0.0, 1.0]})), "has no column position, effort"),
        (lambda: fric.identify([], "coulomb"), "no recording is given"),
        (lambda: fric.simulate("coulomb", np.ones(4)), "no period"),
        (lambda: fric.simulate("coulomb"), "no single way"),
        (lambda: fric.identify(_axis(3, 2.0), "coulom"), "coulom"),
        (lambda: fric.identify(_axis(3, 2.0), "coulomb", cutof=3.0), "no setting is called cutof"),
        (lambda: fric.diagnose(_axis(3, 2.0), "coulomb"), "is needed, or"),
        (lambda: fric.plot(3), "can't be drawn"),
    ],
)
def test_refusals_say_what_to_do(call: Any, message: str) -> None:
    with pytest.raises(fric.InputError, match=message) as refused:
        call()
    assert "\n" not in str(refused.value)


def test_a_csv_without_a_mapping_is_refused(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("t,q,u\n0,0,0\n", encoding="utf-8")
    with pytest.raises(fric.InputError, match="which column is which"):
        fric.read(tmp_path / "run.csv")


@pytest.mark.parametrize("module", ["record", *(f"facade.{name}" for name in ("reading", "identifying", "simulating"))])
def test_the_examples_of_the_docstrings_run(module: str) -> None:
    held = importlib.import_module(f"fric.{module}")
    result = doctest.testmod(held, extraglobs={"Record": fric.Record, "np": np})
    assert result.attempted > 0
    assert result.failed == 0


def test_importing_it_is_light() -> None:
    code = "import sys, fric; print(sorted({'numpy', 'numba', 'rclpy'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
    assert set(fric.__all__) <= set(dir(fric))
    assert all(getattr(fric, name) is not None for name in fric.__all__)
