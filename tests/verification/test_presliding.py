"""What the verifications of the pre-sliding laws measure must also be able to come out badly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric.effect import Effect, Place
from fric.effects import EFFECTS
from fric.engine.kernel import kernel
from fric.model import Term, build_model, term
from fric.verification import elasto_plastic_drift, passivity, presliding_memory, stick_slip


@kernel
def _spring_that_stiffens_on_the_way_back(
    z: np.ndarray, z_next: np.ndarray, i: int, v: float, h: float, level: float, stiffness: float, damping: float
) -> float:
    z_next[i] = z[i] + v * h
    return float((stiffness if v * z[i] > 0.0 else 2.0 * stiffness) * (z[i] + 0.5 * v * h))


@kernel
def _pushing(c: object, coefficient: float) -> float:
    return -coefficient * c.velocity  # type: ignore[attr-defined,no-any-return]


def test_a_contact_that_gives_energy_is_seen() -> None:
    lugre = EFFECTS["presliding/lugre"]
    giving = replace(lugre, law="giving", slip=_spring_that_stiffens_on_the_way_back)
    model = build_model("rigid", {"mass": 1.0}, [term("coulomb", force=4.0), Term(giving, (400.0, 0.0))])
    run = passivity._led("giving", model)
    assert run.held is None
    assert run.residual < 1e-6
    assert run.delivered > 1e-3


def test_a_force_that_gives_energy_is_seen() -> None:
    pushing = Effect(
        id="pushing", place=Place.FORCE, title="", equation="", source="", force=_pushing,
        parameters=EFFECTS["viscous"].parameters,
    )  # fmt: skip
    assert passivity._cycle_work(pushing) == pytest.approx(-1.0)
    assert passivity._cycle_work(EFFECTS["viscous"]) == pytest.approx(1.0)
    assert passivity._cycle_work(EFFECTS["bias"]) == pytest.approx(0.0, abs=1e-12)


def test_every_law_of_the_contact_takes_part_in_the_balance() -> None:
    taking_part = {held.effect.key for _, model in passivity._models() for held in model.terms}
    assert taking_part >= {effect.key for effect in EFFECTS.values() if effect.place in passivity._CONTACT}


def test_a_gap_in_the_balance_is_seen() -> None:
    ones = np.ones(100_000)
    closed = passivity._Run("x", 3 * ones, ones, ones, ones, None)
    assert closed.residual == 0.0
    assert replace(closed, contact=(1 + 3e-6) * ones).residual == pytest.approx(1e-6, rel=1e-6)
    assert replace(closed, held=2 * ones).delivered > 0.0


def test_the_deviation_of_a_law_without_memory_is_what_its_closed_form_says() -> None:
    # Dahl, n = 1: over a branch of length L from F_0, F = s g + (F_0 - s g) exp(-L/l), l = g/sigma.
    law = term("presliding", "dahl", stiffness=presliding_memory._STIFFNESS)
    found, span, plain, _ = presliding_memory._deviations(law)
    g, unit = presliding_memory._LEVEL, presliding_memory._STEP * presliding_memory._STIFFNESS / presliding_memory._LEVEL

    def branch(force: float, way: float) -> float:
        s = np.sign(way)
        return float(s * g + (force - s * g) * np.exp(-abs(way) * unit))

    (begin, back), _ = presliding_memory._LOOPS.inner
    tip = presliding_memory._TIP
    force = 0.0
    for way in (tip, -2 * tip, 2 * tip, -2 * tip, begin + tip):
        force = branch(force, way)
    after = branch(branch(force, back - begin), begin - back)
    # The deviation decays along the branch: greatest in its first step, whose mean is measured.
    assert found[0] * span == pytest.approx(abs(after - force), rel=2e-3)
    assert span == pytest.approx(float(np.ptp(plain[1])))


def test_drift_of_lugre_is_seen_by_the_same_measure() -> None:
    position, _, _ = elasto_plastic_drift._cycles(term("presliding", "lugre", stiffness=1e5, damping=600.0))
    assert position[-1] - position[0] > 1e-3


def test_references_of_stick_slip_agree_where_both_hold() -> None:
    # A Stribeck velocity far below the speeds of a slip is static friction.
    duration, left = stick_slip._slip_closed()
    assert duration == pytest.approx(0.1 * np.sqrt(0.1) * (2 * np.pi - 2 * np.arctan(2e-3 * np.sqrt(1000.0) / 1e-3)), rel=1e-12)
    assert left == pytest.approx(2.0)
