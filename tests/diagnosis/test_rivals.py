"""What speaks against a model before the data do."""

from __future__ import annotations

import pytest
from fric_nodes.diagnosis.rivals import implausible
from fric_nodes.model import Model, build_model, term


def _axis(mass: float, share: float) -> Model:
    terms = [term("coulomb", force=4.0), term("compliance", stiffness=3e4)]
    return build_model("rigid", {"mass": mass, "load_share": share}, terms)


def test_hardly_any_mass_behind_a_spring_counts_as_a_mass_that_is_off() -> None:
    """A spring without a body behind it is the first micrometres of a contact."""
    usual, light = implausible(2.0, _axis(2.0, 0.4)), implausible(2.0, _axis(2.0, 0.05))
    assert usual == 0.0
    assert light == pytest.approx(implausible(2.0, _axis(4.0, 0.4)))  # half of the least share, twice the mass
    assert implausible(2.0, _axis(2.0, 0.1)) == 0.0
    assert implausible(2.0, build_model("rigid", {"mass": 2.0}, [term("coulomb", force=4.0)])) == 0.0
