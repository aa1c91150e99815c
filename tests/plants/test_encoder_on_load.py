"""The position of the load as the measured one: the same bodies, seen from the other side of the transmission."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from fric.axis import SimulatedAxis
from fric.model import Model, ModelError, Term, build_model, term
from fric.model_file import json_schema, model_from_text, model_to_text
from fric.plants import PLANTS
from fric.simulation import Simulator, simulate
from scipy.integrate import solve_ivp

SPRING = term("compliance", stiffness=8e3, damping=5.0)
GAP = term("backlash", gap=2e-3)
FILE = (
    "format: fric-model/1\njoint: axis\nunits: {position: m, force: N}\n"
    "plant: {type: rigid, mass: 4.0, encoder: %s}\nterms: []\n"
)


def axis(*terms: Term, encoder: str = "load", share: float = 0.3) -> Model:
    return build_model("rigid", {"mass": 4.0, "load_share": share}, terms, encoder=encoder)


def test_the_bodies_move_as_they_do_and_the_load_is_measured() -> None:
    u = 20.0 * np.sin(0.03 * np.arange(1200))
    for transmission in (SPRING, GAP):
        terms = (transmission, term("coulomb", force=3.0))
        of_load, of_motor = (simulate(axis(*terms, encoder=each), u, 1e-3, n_substeps=4) for each in ("load", "motor"))
        np.testing.assert_array_equal(of_load.states, of_motor.states)
        np.testing.assert_array_equal(of_load.position, of_load.states[:, 0])
        np.testing.assert_array_equal(of_motor.position, of_motor.states[:, 2])
        assert np.max(np.abs(of_load.position - of_motor.position)) > 5e-4


def test_the_load_swings_as_the_equations_say() -> None:
    """m_m y'' = u - L, m_l q'' = L - c q', L = k (y - q) + d (y' - q'), solved by another hand."""
    share, push = 0.3, 5.0
    motor, load = 4.0 * (1.0 - share), 4.0 * share

    def rate(_: float, x: np.ndarray) -> list[float]:
        force = 8e3 * (x[2] - x[0]) + 5.0 * (x[3] - x[1])
        return [x[1], (force - 6.0 * x[1]) / load, x[3], (push - force) / motor]

    t = 1e-3 * np.arange(401)
    exact = solve_ivp(rate, (0.0, 0.4), [0.0, 0.0, 0.0, 0.0], "DOP853", t, rtol=1e-11, atol=1e-14).y
    found = simulate(axis(SPRING, term("viscous", coefficient=6.0), share=share), np.full(401, push), 1e-3, n_substeps=20)
    assert np.max(np.abs(found.position - exact[0])) < 2e-3 * np.max(np.abs(exact[0] - exact[2]))


def test_an_axis_reports_it_and_the_motors_besides() -> None:
    moved = SimulatedAxis(axis(GAP))
    moved.advance(8.0, 0.01)
    # The motor goes alone until it has crossed half the play.
    assert moved.measure().position == 0.0
    assert moved.signal_names == ("motor_position",)
    assert moved.signals()[0] == pytest.approx(0.5 * 8.0 / (4.0 * 0.7) * 0.01**2)


def test_it_counts_from_when_there_is_a_transmission() -> None:
    model = build_model("rigid", {"mass": 4.0}, [], encoder="load")
    assert model.plant is PLANTS["rigid"]
    assert not model.has_transmission
    grown = model.with_terms([SPRING])
    assert grown.plant is PLANTS["rigid"].behind
    assert grown.has_transmission
    assert grown.with_values(grown.values).with_terms([]).encoder == "load"
    assert Simulator(grown).position == 0.0
    bed = build_model("two_mass", {"motor_mass": 1.0, "load_mass": 2.0}, [GAP], encoder="load")
    assert bed.plant.encoder == (0, 1)
    assert [signal.name for signal in bed.plant.signals] == ["motor_position", "deflection"]


def test_a_file_says_it() -> None:
    model = model_from_text(FILE % "load")
    assert model.encoder == "load"
    for each in (model, model.with_terms([SPRING])):
        assert "encoder: load" in model_to_text(each)
        assert model_from_text(model_to_text(each)) == each
    assert "encoder" not in model_to_text(model_from_text(FILE % "motor"))
    with pytest.raises(ModelError, match="line 4"):
        model_from_text(FILE % "gear")
    rigid = next(each for each in json_schema()["$defs"].values() if each["title"] == "plant_rigid")
    assert rigid["properties"]["encoder"]["enum"] == ["motor", "load"]


def test_what_has_no_two_sides_refuses_it() -> None:
    with pytest.raises(ModelError, match="no transmission with two sides"):
        build_model("contact", {"mass": 1.0}, [], encoder="load")
    with pytest.raises(ModelError, match="use one of motor, load"):
        build_model("rigid", {"mass": 1.0}, [], encoder="gear")


def test_it_goes_to_another_process_by_its_name() -> None:
    for plant in PLANTS.values():
        assert plant.behind is None or pickle.loads(pickle.dumps(plant.behind)) is plant.behind
