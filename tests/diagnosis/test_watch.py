"""Watching a machine: silence while nothing changes, a mismatch soon after something does, and which component it is."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from fric.diagnosis.suspects import suspects
from fric.diagnosis.watch import Phase, Watch, WatchSettings
from fric.model import Model, Term, build_model, term
from fric.record import Array
from fric.simulation import Simulator, substeps

H = 0.002


def axis(*more: Term, coulomb: float = 8.0, viscous: float = 20.0, mass: float = 2.0) -> Model:
    return build_model("rigid", {"mass": mass}, [term("coulomb", force=coulomb), term("viscous", coefficient=viscous), *more])


def driven(parts: Sequence[tuple[Model, float]], seed: int = 0) -> tuple[Array, Array, Array]:
    """Stamps [s], positions [x] and efforts [F] of machines that take over from each other, led along one motion."""
    random = np.random.default_rng(seed)
    time = np.arange(round(sum(span for _, span in parts) / H) + 1) * H
    wanted = np.zeros_like(time)
    for frequency in (0.23, 0.61, 1.3, 2.9):
        wanted += 0.02 / frequency**0.7 * np.sin(2.0 * np.pi * frequency * time + random.uniform(0.0, 6.0))
    rate = np.gradient(wanted, H)
    first = parts[0][0]
    state = np.ascontiguousarray(
        first.plant.start(np.array(first.plant_values), float(wanted[0]), float(rate[0])), dtype=np.float64
    )
    inner = first.inner_states()
    positions, efforts = [wanted[:1]], [np.zeros(1)]
    at = 0
    for model, span in parts:
        n = round(span / H)
        position, effort = np.empty(n), np.empty(n)
        if model.has_command_path:
            _controlled(model, wanted[at : at + n], rate[at : at + n], state, position, effort)
        else:
            model.loops.lead(
                model.values, np.zeros(n), wanted[at : at + n].copy(), rate[at : at + n].copy(), np.full(n, H),
                substeps(model, H), np.ones(1), np.zeros(1), 2.0 * 80.0**2, 2.8 * 80.0, state, *inner, position, effort,
            )  # fmt: skip
        positions.append(position)
        efforts.append(effort)
        at += n
    effort = np.concatenate(efforts)
    return time, np.round(np.concatenate(positions) / 1e-7) * 1e-7, effort + 0.3 * random.standard_normal(effort.size)


def _controlled(model: Model, wanted: Array, rate: Array, state: Array, position: Array, effort: Array) -> None:
    """The same spring and damper as a controller's command, which has to pass what the model has before its plant."""
    moved = Simulator(model)
    moved.states[:] = state
    for k in range(wanted.shape[0]):
        effort[k] = 2.0 * 80.0**2 * (wanted[k] - moved.position) + 2.8 * 80.0 * (rate[k] - moved.velocity)
        moved.run(effort[k : k + 1], H)
        position[k] = moved.position
    state[:] = moved.states


def feed(watch: Watch, time: Array, position: Array, effort: Array) -> list[tuple[float, Phase]]:
    """Everything sample by sample; the phases that began, and when."""
    phases, phase = [], watch.phase
    for t, q, u in zip(time.tolist(), position.tolist(), effort.tolist(), strict=True):
        watch.take(t, q, u)
        if watch.phase is not phase:
            phase = watch.phase
            phases.append((t, phase))
    return phases


@pytest.mark.parametrize("nominal", [axis(), axis(coulomb=8.5, viscous=18.0)], ids=["true model", "model a little off"])
def test_thirty_minutes_in_which_nothing_changes_are_silent(nominal: Model) -> None:
    watch = Watch(nominal)
    phases = feed(watch, *driven([(axis(), 1800.0)], seed=3))
    assert [phase for _, phase in phases] == [Phase.LEARNING, Phase.WATCHING]
    assert phases[1][0] < 13.0
    assert not watch.counters


def play(gap: float) -> Model:
    """The load behind a gap [m], with six tenths of the mass."""
    terms = [term("coulomb", force=8.0), term("viscous", coefficient=20.0), term("backlash", gap=gap)]
    return build_model("rigid", {"mass": 2.0, "load_share": 0.6}, terms)


