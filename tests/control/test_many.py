"""Many joints in one call against one joint after the other."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.control.feedbacks.friction_observer import Bristles
from fric.control.feedforwards.dnlrx import DnlrxForce
from fric.control.many import ManyDnlrx, ManyError, ManyLugre
from fric.friction.dnlrx import from_mechanics

H = 1e-3


def test_lugre_is_that_of_each_joint() -> None:
    laws = [Bristles(5.0 + k, 7.0 + k, 1e-2, 1e5, 50.0) for k in range(6)]
    mass, viscous = np.linspace(1.0, 2.0, 6), np.linspace(5.0, 10.0, 6)
    many = ManyLugre(laws, mass, viscous, H)
    z = [0.0] * 6
    for k in range(500):
        v, a = 0.1 * math.sin(0.02 * k) * np.linspace(-1.0, 1.0, 6), np.full(6, 0.3)
        found = many.step(v, a)
        for j, one in enumerate(laws):
            z[j], friction = one.led(z[j], float(v[j]), 0.0, H)
            assert found[j] == pytest.approx(friction + viscous[j] * v[j] + mass[j] * a[j], rel=1e-6, abs=1e-5)


@pytest.mark.parametrize("damped", [False, True])
def test_dnlrx_is_that_of_each_joint(damped: bool) -> None:
    models = [
        from_mechanics(
            1.0 + k,
            10.0,
            0.0,
            [1e5, 5e4],
            [1e-5, 1e-4],
            H,
            order=3,
            offset=0.1 * k,
            spring_damping=[3.0, 2.0] if damped else None,
        )
        for k in range(4)
    ]
    many, singles = ManyDnlrx(models, np.zeros(4)), [DnlrxForce(one, H) for one in models]
    for k in range(300):
        q = 1e-3 * (1.0 - math.cos(0.03 * k)) * np.array([1.0, -0.5, 0.1, 0.0])
        forces = [one.step(k * H, float(q[j]), 0.0, 0.0) for j, one in enumerate(singles)]
        assert many.step(q) == pytest.approx(forces, rel=1e-9, abs=1e-6)


def test_what_cannot_be_served_together_is_refused() -> None:
    one, other = from_mechanics(1.0, 1.0, 0.0, [1.0], [1.0], H), from_mechanics(1.0, 1.0, 0.0, [1.0, 2.0], [1.0, 2.0], H)
    with pytest.raises(ManyError, match="several orders"):
        ManyDnlrx([one, other], np.zeros(2))
    with pytest.raises(ManyError, match="not finite"):
        ManyDnlrx([one], np.zeros(1)).step(np.array([math.nan]))
