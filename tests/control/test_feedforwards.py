"""Every feedforward of the catalogue, against closed forms; what all share; and the files that name them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from fric.control.controller_file import read_controller
from fric.control.feedforward_file import feedforward_of
from fric.control.feedforward_kind import FeedforwardKindError, Force
from fric.control.feedforwards import FEEDFORWARDS
from fric.control.feedforwards.quadrant_pulse import QuadrantPulse
from fric.control.feedforwards.static_table import StaticTable
from fric.control.shaping import Shaped, Shaping
from fric.errors import InputError
from fric.friction.dnlrx import from_mechanics
from fric.friction.dnlrx_file import write_dnlrx
from fric.model import build_model, term
from fric.model_file import write_model
from fric.record import Units

H = 1e-3
UNITS = Units()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_model(
        build_model("rigid", {"mass": 2.0}, [term("coulomb", force=6.0), term("viscous", coefficient=20.0)]),
        tmp_path / "model.yaml",
    )
    write_dnlrx(from_mechanics(2.0, 20.0, 0.0, [1e5, 5e4], [1e-5, 1e-4], H), tmp_path / "dnlrx.yaml")
    (tmp_path / "table.txt").write_text("# v F\n0.0 6.0\n0.1 8.0\n1.0, 26.0\n", encoding="utf-8")
    np.savetxt(tmp_path / "learnt.txt", np.column_stack([np.arange(0, 1, 1e-2), np.ones(100)]))
    return tmp_path


GIVEN: dict[str, dict[str, object]] = {
    "model": {"model": "model.yaml"},
    "dnlrx": {"file": "dnlrx.yaml"},
    "static_table": {"file": "table.txt", "mass": 2.0},
    "quadrant_pulse": {"height": 5.0, "rise": 0.01, "decay": 0.05, "viscous": 20.0},
    "iterative_learning": {"file": "learnt.txt"},
    "dither": {"amplitude": 0.5, "frequency": 100.0},
}


def made(folder: Path, kind: str, **more: object) -> Force:
    return feedforward_of({"type": kind, **GIVEN[kind], **more}, UNITS, folder).build(H, 0.0)


def motion(t: float) -> tuple[float, float, float]:
    w = 2.0 * math.pi * 0.5
    return 0.05 * (1.0 - math.cos(w * t)), 0.05 * w * math.sin(w * t), 0.05 * w * w * math.cos(w * t)


def along(force: Force, n: int = 3000) -> np.ndarray:
    return np.array([force.step(k * H, *motion(k * H)) for k in range(n)])


def test_all_of_the_catalogue_are_tested() -> None:
    assert set(GIVEN) == set(FEEDFORWARDS)


@pytest.mark.parametrize("kind", GIVEN)
class TestConformance:
    def test_it_is_finite_and_starts_anew(self, kind: str, folder: Path) -> None:
        force = made(folder, kind)
        first = along(force)
        assert np.all(np.isfinite(first))
        assert np.max(np.abs(first)) < 40.0
        force.reset()
        assert np.array_equal(along(force), first)

    def test_scale_and_limits(self, kind: str, folder: Path) -> None:
        whole, half = along(made(folder, kind)), along(made(folder, kind, scale=0.5))
        assert half == pytest.approx(0.5 * whole)
        limited = made(folder, kind, force_limit=0.3)
        assert np.max(np.abs(along(limited))) <= 0.3
        assert limited.limited > 0  # type: ignore[attr-defined]
        slow = along(made(folder, kind, slew_limit=10.0))
        assert np.max(np.abs(np.diff(slow))) <= 10.0 * H * (1.0 + 1e-9)

    def test_it_refuses_what_is_not_finite(self, kind: str, folder: Path) -> None:
        with pytest.raises(InputError):
            made(folder, kind).step(math.nan if kind in ("dither", "iterative_learning") else 0.0, 0.0, math.nan, 0.0)

    @pytest.mark.parametrize(
        "wrong", [{"scale": 2.0}, {"build_up": -1.0}, {"slew_limit": 0.0}, {"nonsense": 1.0}, {"scale": "all"}]
    )
    def test_bad_settings_are_refused_in_one_line(self, kind: str, wrong: dict[str, object], folder: Path) -> None:
        with pytest.raises(FeedforwardKindError) as found:
            made(folder, kind, **wrong)
        assert "\n" not in str(found.value)


def test_model_and_table_and_mechanics_agree_in_sliding(folder: Path) -> None:
    forces = {kind: along(made(folder, kind)) for kind in ("model", "static_table", "dnlrx")}
    k = np.arange(300, 700)
    _, v, a = np.array([motion(t) for t in k * H]).T
    truth = 2.0 * a + 20.0 * v + 6.0
    assert forces["model"][k] == pytest.approx(truth, abs=1e-9)
    assert forces["static_table"][k] == pytest.approx(truth, abs=1e-9)
    assert forces["dnlrx"][k] == pytest.approx(truth, abs=0.05)


def test_the_dnlrx_at_another_rate_is_refused(folder: Path) -> None:
    plan = feedforward_of({"type": "dnlrx", "file": "dnlrx.yaml"}, UNITS, folder)
    with pytest.raises(FeedforwardKindError, match=r"sample time of 0\.001 s"):
        plan.build(2e-3, 0.0)


def test_a_table_is_linear_between_and_constant_beyond() -> None:
    table = StaticTable([0.0, 0.1, 1.0], [6.0, 8.0, 26.0])
    at = {0.05: 7.0, 0.1: 8.0, 0.55: 17.0, 3.0: 26.0, -0.05: -7.0, 0.0: 0.0}
    assert {v: table.step(0.0, 0.0, v, 0.0) for v in at} == pytest.approx(at)
    with pytest.raises(FeedforwardKindError, match="don't increase"):
        StaticTable([0.1, 0.1], [1.0, 2.0])


def test_a_pulse_rises_and_falls_after_the_reversal() -> None:
    pulse = QuadrantPulse(5.0, 0.01, 0.05)
    forces = [pulse.step(k * H, 0.0, 0.1 if k < 50 else -0.1, -1.0) for k in range(400)]
    assert forces[55] == pytest.approx(-2.5)
    assert forces[60] == pytest.approx(-5.0)
    assert forces[110] == pytest.approx(-5.0 * math.exp(-1.0))
    assert abs(forces[-1]) < 0.02


def test_friction_is_let_down_before_and_built_up_after_a_reversal(folder: Path) -> None:
    rigid, shaped = made(folder, "model"), made(folder, "model", build_up=2e-4, let_down=2e-4)
    plain, eased = along(rigid), along(shaped)
    assert np.max(np.abs(np.diff(plain[900:1100]))) > 11.0
    assert np.max(np.abs(np.diff(eased[900:1100]))) < 3.0
    # Away from the reversal, at 1 s, nothing changes.
    assert eased[200:900] == pytest.approx(plain[200:900])
    assert eased[1100:1900] == pytest.approx(plain[1100:1900])


def test_shaping_leaves_inertia_alone() -> None:
    class Both:
        friction = 4.0

        def reset(self) -> None: ...

        def step(self, time: float, position: float, velocity: float, acceleration: float) -> float:
            return 3.0 * acceleration + self.friction

    shaped = Shaped(Both(), Shaping(let_down=1.0))
    # v^2/(2|a|) = 0.25 of the way.
    assert shaped.step(0.0, 0.0, 1.0, -2.0) == pytest.approx(-6.0 + 0.25 * 4.0)


FILE = """format: fric-controller/1
units: {position: m, force: N}
period: 0.001
controller: {type: pid, proportional: 2.0e+4}
"""


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ("{type: nothing}", "type 'nothing' is not known; use one of"),
        ("{type: dnlrx}", "'file' is missing"),
        ("{type: dnlrx, file: table.txt}", "dnlrx"),
        ("{type: static_table, file: nowhere.txt}", "cannot be read"),
        ("{type: dither, amplitude: 1.0, frequency: 600.0}", "half the sampling rate"),
        ("[]", "empty list"),
        ("{type: quadrant_pulse, height: 1.0, decay: 0.0}", "decay is 0, must be greater than 0"),
    ],
)
def test_files_that_name_what_cannot_be(entry: str, said: str, folder: Path) -> None:
    (folder / "c.yaml").write_text(f"{FILE}feedforward: {entry}\n", encoding="utf-8")
    with pytest.raises(InputError) as found:
        read_controller(folder / "c.yaml")
    assert said in str(found.value)


def test_a_file_adds_several_and_gains_come_from_a_model(folder: Path) -> None:
    gains = "{type: disturbance_observer, model: model.yaml, proportional: 2.0e+4, derivative: 100.0, observer_time: 0.01}"
    forces = "\n  - {type: static_table, file: table.txt}\n  - {type: dither, amplitude: 1.0, frequency: 250.0}\n"
    text = FILE.replace("{type: pid, proportional: 2.0e+4}", gains) + "feedforward:" + forces
    (folder / "c.yaml").write_text(text, encoding="utf-8")
    settings = read_controller(folder / "c.yaml")
    assert settings.gains["inertia"] == 2.0
    assert settings.gains["damping"] == 20.0
    assert settings.feedforward is not None
    force = settings.feedforward.build(H, 0.0)
    assert force.step(0.001, 0.0, 0.05, 0.0) == pytest.approx(8.0)
