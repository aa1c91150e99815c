"""Rising static friction: the six laws as printed, the age of a contact, and break-away in a running model."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from fric.effect import Context
from fric.effects import EFFECTS
from fric.model import Model, build_model, term
from fric.simulation import Predictor, Simulator
from fric.steps.ageing import grow_older
from scipy.integrate import solve_ivp

F_C, D_0, MASS = 4.0, 1e-4, 1.5
INF = 1e30

# The laws of Appendix I in its own parameters (F_inf, F_0, C_1, C_2, C_3), after the corrections that the modules state, and
# the same laws in the parameters of the effects.
LAWS: dict[str, tuple[dict[str, float], Callable[[float], float], float, float]] = {
    "exponential": (
        {"force": 2.0, "initial": 0.5, "time": 0.3, "exponent": 0.7},
        lambda t: 2.0 - (2.0 - 0.5) * np.exp(-(0.3**-0.7) * t**0.7),
        0.5,
        2.0,
    ),
    "exponential_power": (
        {"force": 2.0, "time": 0.3, "exponent": 0.7, "power": 0.6},
        lambda t: 2.0 * (1.0 - np.exp(-(0.3**-0.7) * t**0.7)) ** 0.6,
        0.0,
        2.0,
    ),
    "hyperbolic": ({"force": 2.0, "initial": 0.5, "time": 0.3}, lambda t: 0.5 + (2.0 - 0.5) * t / (t + 0.3), 0.5, 2.0),
    "power": ({"force": 1.2, "exponent": 0.2}, lambda t: 1.2 * t**0.2, 0.0, INF),
    "root": (
        {"force": 2.0, "ratio": 4.0, "time": 0.3},
        lambda t: 2.0 / ((2.0 / 0.5 - 1.0) / np.sqrt(t / 0.3 + 1.0) + 1.0),
        0.5,
        2.0,
    ),
    "logarithmic": ({"force": 0.2, "initial": 0.5, "time": 0.01}, lambda t: 0.5 + 0.2 * np.log(100.0 * t + 1.0), 0.5, INF),
}
ALL = pytest.mark.parametrize("law", list(LAWS))


def surplus(law: str, age: float, base: float = 0.0) -> float:
    """What the effect adds for a contact of this age, at an instant."""
    parameters = LAWS[law][0]
    c = Context(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, np.array([age]), 0.0)
    effect = EFFECTS[f"dwell_time/{law}"]
    return effect.level(c, base, 0, *effect.values({**parameters, "length": D_0}))  # type: ignore[misc]


def model_with(law: str) -> Model:
    terms = [term("coulomb", force=F_C), term("dwell_time", law, length=D_0, **LAWS[law][0])]
    return build_model("rigid", {"mass": MASS}, terms)


def test_there_are_six_laws() -> None:
    assert {effect.law for effect in EFFECTS.values() if effect.id == "dwell_time"} == set(LAWS)


@ALL
def test_the_law_as_printed(law: str) -> None:
    _, printed, first, last = LAWS[law]
    ages = np.geomspace(1e-6, 1e6, 60)
    found = [surplus(law, age) for age in ages]
    assert found == pytest.approx([printed(age) for age in ages], rel=1e-12)
    assert [surplus(law, age, 3.0) for age in ages] == pytest.approx(np.array(found) + 3.0)
    assert surplus(law, 0.0) == pytest.approx(first, abs=1e-15)
    assert surplus(law, INF) == pytest.approx(last, rel=1e-6) if last < INF else surplus(law, INF) > 5.0 * surplus(law, 1.0)
    # "All the functions have an increasing value as a function of the contact time."
    assert np.all(np.diff([surplus(law, age) for age in np.geomspace(1e-6, 1.0, 60)]) > 0.0)


def aged(velocity: Callable[[float], float], start: float, duration: float, h: float) -> float:
    memory = np.array([start])
    for k in range(round(duration / h)):
        c = Context(0.0, velocity((k + 0.5) * h), 1.0, 0.0, 1.0, 0.0, 0.0, h, memory, 0.0)
        grow_older(c, 0, D_0)
    return float(memory[0])


def test_the_age_of_a_contact() -> None:
    assert aged(lambda t: 0.0, 0.25, 1.0, 1e-3) == pytest.approx(1.25)  # at rest: the clock
    for v in (-0.3, 0.02):
        assert aged(lambda t, v=v: v, 5.0, 1.0, 0.1) == pytest.approx(D_0 / abs(v))  # type: ignore[misc]
    assert aged(lambda t: 0.002, 0.0, 0.02, 1e-3) == pytest.approx(0.05 * (1.0 - np.exp(-0.4)))

    def velocity(t: float) -> float:
        return 0.004 * np.sin(12.0 * t)

    reference = solve_ivp(
        lambda t, y: 1.0 - abs(velocity(t)) * y / D_0, (0.0, 1.0), [0.1], "DOP853", rtol=1e-11, atol=1e-14, max_step=1e-3
    )
    errors = [abs(aged(velocity, 0.1, 1.0, h) / reference.y[0, -1] - 1.0) for h in (4e-3, 2e-3, 1e-3)]
    assert errors[-1] < 1e-4
    assert errors[0] / errors[2] > 10.0  # second order in the step: sixteen times


@ALL
def test_sliding_friction_is_static_friction_after_the_time_to_creep(law: str) -> None:
    """Rabinowicz: F_static(t = D_0/v) = F_dynamic(v)."""
    for v in (1e-4, 1e-3, 0.05):
        n = 400
        h = D_0 / v / 20.0
        t = np.arange(n) * h
        _, friction = Predictor(model_with(law)).run(t, v * t, np.full(n, v), np.zeros(n), h)
        assert friction[-1] == pytest.approx(F_C + LAWS[law][1](D_0 / v), rel=1e-6)


@ALL
def test_break_away_after_rests_of_graded_length(law: str) -> None:
    """Coast to rest, wait, pull up: the force at which the body moves follows the law that was put in."""
    printed = LAWS[law][1]

    def coasting(_: float, y: np.ndarray) -> list[float]:
        return [-(F_C + printed(y[1])) / MASS, 1.0 - y[0] * y[1] / D_0]

    stopped = lambda _, y: y[0]  # noqa: E731
    stopped.terminal = True  # type: ignore[attr-defined]
    reference = solve_ivp(coasting, (0.0, 1.0), [0.05, D_0 / 0.05], "Radau", events=stopped, rtol=1e-9, atol=1e-14)
    stop, age_then = reference.t[-1], reference.y[1, -1]

    h, pull = 1e-4, 400.0
    for rest in (0.02, 0.3, 4.0):
        simulator = Simulator(model_with(law), velocity=0.05)
        simulator.memory[:] = D_0 / 0.05
        simulator.run(np.zeros(round((stop + rest) / h)), h)
        assert simulator.velocity == 0.0
        begin = simulator.time
        u = pull * h * (np.arange(1, 400) - 0.5)  # mean of the ramp over each interval
        states, friction = simulator.run(u, h)
        first = int(np.flatnonzero(states[:, 1])[0])
        assert np.all(friction[:first] == u[:first])
        age = age_then + begin - stop + first * h
        assert u[first] - F_C == pytest.approx(printed(age), rel=0.01, abs=pull * h)


def test_the_slip_after_break_away_as_an_independent_integration_has_it() -> None:
    printed = LAWS["hyperbolic"][1]
    h = 1e-3
    u = 20.0 * h * (np.arange(450) + 0.5)
    simulator = Simulator(model_with("hyperbolic"))
    states, _ = simulator.run(u, h)
    first = int(np.flatnonzero(states[:, 1])[0])

    # The steps of the command make break-away a little early or late; from there on both see the same steps.
    y = [states[first, 0], states[first, 1], np.nan]
    other = Simulator(model_with("hyperbolic"))
    other.run(u[: first + 1], h)
    y[2] = other.memory[0]
    worst = 0.0
    for k in range(first + 1, 450):
        step = solve_ivp(
            lambda _, y, k=k: [y[1], (u[k] - F_C - printed(y[2])) / MASS, 1.0 - abs(y[1]) * y[2] / D_0],
            (0.0, h),
            y,
            "Radau",
            rtol=1e-8,
            atol=1e-12,
        )
        y = list(step.y[:, -1])
        worst = max(worst, abs(y[1] - states[k, 1]))
    assert worst < 2e-4 * np.max(states[:, 1])
