"""The balance of energy closes for every law of the catalogue, and no law delivers energy.

Every effect of the catalogue that acts on the contact takes part: a body is moved by a periodic force, and in every step the
work of the actuator must be the change of kinetic energy, plus the work done on the contact, plus that done against the other
forces. The simulation reports the contact's mean force over a step; the other forces are evaluated here, in the middle of the
step, so that the sum doesn't close by construction.

Laws that aren't pre-sliding laws share models, the first of each kind in one, the second of each kind in the next, and so on.
Each pre-sliding law has a model of its own. What its springs hold is typed here, K d^2/2 for each spring; then what the contact
dissipates in a step is the work done on it minus the change of that, and may not be negative. A law whose springs aren't known
here must never have given back more than it was given since the relaxed start.

A force that depends on position and velocity must not give energy over a closed cycle: its work over one is evaluated directly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from ..effect import Context, Effect, Place
from ..effects import EFFECTS
from ..figure import Figure
from ..model import Model, Term, build_model, term
from ..parameter import Parameter
from ..record import Array
from ..report.figures import COLOURS, Curve, stacked
from ..simulation import Simulator
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_MASS, _COULOMB = 1.0, 4.0
_STEP = 2e-5  # [s]
_PERIOD, _PERIODS = 0.5, 2  # [s]; the last period counts as the closed cycle
_CONTACT = (Place.SLIP_LEVEL, Place.SLIP_DYNAMICS, Place.FORCE)

# A value for each dimension, such that every effect has a share in the motion.
_TYPICAL = {
    "F": 0.5, "F/x": 50.0, "F s/x": 3.0, "F s^2/x^2": 2.0, "F/x^3": 1e3, "F/s": 1e3, "x": 0.02, "x/s": 0.02, "s": 0.02,
}  # fmt: skip
# Where that isn't enough: asperities light, few and short, their friction not beyond what the actuator can overcome.
_OWN = {"presliding/asperity": {"mass": 0.0, "asperities": 300.0, "wavelength": 2e-4, "growth": 1.5}}
_STIFFNESS = 1e5  # of a pre-sliding law, all its springs together [N/m]
_DAMPING = 10.0  # of its bristles [N s/m]; below 4 g/|v|, see effects/presliding_lugre.py


@dataclass(frozen=True)
class _Run:
    """A run and its energies; arrays have one entry for each step."""

    name: str
    actuator: Array
    kinetic: Array
    contact: Array
    others: Array
    held: Array | None

    @property
    def residual(self) -> float:
        """What is missing in the balance, of the work that the actuator exchanged."""
        missing = np.cumsum(self.actuator - self.kinetic - self.contact - self.others)
        return float(np.max(np.abs(missing)) / np.sum(np.abs(self.actuator)))

    @property
    def dissipated(self) -> Array:
        """In each step [J]."""
        return self.contact if self.held is None else self.contact - self.held

    @property
    def delivered(self) -> float:
        """Most that the contact has given back beyond what it got, of the work that it exchanged."""
        given = -np.min(np.cumsum(self.contact)) if self.held is None else -np.min(self.dissipated)
        return float(max(given, 0.0) / np.sum(np.abs(self.contact)))

    @property
    def cycle(self) -> float:
        """Work done on the contact over the last period, of what it exchanged then."""
        last = self.contact[-round(_PERIOD / _STEP) :]
        return float(np.sum(last) / max(np.sum(np.abs(last)), 1e-300))

    @property
    def moving(self) -> float:
        """Share of the steps in which the contact does work."""
        return float(np.mean(self.contact != 0.0))


def _value(effect: Effect, parameter: Parameter) -> float:
    own = _OWN.get(effect.key, {})
    if parameter.name in own:
        return own[parameter.name]
    if parameter.default:
        return parameter.default
    value = _TYPICAL.get(parameter.dimension, 0.3)
    if effect.place is Place.SLIP_DYNAMICS and parameter.dimension == "F/x":
        value = _STIFFNESS / sum(other.dimension == "F/x" for other in effect.parameters)
    elif effect.place is Place.SLIP_DYNAMICS and parameter.dimension == "F s/x":
        value = _DAMPING
    return min(max(value, parameter.lower), parameter.upper)


def _term(effect: Effect) -> Term:
    return Term(effect, tuple(_value(effect, parameter) for parameter in effect.parameters))


def _models() -> list[tuple[str, Model]]:
    """A model for each pre-sliding law, and models of the n-th law of every other effect."""
    base = [term("coulomb", force=_COULOMB), term("viscous", coefficient=2.0)]
    dynamics = [effect for effect in EFFECTS.values() if effect.slip is not None]
    found = [(effect.key, build_model("rigid", {"mass": _MASS}, [*base, _term(effect)])) for effect in dynamics]
    groups: dict[int, list[Effect]] = {}
    seen: dict[str, int] = {}
    for effect in EFFECTS.values():
        if effect.place not in _CONTACT or effect.slip is not None or effect.id in ("coulomb", "viscous"):
            continue
        seen[effect.id] = seen.get(effect.id, -1) + 1
        groups.setdefault(seen[effect.id], []).append(effect)
    for effects in groups.values():
        model = build_model("rigid", {"mass": _MASS}, [*base, *(_term(effect) for effect in effects)])
        found.append((", ".join(effect.key for effect in effects), model))
    return found


def _held(law: Effect, values: Sequence[float]) -> Callable[[Array], float] | None:
    """Energy in the springs of a pre-sliding law [J] from its states."""
    named = {parameter.name: value for parameter, value in zip(law.parameters, values, strict=True)}
    if law.law in ("lugre", "dahl", "elasto_plastic"):
        return lambda z: float(0.5 * named["stiffness"] * z[0] ** 2)
    if law.law == "gms":
        m = int(named["elements"])
        return lambda z: float(0.5 * named["stiffness"] / m * (z[:m] @ z[:m]))
    if law.law == "maxwell_slip":
        stiffness = np.array([named[f"stiffness_{i}"] for i in range(1, 11)])
        return lambda z: float(0.5 * stiffness @ z**2)
    return None


def _led(name: str, model: Model) -> _Run:
    """Move ``model`` by a periodic force and keep account of its energies."""
    n = round(_PERIOD * _PERIODS / _STEP)
    t = _STEP * (np.arange(n, dtype=np.float64) + 0.5)
    effort = 11.0 * np.sin(2 * np.pi * t / _PERIOD) + 3.0 * np.sin(6 * np.pi * t / _PERIOD)
    simulator = Simulator(model)
    law = next((held for held in model.terms if held.effect.slip is not None), None)
    springs = _held(law.effect, law.values) if law is not None else None
    if springs is None:
        states, friction = simulator.run(effort, _STEP, 1)
        held = None
    else:
        states, friction, energy = np.empty((n, 2)), np.empty(n), np.zeros(n + 1)
        for k in range(n):
            states[k : k + 1], friction[k : k + 1] = simulator.run(effort[k : k + 1], _STEP, 1)
            energy[k + 1] = springs(simulator.friction_state)
        held = np.diff(energy)
    q, v = np.r_[0.0, states[:, 0]], np.r_[0.0, states[:, 1]]
    way = np.diff(q)
    others = _forces(model, 0.5 * (q[1:] + q[:-1]), way / _STEP, t)
    return _Run(name, effort * way, 0.5 * _MASS * np.diff(v**2), friction * way, others * way, held)


def _forces(model: Model, q: Array, v: Array, t: Array) -> Array:
    """Sum of the terms that are forces [N], from their own functions, at each position and velocity."""
    total = np.zeros(q.shape[0])
    nothing = np.empty(0)
    for held in model.terms:
        force = held.effect.force
        if force is not None:
            for k in range(q.shape[0]):
                c = Context(q[k], v[k], math.copysign(1.0, v[k]), t[k], 1.0, 0.0, 0.0, _STEP, nothing, 0.0)
                total[k] += force(c, *held.values)
    return total


def _cycle_work(effect: Effect) -> float:
    """Work done against a force over a closed cycle, of what it exchanges."""
    n = 2000
    angle = 2 * np.pi * (np.arange(n) + 0.5) / n
    velocity = 0.4 * np.cos(angle)
    model = build_model("rigid", {"mass": _MASS}, [_term(effect)])
    power = _forces(model, 0.07 * np.sin(angle), velocity, np.zeros(n)) * velocity
    return float(np.sum(power) / max(np.sum(np.abs(power)), 1e-300))


def _run() -> Evidence:
    runs = [_led(name, model) for name, model in _models()]
    springs = [run for run in runs if run.held is not None]
    forces = [effect for effect in EFFECTS.values() if effect.force is not None and not effect.n_memory]
    works = {effect.key: _cycle_work(effect) for effect in forces}
    figures = [
        Figure("laws that took part", sum(effect.place in _CONTACT for effect in EFFECTS.values()), ""),
        Figure("largest gap in the balance, of the actuator's work", max(run.residual for run in runs), "1", "<= 1e-6"),
        Figure("most energy delivered by a contact, of what it exchanges", max(run.delivered for run in runs), "1", "<= 1e-9"),
        Figure(
            "least work on a contact over a closed cycle, of what it exchanges", min(run.cycle for run in runs), "1", ">= 0.5"
        ),
        Figure("least work against a force over a closed cycle, of what it exchanges", min(works.values()), "1", ">= -1e-9"),
        Figure("least share of the time in which a body moved", min(run.moving for run in runs), "1", ">= 0.3"),
    ]
    figures += [
        Figure(f"{run.name}: gap in the balance, of the actuator's work", run.residual, "1", "<= 1e-6") for run in springs
    ]
    shown = next(run for run in springs if run.name == "presliding/gms")
    notes = [
        f"Balances of {len(runs)} models over {_PERIODS * _PERIOD:g} s in steps of {1e6 * _STEP:g} µs. In one model each: "
        + "; ".join(run.name for run in runs)
        + ".",
        "LuGre and elasto-plastic bristles with damping are passive while sigma_1 < 4 g/|v|; the damping here is below that.",
        "Work over a closed cycle: " + ", ".join(f"{key} {work:.2g}" for key, work in works.items()) + ".",
    ]
    return Evidence(figures, [(_energies(shown), "GMS: where the work of the actuator goes."), _gaps(runs)], notes)


def _energies(run: _Run) -> go.Figure:
    t = _STEP * np.arange(1, run.actuator.shape[0] + 1)
    assert run.held is not None
    return stacked(
        [
            (
                "energy [J]",
                [
                    Curve("work of the actuator", t, np.cumsum(run.actuator), "true", width=2.4),
                    Curve("dissipated in the contact", t, np.cumsum(run.dissipated), "before"),
                    Curve("viscous", t, np.cumsum(run.others), "second"),
                    Curve("kinetic", t, np.cumsum(run.kinetic), "after"),
                ],
            ),
            ("in the springs [mJ]", [Curve("held by the springs", t, 1e3 * np.cumsum(run.held), "reference")]),
        ],
        "time [s]",
        200,
    )


def _gaps(runs: Sequence[_Run]) -> tuple[go.Figure, str]:
    names = [run.name if len(run.name) < 40 else f"{run.name[:36]} …" for run in runs]
    plot = go.Figure(
        go.Bar(x=[max(run.residual, 1e-16) for run in runs], y=names, orientation="h", marker_color=COLOURS["after"])
    )
    plot.update_xaxes(type="log", dtick=1, exponentformat="power", title_text="gap in the balance, of the actuator's work")
    plot.update_layout(template="plotly_white", height=80 + 34 * len(runs), margin={"l": 16, "r": 16, "t": 36, "b": 46})
    plot.update_yaxes(automargin=True)
    return plot, "Gap in the balance of energy for each model; the goal is 1e-6."


VERIFICATION = Verification(
    id="passivity",
    title="Energy: the balance closes, and no law delivers any",
    source="conservation of energy",
    run=_run,
)
