"""The search from several starts, on sums of squares whose minima are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from fric.identification.free_parameters import FreeParameters
from fric.identification.multi_start import Ends, best_of
from fric.identification.result import Options
from fric.model import Model, build_model, term


@dataclass
class End:
    model: Model
    cost: float


def models(*masses: float) -> list[Model]:
    return [build_model("rigid", {"mass": mass}, [term("viscous", coefficient=1.0)]) for mass in masses]


FREE = FreeParameters.of(models(1.0)[0], Options())


def test_the_deeper_of_two_valleys_wins_and_hopeless_starts_are_given_up() -> None:
    finished = []

    def search(model: Model, last: bool) -> End:
        mass = model.value("mass")
        if mass > 50.0:
            return End(model, 1e6)
        if last:
            finished.append(mass)
        valley, depth = (1.0, 2.0) if mass < 3.0 else (5.0, 1.0)
        return End(model.with_value("mass", valley), depth)

    best, ends = best_of(lambda m: search(m, False), lambda m: search(m, True), models(0.5, 2.0, 4.0, 100.0), FREE)
    assert best.model.value("mass") == 5.0
    assert sorted(finished) == [1.0, 1.0, 5.0]
    assert ends.costs.tolist() == [1.0, 2.0, 2.0, 1e6]


def test_what_is_said_about_other_minima() -> None:
    errors = np.array([0.1])
    same = Ends(("mass",), np.array([[2.0], [2.05], [2.01]]), np.array([1.0, 1.0, 1.0]))
    assert same.note(errors) == "3 of 3 starts ended in the same minimum"
    assert same.warning(errors) is None
    worse = Ends(("mass",), np.array([[2.0], [9.0]]), np.array([1.0, 4.0]))
    assert worse.note(errors) == "1 of 2 starts ended in the same minimum; the position error of the others is larger by 100 %"
    assert worse.warning(errors) is None
    rival = Ends(("mass",), np.array([[2.0], [9.0]]), np.array([1.0, 1.02])).warning(errors)
    assert rival is not None
    assert "mass 9 instead of 2" in rival


@pytest.mark.parametrize("errors", [np.array([np.nan]), np.array([0.0])])
def test_a_parameter_without_an_error_decides_nothing(errors: np.ndarray) -> None:
    ends = Ends(("mass",), np.array([[2.0], [9.0]]), np.array([1.0, 1.0]))
    assert ends.warning(errors) is None
