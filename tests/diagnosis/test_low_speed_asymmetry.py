"""A rise of friction at low speed that differs by direction is told from plain asymmetry, and plain asymmetry from it.

The axis is moved by an integrator that shares nothing with fric's, from a friction curve of its own for each direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from fric.diagnosis import Diagnosis, diagnose
from fric.diagnosis.costs import further_parameters
from fric.diagnosis.fitting import refit
from fric.diagnosis.other_laws import laws_in_place
from fric.diagnosis.track import Track
from fric.diagnosis.worth_trying import worth_trying
from fric.effects import EFFECTS
from fric.model import Model, Term, build_model, term
from fric.record import Record

from .small_axis import NOMINAL, recorded

pytestmark = pytest.mark.timeout(600)
LOW_SPEED = EFFECTS["asymmetry/low_speed"]


@dataclass(frozen=True)
class Lopsided:
    """Of both directions, forward first: Coulomb level, surplus at rest, Stribeck velocity, viscous coefficient; SI."""

    coulomb: tuple[float, float] = (6.0, 6.0)
    surplus: tuple[float, float] = (3.0, 1.0)
    stribeck: tuple[float, float] = (0.01, 0.01)
    viscous: tuple[float, float] = (20.0, 20.0)
    mass: float = 2.0

    def record(self, seed: int, duration: float) -> Record:
        """Led along a sum of sines by a PD controller at 500 Hz; noise of the position 0.2 um, of the force 0.05 N."""
        h, fine = 2e-3, 10
        t, planned = h * np.arange(round(duration / h)), np.random.default_rng(seed)
        wanted = np.zeros_like(t)
        for k in range(5):
            frequency = planned.uniform(0.1, 0.5) if k < 3 else planned.uniform(0.5, 1.5)
            size = 0.05 * planned.uniform(0.3, 1.0) / (1 + k)
            wanted += size * np.sin(2.0 * math.pi * frequency * t + planned.uniform(0.0, 6.28))
        wanted -= wanted[0]
        rate = np.gradient(wanted, h)
        noise = np.random.default_rng(seed + 1)
        seen = 2e-7 * noise.standard_normal(t.size)
        q = v = 0.0
        position, force = np.empty(t.size), np.empty(t.size)
        for k in range(t.size):
            position[k] = round((q + seen[k]) / 1e-7) * 1e-7
            u = force[k] = 2e4 * (wanted[k] - position[k]) + 300.0 * (rate[k] - v)
            for _ in range(fine):
                way = math.copysign(1.0, v if v != 0.0 else u)
                d = 0 if way > 0.0 else 1
                level = self.coulomb[d] + self.surplus[d] * math.exp(-((v / self.stribeck[d]) ** 2))
                if v == 0.0 and abs(u) <= level:
                    continue
                after = v + h / fine / self.mass * (u - way * level - self.viscous[d] * v)
                after = 0.0 if v * after < 0.0 else after
                q += 0.5 * h / fine * (v + after)
                v = after
        return Record(t, position, force + 0.05 * noise.standard_normal(t.size), effort_hold="following", source=f"run {seed}")


def found(truth: Lopsided, nominal: Model) -> Diagnosis:
    return diagnose([truth.record(1, 15.0)], [truth.record(7, 10.0)], nominal)


def nominal(*more: Term) -> Model:
    own = [term("coulomb", force=7.0), term("viscous", coefficient=15.0), term("bias", force=0.0)]
    return build_model("rigid", {"mass": 2.2}, [*own, *more])


@pytest.mark.parametrize(
    "truth",
    [Lopsided(), Lopsided(surplus=(2.5, 1.5), stribeck=(0.005, 0.005))],
    ids=["half of the surplus", "seldom that slow"],  # plain asymmetry explains 2 % of the second
)
def test_a_rise_that_differs_is_found_beside_a_stribeck_effect(truth: Lopsided) -> None:
    result = found(truth, nominal(term("stribeck", force=1.0, velocity=0.02)))
    (finding,) = result.findings
    assert (finding.effect, finding.law) == ("asymmetry", "low_speed")
    assert "low speed" in result.sentence
    half = 0.5 * (truth.surplus[0] - truth.surplus[1])
    assert finding.parameters["asymmetry.low_speed"].value == pytest.approx(half, rel=0.05)
    assert finding.parameters["asymmetry.velocity"].value == pytest.approx(truth.stribeck[0], rel=0.05)
    assert abs(finding.parameters["asymmetry.coefficient"].value) < 0.3


def test_beside_it_plain_asymmetry_is_told_as_that() -> None:
    truth = Lopsided(coulomb=(6.5, 5.5), viscous=(23.0, 17.0))
    result = found(truth, nominal())
    assert {(each.effect, each.law) for each in result.findings} == {("stribeck", "directional"), ("asymmetry", "linear")}
    values = {name: each.value for finding in result.findings for name, each in finding.parameters.items()}
    assert values["stribeck.difference"] == pytest.approx(1.0, rel=0.05)
    assert values["asymmetry.coefficient"] == pytest.approx(3.0, rel=0.05)


def test_a_stribeck_effect_that_is_the_same_both_ways_is_told_as_that() -> None:
    (finding,) = found(Lopsided(surplus=(2.0, 2.0)), nominal()).findings
    assert (finding.effect, finding.law) == ("stribeck", "exponential")


def test_what_differs_at_every_speed_is_plain_asymmetry() -> None:
    truth = Lopsided(coulomb=(6.5, 5.5), surplus=(2.0, 2.0), viscous=(23.0, 17.0))
    (finding,) = found(truth, nominal(term("stribeck", force=1.0, velocity=0.02))).findings
    assert (finding.effect, finding.law) == ("asymmetry", "linear")
    assert finding.parameters["asymmetry.coefficient"].value == pytest.approx(3.0, rel=0.05)


@pytest.mark.parametrize("surplus", [(3.0, 1.0), (0.0, 3.0), (3.0, 2.0)])
def test_it_is_found_with_the_stribeck_effect_itself(surplus: tuple[float, float]) -> None:
    result = found(Lopsided(surplus=surplus), nominal())
    assert [(each.effect, each.law) for each in result.findings] == [("stribeck", "directional")]
    values = {name: each.value for name, each in result.findings[0].parameters.items()}
    assert values["stribeck.force"] == pytest.approx(0.5 * sum(surplus), rel=0.05)
    assert values["stribeck.difference"] == pytest.approx(0.5 * (surplus[0] - surplus[1]), rel=0.05)
    assert values["stribeck.velocity"] == pytest.approx(0.01, rel=0.05)


def test_a_form_that_may_show_alone_is_tried_and_costs_what_it_has_beyond_its_law() -> None:
    assert LOW_SPEED in worth_trying()
    assert EFFECTS["asymmetry/linear"] in worth_trying()
    assert further_parameters(LOW_SPEED) == 2
    assert further_parameters(EFFECTS["asymmetry/linear"]) == 0
    # Other forms are tried in the place of their law only.
    assert [each.key for each in worth_trying() if each.form_of] == ["asymmetry/low_speed", "stribeck/directional"]
    assert further_parameters(EFFECTS["stribeck/directional"]) == 1


def test_in_the_place_of_plain_asymmetry_it_begins_at_the_values_that_promise_most() -> None:
    lacking = term("asymmetry", "low_speed", coefficient=3.0, low_speed=1.5, velocity=0.03)
    track = Track.of([recorded(lacking)], 140.0, NOMINAL)
    model = NOMINAL.with_terms((*NOMINAL.terms, term("asymmetry", coefficient=1.0)))
    fit = refit(track, model).fit
    place = model.prefixes.index("asymmetry")
    (begun,) = laws_in_place(track, fit, place)
    assert begun.effect is LOW_SPEED
    assert 0.01 < begun.by_name["velocity"] < 0.1
    assert begun.by_name["low_speed"] == pytest.approx(1.5, rel=0.5)
    assert begun.by_name["coefficient"] == fit.model.value("asymmetry.coefficient")