LOCAL = {"position": 0.01, "width": 0.02}
CHANGES = {
    "more friction": (axis(), axis(coulomb=9.0), "coulomb", "guideway friction"),
    "more viscous friction": (axis(), axis(viscous=26.0), "viscous", "load"),
    "a payload": (axis(), axis(mass=2.3), "mass", "load"),
    "friction at one place": (
        axis(term("position_dependence", "local", amplitude=0.0, **LOCAL)),
        axis(term("position_dependence", "local", amplitude=0.5, **LOCAL)),
        "position_dependence",
        "guideway friction",
    ),
    "a slower actuator": (
        axis(term("actuator_lag", time=1e-5)),
        axis(term("actuator_lag", time=0.006)),
        "actuator_lag",
        "command path",
    ),
    "backlash": (play(1e-8), play(5e-4), "backlash", "transmission"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_change_is_raised_within_five_seconds_and_its_component_named(change: str) -> None:
    before, after, effect, component = CHANGES[change]
    # The examined model has no term for what is switched on, unless it had the effect already.
    nominal = axis()
    watch = Watch(nominal)
    signals = driven([(before, 20.0), (after, 4.9)], seed=4)
    phases = feed(watch, *signals)
    detected = [t for t, phase in phases if phase is Phase.DETECTED]
    assert len(detected) == 1
    assert 20.0 < detected[0] < 25.0
    record = watch.since_change()
    assert record is not None
    found = suspects(nominal, record, *watch.clearest_floor())
    assert found.component == component
    assert found.effect == effect
    assert found.known == (effect in {"coulomb", "viscous", "mass"})
    assert 0.5 < found.confidence <= 1.0


def test_the_mismatch_ends_when_the_machine_is_itself_again() -> None:
    phases = feed(Watch(axis()), *driven([(axis(), 20.0), (axis(coulomb=9.5), 6.0), (axis(), 20.0)], seed=5))
    assert [phase for _, phase in phases] == [Phase.LEARNING, Phase.WATCHING, Phase.DETECTED, Phase.WATCHING]
    assert phases[-1][0] > 26.0


def test_gaps_stamps_backwards_and_values_that_are_no_numbers_raise_nothing() -> None:
    watch = Watch(axis())
    time, position, effort = driven([(axis(), 60.0)], seed=6)
    random = np.random.default_rng(1)
    keep = np.ones(time.size, dtype=np.bool_)
    for first in random.integers(7000, time.size - 500, 30):
        keep[first : first + int(random.integers(1, 120))] = False
    time, position, effort = time[keep], position[keep].copy(), effort[keep].copy()
    bad = random.integers(7000, time.size, 40)
    position[bad[:20]], effort[bad[20:]] = math.nan, math.inf
    order = np.arange(time.size)
    for at in random.integers(7000, time.size - 2, 30):
        order[at], order[at + 1] = order[at + 1], order[at]
    phases = feed(watch, time[order], position[order], effort[order])
    assert [phase for _, phase in phases] == [Phase.LEARNING, Phase.WATCHING]
    assert watch.counters["not finite"] >= 38
    assert watch.counters["gaps"] >= 25
    assert watch.counters["stamp before the last one"] >= 20


def test_a_clock_that_begins_anew_is_followed() -> None:
    watch = Watch(axis())
    time, position, effort = driven([(axis(), 30.0)], seed=7)
    feed(watch, time, position, effort)
    again = feed(watch, *driven([(axis(), 10.0), (axis(coulomb=9.5), 4.0)], seed=8))
    assert watch.counters["new beginnings"] == 1
    assert [phase for _, phase in again] == [Phase.DETECTED]
    assert 10.0 < again[0][0] < 14.0


def test_the_floor_is_learnt_from_motion_only() -> None:
    watch = Watch(axis(), WatchSettings(learning_time=5.0))
    rest = np.arange(10_000) * H
    feed(watch, rest, np.zeros(rest.size), np.zeros(rest.size))
    assert watch.phase is Phase.LEARNING
    assert watch.learnt == 0.0
    time, position, effort = driven([(axis(), 12.0)], seed=9)
    feed(watch, 20.0 + time, position, effort)
    assert watch.phase is Phase.WATCHING
    assert watch.learnt == pytest.approx(5.0, abs=0.11)
