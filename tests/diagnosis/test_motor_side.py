"""Friction on both sides of a transmission: divided only where that is worth its parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from fric.diagnosis import diagnose
from fric.diagnosis.fitting import MOTOR_FRICTION, State, free_names, refit
from fric.diagnosis.motor_side import better_divided, moved_to_motor, undivided, with_friction_divided
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


def record(seed: int, duration: float, of_motor: tuple[float, float], of_load: tuple[float, float]) -> Record:
    """The motor's position: two bodies of 1 kg, a play of 0.6 mm with stops that give by 2 um, a PD controller at 500 Hz.

    ``of_motor`` and ``of_load`` are dry [N] and viscous [N s/m] friction.
    """
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
            beyond = ahead - math.copysign(min(3e-4, abs(ahead)), ahead)
            pressed = 1.7766e6 * beyond + 942.0 * (motor.speed - load.speed) if beyond else 0.0
            pressed = 0.0 if pressed * beyond < 0.0 else pressed
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
    divided = moved_to_motor(model)
    assert not undivided(divided)
    assert set(MOTOR_FRICTION) <= set(free_names(divided))
    assert divided.value("motor_coulomb") + divided.value("coulomb.force") == 6.0
    assert divided.value("motor_viscous") + divided.value("viscous.coefficient") == 22.0
    assert not undivided(rigid())
    bare = build_model("rigid", {"mass": 2.0}, [GAP])
    assert moved_to_motor(bare) is bare


@pytest.fixture(scope="module")
def both() -> dict[str, tuple[Track, State]]:
    """The true play fitted with all friction on the load, where it is divided and where it isn't."""
    found = {}
    for name, of_motor, of_load in (("divided", (3.0, 10.0), (4.0, 15.0)), ("load's", (0.0, 0.0), (7.0, 25.0))):
        track = Track.of([record(1, 10.0, of_motor, of_load)], 140.0, rigid(GAP))
        found[name] = track, refit(track, rigid(GAP))
    return found


def test_friction_of_the_motor_comes_where_it_is_and_goes_where_it_is_not(both: dict[str, tuple[Track, State]]) -> None:
    track, state = both["divided"]
    assert better_divided(track, state.fit) is not state.fit
    ((_, divided),) = with_friction_divided(track, state)
    assert divided.left < 0.1 * state.left
    values = {name: divided.fit.model.value(name) for name in (*MOTOR_FRICTION, "coulomb.force")}
    assert values == pytest.approx({"motor_coulomb": 3.0, "motor_viscous": 10.0, "coulomb.force": 4.0}, rel=0.2)
    ((_, bare),) = with_friction_divided(track, divided)
    assert undivided(bare.fit.model)
    assert bare.left > 5.0 * divided.left
    track, state = both["load's"]
    assert better_divided(track, state.fit) is state.fit
    ((_, divided),) = with_friction_divided(track, state)
    assert divided.left > 0.9 * state.left


def test_a_play_between_two_bodies_that_rub_is_found() -> None:
    of = (3.0, 10.0), (4.0, 15.0)
    result = diagnose([record(1, 15.0, *of)], [record(7, 10.0, *of)], rigid())
    assert [each.effect for each in result.findings] == ["backlash"]
    assert result.findings[0].confidence > 0.5
    values = {name: each.value for name, each in result.findings[0].parameters.items()}
    true = {"backlash.gap": 6e-4, "motor_coulomb": 3.0, "motor_viscous": 10.0}
    assert values == pytest.approx(true, rel=0.1)
    assert result.validation.noe_augmented < 1.5 * result.validation.noise_floor
