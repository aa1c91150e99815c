"""Loops that look their terms up do what loops compiled for the terms do."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from fric.engine.linked import linked
from fric.model import Model, Term, build_model, term
from fric.record import Array
from fric.simulation import Simulator, predict_force

H, N = 1e-3, 1500
PLAIN = (term("coulomb", force=5.0), term("viscous", coefficient=3.0))
RIPPLES = [term("ripple", cosine=1.0 + k, sine=0.5 * k, period=0.03 / (1 + k)) for k in range(4)]


def rigid(*terms: Term) -> Model:
    return build_model("rigid", {"mass": 2.0}, [*PLAIN, *terms])


MODELS = {
    "plain": rigid(),
    "no terms": build_model("rigid", {"mass": 2.0}, []),
    "level, force and command": rigid(term("stribeck", force=3.0, velocity=0.02), RIPPLES[0], term("delay", time=1.3e-3)),
    "memory": rigid(
        term("frictional_lag", time=0.01), term("stribeck", force=3.0, velocity=0.02),
        term("compliance", "appendage", mass=0.2, frequency=20.0),
    ),
    "acceleration": rigid(term("accel_hysteresis", force=1.0, velocity=0.1)),
    "push": rigid(term("gear_friction", coefficient=0.1)),
    "bristle": rigid(term("presliding", "lugre", stiffness=1e5, damping=200.0), *RIPPLES[:2]),
    "elements": rigid(term("presliding", "gms", stiffness=1e5, attraction=100.0)),
    "play": rigid(term("backlash", gap=1e-4), term("actuator_lag", time=2e-3)),
    "spring": rigid(term("compliance", "linear", stiffness=1e5, damping=20.0), term("backlash", gap=1e-4)),
    "spring and bristle": rigid(
        term("compliance", "linear", stiffness=1e5, damping=20.0), term("presliding", "dahl", stiffness=1e5)
    ),
    "stops": rigid(term("impact_backlash", gap=1e-4, stiffness=1e6, damping=10.0)),
    "another plant": build_model(
        "two_mass", {"motor_mass": 1.0, "load_mass": 2.0}, [*PLAIN, term("compliance", "linear", stiffness=1e5, damping=20.0)]
    ),
}  # fmt: skip


def simulated(model: Model, *, table: bool) -> Array:
    """States under a force, shape ``(N, n_states)``."""
    t = H * np.arange(N)
    effort = 40.0 * np.sin(9.0 * t) + 10.0 * np.sin(55.0 * t)
    states = np.ascontiguousarray(model.plant.start(np.array(model.plant_values), 0.0, 0.0))
    found, one = np.empty((N, states.shape[0])), np.ones(1)
    loops, values = (model.linked_loops, model.linked) if table else (model.loops, model.values)
    loops.simulate(
        values, effort, H, 3, 0.0, one, 0.0 * one, states, *model.inner_states(), found, np.empty(N), np.empty(N)
    )  # fmt: skip
    return found


SLOW = ("no terms", "level, force and command", "elements", "spring", "stops", "acceleration", "another plant")
"""What others of the list hold as well, but for one more law."""


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.long) if name in SLOW else name for name in MODELS])
def test_the_motion_is_the_same(name: str) -> None:
    expected = simulated(MODELS[name], table=False)
    assert np.ptp(expected[:, 0]) > 1e-3
    np.testing.assert_allclose(simulated(MODELS[name], table=True), expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", ["1 ripple", "3 ripples", "push", "bristle"])
def test_the_force_along_a_motion_is_the_same(name: str) -> None:
    model = MODELS[name] if name in MODELS else rigid(*RIPPLES[: int(name[0])])
    t = H * np.arange(400)
    q, v, a = 0.1 * np.sin(9.0 * t), 0.9 * np.cos(9.0 * t), -8.1 * np.sin(9.0 * t)
    needed, friction, one = np.empty(400), np.empty(400), np.ones(1)
    model.linked_loops.predict(model.linked, t, q, v, a, H, one, 0.0 * one, *model.inner_states(float(v[0])), needed, friction)
    assert needed == pytest.approx(predict_force(model, t, q, v, a, H), rel=1e-9)


def test_other_terms_take_other_rows_of_the_same_loops() -> None:
    assert rigid().linked_loops is rigid(*RIPPLES[:3]).linked_loops
    assert rigid().linked_loops is not MODELS["bristle"].linked_loops
    assert rigid().linked.table.shape < rigid(RIPPLES[0]).linked.table.shape


def test_a_table_is_made_once_for_a_structure() -> None:
    first, second = rigid(RIPPLES[0]), rigid(RIPPLES[1])
    assert linked(first.plant, first.plant_values, first.terms).table is second.linked.table


def test_the_addresses_of_another_process_are_its_own() -> None:
    """What is kept on disk holds no address: a second process moves the model alike."""
    script = (
        "import numpy as np\nfrom fric.model import build_model, term\n"
        "m = build_model('rigid', {'mass': 2.0}, [term('coulomb', force=5.0), term('presliding', 'gms', stiffness=1e5, "
        "attraction=100.0)])\nx, o, one = np.zeros(2), np.empty((50, 2)), np.ones(1)\n"
        "m.linked_loops.simulate(m.linked, np.full(50, 9.0), 1e-3, 3, 0.0, one, 0 * one, x, *m.inner_states(), o, "
        "o[:, 0].copy(), o[:, 1].copy())\nprint(repr(x.tolist()))"
    )
    answers = {
        subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=100).stdout
        for _ in range(2)
    }
    assert len(answers) == 1
    assert "nan" not in answers.pop()


def test_a_run_that_takes_longer_than_compiling_is_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    model, effort = MODELS["plain"], 20.0 * np.sin(0.009 * np.arange(N))
    expected = Simulator(model, fused=True).run(effort, H)[0]
    monkeypatch.setattr("fric.simulation._WORTH_COMPILING", N)
    short, long = Simulator(model).run(effort, H, 1)[0], Simulator(model).run(np.append(effort, 0.0), H, 1)[0]
    np.testing.assert_array_equal(long[:-1], expected)
    np.testing.assert_allclose(short, expected, rtol=1e-9, atol=1e-12)
