"""Running a model: how recorded forces relate to intervals, surroundings sample by sample, and the catalogue of files."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from fric.model import build_model, term
from fric.parameter import Parameter
from fric.registry import discover
from fric.simulation import Simulator, intervals, simulate, substeps


def test_a_recorded_force_acts_before_after_or_around_its_stamp() -> None:
    effort = np.array([1.0, 2.0, 4.0])
    np.testing.assert_array_equal(intervals(effort, "following"), [1.0, 2.0])
    np.testing.assert_array_equal(intervals(effort, "preceding"), [2.0, 4.0])
    np.testing.assert_array_equal(intervals(effort, "linear"), [1.5, 3.0])
    with pytest.raises(ValueError, match="following, preceding or linear"):
        intervals(effort, "sideways")


def test_each_way_of_holding_moves_a_free_mass_as_it_should() -> None:
    model = build_model("rigid", {"mass": 2.0})
    for hold, impulse in (("following", 3.0), ("preceding", 6.0), ("linear", 4.5)):
        motion = simulate(model, np.array([1.0, 2.0, 4.0]), 0.1, hold=hold)
        assert motion.position.shape == motion.velocity.shape == motion.friction.shape == (3,)
        assert motion.velocity[-1] == pytest.approx(0.1 * impulse / 2.0)


def test_slices_of_larger_arrays_are_taken_as_they_are() -> None:
    model = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=4.0)])
    wide = np.random.default_rng(1).standard_normal((200, 3)) * 10.0
    strided = simulate(model, wide[:, 1], 1e-3)
    np.testing.assert_array_equal(strided.position, simulate(model, wide[:, 1].copy(), 1e-3).position)


def test_substeps_are_bounded() -> None:
    stiff = build_model("rigid", {"mass": 1e-6}, [term("coulomb", force=1.0), term("presliding", stiffness=1e12)])
    assert substeps(stiff, 1.0) == 2000
    assert substeps(build_model("rigid", {"mass": 1.0}), 1.0) == 1


def test_time_runs_on_from_call_to_call() -> None:
    simulator = Simulator(build_model("rigid", {"mass": 1.0}), 0.5, -0.1)
    simulator.run(np.zeros(10), 0.01)
    simulator.step(0.0, 0.4)
    assert simulator.time == pytest.approx(0.5)
    assert simulator.position == pytest.approx(0.45)
    assert simulator.velocity == -0.1


def test_a_catalogue_is_its_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "some_catalogue"
    package.mkdir()
    (package / "__init__.py").write_text("", encoding="utf-8")
    declared = "from fric.parameter import Parameter\nONE = Parameter('{0}', '{0}', '1', 'a test')\n"
    for name in ("zebra", "ant"):
        (package / f"{name}.py").write_text(declared.format(name), encoding="utf-8")
    (package / "helper.py").write_text("NOT_ONE = 3\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    assert [found.name for found in discover("some_catalogue", "ONE", Parameter)] == ["ant", "zebra"]
    (package / "bad.py").write_text("ONE = 3\n", encoding="utf-8")
    with pytest.raises(TypeError, match=r"some_catalogue\.bad\.ONE is a int, not a Parameter"):
        discover("some_catalogue", "ONE", Parameter)
    for name in [name for name in sys.modules if name.startswith("some_catalogue")]:
        del sys.modules[name]
