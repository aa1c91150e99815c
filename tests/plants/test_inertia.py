"""What a plant says of its own inertia."""

from __future__ import annotations

import numpy as np
import pytest
from fric.plant import Plant
from fric.plants import PLANTS


@pytest.mark.parametrize("plant", PLANTS.values(), ids=lambda plant: plant.id)
def test_a_plant_names_the_masses_that_its_inertia_comes_from(plant: Plant) -> None:
    values = {each.name: 1.0 if each.default is None else each.default for each in plant.parameters}
    inertia = plant.total_inertia
    before = inertia(*values.values())
    assert plant.inertia_names
    doubled = [inertia(*(values | {name: 2.0 * values[name]}).values()) for name in plant.inertia_names]
    assert max(doubled) > before
    others = {name for name, value in values.items() if value and name not in plant.inertia_names}
    scaled = [inertia(*(values | {name: 2.0 * values[name]}).values()) for name in others]
    # Lever arms may redistribute it; no other parameter of a rigid body does.
    assert plant.id not in {"rigid", "pendulum"} or np.allclose(scaled, before)
