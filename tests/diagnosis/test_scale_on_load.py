"""Backlash and compliance in recordings of the load's position, moved by an integrator that shares nothing with fric's."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from fric.diagnosis import Diagnosis, diagnose
from fric.diagnosis.candidates import candidates, scales_of
from fric.diagnosis.track import Track
from fric.diagnosis.twin import twins
from fric.model import Model, Term, build_model, term
from fric.record import Record

pytestmark = pytest.mark.timeout(900)  # the first of them compiles loops that no other test needs


@dataclass(frozen=True)
class TwoBodies:
    """Motor and load of 1 kg each, coupled by a spring that has a play; friction of the load 4 N and 20 N s/m."""

    stiffness: float
    damping: float
    gap: float = 0.0

    def record(self, seed: int, duration: float) -> Record:
        """The load's position under a PD controller of the motor at 500 Hz; noise 0.2 um and 0.05 N."""
        h, fine = 2e-3, 40
        t, planned = h * np.arange(round(duration / h)), np.random.default_rng(seed)
        wanted = np.zeros_like(t)
        for k in range(5):
            frequency = planned.uniform(0.1, 0.5) if k < 3 else planned.uniform(0.5, 1.5)
            size = 0.05 * planned.uniform(0.3, 1.0) / (1 + k)
            wanted += size * np.sin(2.0 * math.pi * frequency * t + planned.uniform(0.0, 6.28))
        wanted -= wanted[0]
        rate, noise = np.gradient(wanted, h), np.random.default_rng(seed + 1)
        q = v = y = w = 0.0
        position, force = np.empty(t.size), np.empty(t.size)
        for k in range(t.size):
            position[k] = q
            u = force[k] = 8e3 * (wanted[k] - y) + 120.0 * (rate[k] - w)
            for _ in range(fine):
                passed = self._force(y - q, w - v)
                w += h / fine * (u - passed)
                if v == 0.0:
                    v = h / fine * math.copysign(max(abs(passed) - 4.0, 0.0), passed)
                else:
                    after = v + h / fine * (passed - math.copysign(4.0, v) - 20.0 * v)
                    v = 0.0 if after * v < 0.0 else after
                y += h / fine * w
                q += h / fine * v
        seen = np.round((position + 2e-7 * noise.standard_normal(t.size)) / 1e-7) * 1e-7
        return Record(t, seen, force + 0.05 * noise.standard_normal(t.size), effort_hold="following", source=f"run {seed}")

    def _force(self, ahead: float, faster: float) -> float:
        """Of the spring on the load [N]; where there is a play it presses only."""
        beyond = ahead - math.copysign(min(0.5 * self.gap, abs(ahead)), ahead)
        if self.gap and beyond == 0.0:
            return 0.0
        force = self.stiffness * beyond + self.damping * faster
        return 0.0 if self.gap and force * beyond < 0.0 else force


SHAFT = TwoBodies(1263.0, 2.51)  # 8 Hz, a damping ratio of 0.05
PLAY = TwoBodies(1.7766e6, 942.0, 6e-4)  # stops that give by 2 um


def nominal(*more: Term, encoder: str = "load") -> Model:
    own = [term("coulomb", force=5.0), term("viscous", coefficient=15.0), term("bias", force=0.0)]
    return build_model("rigid", {"mass": 2.2}, [*own, *more], encoder=encoder)


def found(truth: TwoBodies, model: Model) -> Diagnosis:
    return diagnose([truth.record(1, 15.0)], [truth.record(7, 10.0)], model)


@pytest.mark.parametrize(
    ("truth", "hidden", "times"),
    [(SHAFT, term("compliance", stiffness=1263.0, damping=2.51), 20.0), (PLAY, term("backlash", gap=6e-4), 10.0)],
    ids=["shaft", "play"],
)
def test_the_true_model_lacks_what_its_twin_lacks(truth: TwoBodies, hidden: Term, times: float) -> None:
    values = {"mass": 2.0, "load_share": 0.5}
    own = [term("coulomb", force=4.0), term("viscous", coefficient=20.0)]
    true, rigid = (
        build_model("rigid", values if more else {"mass": 2.0}, [*own, *more], encoder="load") for more in ([hidden], [])
    )
    track = Track.of([truth.record(1, 15.0)], 140.0, rigid)
    lacks, without = (float(np.sum(track.residual(model) ** 2)) for model in (true, rigid))
    (twin,) = twins(track, true, 1)
    # Stops of the truth that give take a little longer than those of the model.
    assert lacks < 1.5 * float(np.sum(track.residual(true, twin) ** 2))
    assert without > times * lacks
    # With the motor's position in its place the same model is wrong.
    of_motor = build_model("rigid", values, true.terms)
    assert float(np.sum(track.residual(of_motor) ** 2)) > times * lacks


def test_a_play_behind_the_motor_is_found_where_the_load_is_measured() -> None:
    result = found(PLAY, nominal())
    assert [each.effect for each in result.findings] == ["backlash"]
    assert result.findings[0].confidence > 0.5
    assert result.model.encoder == "load"
    assert result.model.value("mass") == pytest.approx(2.0, rel=0.02)
    # Play and share of the mass are told together: the motor takes sqrt(4 gap m_m / u) to cross it, from rest.
    crossing = result.model.value("backlash.gap") * (1.0 - result.model.value("load_share"))
    assert crossing == pytest.approx(6e-4 * 0.5, rel=0.05)


@pytest.mark.long
def test_a_shaft_before_the_load_is_found_where_the_load_is_measured() -> None:
    result = found(SHAFT, nominal())
    assert result.findings[0].effect == "compliance"
    assert result.findings[0].confidence > 0.5
    # Bristles that give by less than the sensor tells may be told beside it, as unlikely.
    assert all(each.confidence < 0.5 for each in result.findings[1:])
    values = {name: each.value for name, each in result.findings[0].parameters.items()}
    assert values["compliance.stiffness"] == pytest.approx(1263.0, rel=0.02)
    assert result.model.value("load_share") == pytest.approx(0.5, rel=0.05)


@pytest.mark.long
def test_taken_for_the_motors_position_it_stays_unknown() -> None:
    result = found(PLAY, nominal(encoder="motor"))
    assert result.findings[0].effect == "unknown"


def test_plays_are_tried_closer_where_the_load_is_measured() -> None:
    track = Track.of([PLAY.record(1, 4.0)], 140.0, nominal())
    tried = {}
    for encoder in ("motor", "load"):
        offered = candidates(nominal(encoder=encoder), scales_of(track))
        tried[encoder] = {each.effect.key: [trial.values for trial in each.trials] for each in offered}
    for key, trials in tried["motor"].items():
        closer = tried["load"][key]
        assert set(trials) <= set(closer)
        assert len(closer) == (2 * len(trials) - 1 if "backlash" in key else len(trials))
