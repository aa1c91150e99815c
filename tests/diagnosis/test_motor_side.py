"""Friction on both sides of a transmission: divided only where that is worth its parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from fric.diagnosis import diagnose
from fric.diagnosis.fitting import State, free_names, refit
from fric.diagnosis.motor_side import MOTOR_FRICTION, all_on_load, half_on_motor, undivided
from fric.diagnosis.track import Track
from fric.model import Model, Term, build_model, term
from fric.record import Record

GAP = term("backlash", gap=6e-4)


@dataclass
class _Body:
    """One body with dry and viscous friction, moved on by plain small steps."""

    mass: float
    dry: float
    viscous: float
    position: float = 0.0
    speed: float = 0.0

    def move(self, force: float, dt: float) -> None:
        if self.speed == 0.0:
            self.speed = dt / self.mass * math.copysign(max(abs(force) - self.dry, 0.0), force)
        else:
            after = self.speed + dt / self.mass * (force - math.copysign(self.dry, self.speed) - self.viscous * self.speed)
            self.speed = 0.0 if after * self.speed < 0.0 else after
        self.position += dt * self.speed


PLAY = (1.7766e6, 942.0, 6e-4)
"""Stiffness [N/m], damping [N s/m] and play [m] of a transmission: stops that give by 2 um."""
SHAFT = (1.2e4, 5.0, 0.0)


def record(
    seed: int,
    duration: float,
    of_motor: tuple[float, float],
    of_load: tuple[float, float],
    between: tuple[float, float, float] = PLAY,
) -> Record:
    """The motor's position: two bodies of 1 kg under a PD controller of the motor at 500 Hz.

    ``of_motor`` and ``of_load`` are dry [N] and viscous [N s/m] friction.
    """
    stiffness, damping, gap = between
    h, fine = 2e-3, 60
    t, planned = h * np.arange(round(duration / h)), np.random.default_rng(seed)
    wanted = np.zeros_like(t)
    for k in range(5):
        frequency = planned.uniform(0.1, 0.5) if k < 3 else planned.uniform(0.5, 1.5)
        size = 0.05 * planned.uniform(0.3, 1.0) / (1 + k)
        wanted += size * np.sin(2.0 * math.pi * frequency * t + planned.uniform(0.0, 6.28))
    wanted -= wanted[0]
    rate, noise = np.gradient(wanted, h), np.random.default_rng(seed + 1)
    motor, load = _Body(1.0, *of_motor), _Body(1.0, *of_load)
    position, force = np.empty(t.size), np.empty(t.size)
    for k in range(t.size):
        position[k] = motor.position
        u = force[k] = 8e3 * (wanted[k] - motor.position) + 120.0 * (rate[k] - motor.speed)
        for _ in range(fine):
            ahead = motor.position - load.position
            beyond = ahead - math.copysign(min(0.5 * gap, abs(ahead)), ahead)
            pressed = stiffness * beyond + damping * (motor.speed - load.speed) if beyond or not gap else 0.0
            pressed = 0.0 if gap and pressed * beyond < 0.0 else pressed
            motor.move(u - pressed, h / fine)
            load.move(pressed, h / fine)
    seen = np.round((position + 2e-7 * noise.standard_normal(t.size)) / 1e-7) * 1e-7
    return Record(t, seen, force + 0.05 * noise.standard_normal(t.size), effort_hold="following", source=f"run {seed}")


def rigid(*terms: Term, **values: float) -> Model:
    own = [term("coulomb", force=6.0), term("viscous", coefficient=22.0), term("bias", force=0.0)]
    return build_model("rigid", {"mass": 2.1, **values}, [*own, *terms])


def test_the_friction_is_divided_without_a_change_of_its_sum() -> None:
    model = rigid(GAP)
    assert undivided(model)
    assert not set(MOTOR_FRICTION) & set(free_names(model))
    divided = half_on_motor(model)
    assert divided is not None
    assert not undivided(divided)
    assert set(MOTOR_FRICTION) <= set(free_names(divided))
    assert divided.value("motor_coulomb") + divided.value("coulomb.force") == 6.0
    assert divided.value("motor_viscous") + divided.value("viscous.coefficient") == 22.0
    together = all_on_load(divided)
    assert together is not None
    assert together.values.tolist() == model.values.tolist()
    assert half_on_motor(divided) is None
    assert all_on_load(model) is None
    assert half_on_motor(rigid()) is None
    assert half_on_motor(build_model("rigid", {"mass": 2.0}, [GAP])) is None


@pytest.fixture(scope="module")
def both() -> dict[str, tuple[Track, State]]:
    """The true play fitted with all friction on the load, where it is divided and where it isn't."""
    found = {}
    for name, of_motor, of_load in (("divided", (3.0, 10.0), (4.0, 15.0)), ("load's", (0.0, 0.0), (7.0, 25.0))):
        track = Track.of([record(1, 10.0, of_motor, of_load)], 140.0, rigid(GAP))
        found[name] = track, refit(track, rigid(GAP))
    return found


def test_friction_of_the_motor_pays_where_it_is_and_not_where_it_is_not(both: dict[str, tuple[Track, State]]) -> None:
    track, state = both["divided"]
    start = half_on_motor(state.fit.model)
    assert start is not None
    divided = refit(track, start)
    assert divided.left < 0.1 * state.left
    values = {name: divided.fit.model.value(name) for name in (*MOTOR_FRICTION, "coulomb.force")}
    assert values == pytest.approx({"motor_coulomb": 3.0, "motor_viscous": 10.0, "coulomb.force": 4.0}, rel=0.2)
    together = all_on_load(divided.fit.model)
    assert together is not None
    assert refit(track, together).left > 5.0 * divided.left
    track, state = both["load's"]
    start = half_on_motor(state.fit.model)
    assert start is not None
    assert refit(track, start).left > 0.9 * state.left


def test_a_play_between_two_bodies_that_rub_is_found() -> None:
    of = (3.0, 10.0), (4.0, 15.0)
    result = diagnose([record(1, 15.0, *of)], [record(7, 10.0, *of)], rigid())
    assert [each.effect for each in result.findings] == ["backlash"]
    assert result.findings[0].confidence > 0.5
    values = {name: each.value for name, each in result.findings[0].parameters.items()}
    true = {"backlash.gap": 6e-4, "motor_coulomb": 3.0, "motor_viscous": 10.0}
    assert values == pytest.approx(true, rel=0.1)
    assert result.validation.noe_augmented < 1.5 * result.validation.noise_floor


def test_a_shaft_between_two_bodies_that_rub_is_no_presliding() -> None:
    of = (3.0, 10.0), (4.0, 15.0), SHAFT
    result = diagnose([record(1, 15.0, *of)], [record(7, 10.0, *of)], rigid())
    assert [each.effect for each in result.findings] == ["compliance"]
    assert result.findings[0].confidence > 0.5
    values = {name: each.value for name, each in result.findings[0].parameters.items()}
    assert values["compliance.stiffness"] == pytest.approx(1.2e4, rel=0.05)
    assert values["motor_coulomb"] == pytest.approx(3.0, rel=0.05)
    assert result.model.value("coulomb.force") == pytest.approx(4.0, rel=0.05)
