"""The body of a quarter car on lubricated bearings, diagnosed from a model that lets it glide without friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..figure import Figure
from ..model import build_model, term
from ..model_file import read_model
from ..record import Array, Record
from ..shared_files import config_file
from ..simulation import Simulator
from .concealed_reference import Case, Limits, evidence, found_in
from .quarter_car_reference import normal_force, road
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_STEP, _SAMPLED = 2.5e-4, 8  # [s], of the integration; steps from one sample to the next
_RESOLUTION, _NOISE = 1e-6, 3.0  # [m], [N]: of the body's encoder; of the suspension's force
_STIFFNESS, _DAMPING, _MASS = 2.89e4, 260.0, 240.0  # the paper's [N/m, N s/m, kg]
_STICTION = 199.4  # [N], the paper's: spring rate times the 6.9 mm by which it gives before the body moves
_MIDDLE = 0.065  # [m]
_STEPS, _HELD = (0.03, -0.055, 0.045, -0.065, 0.085, -0.04), 3.0  # [m], [s]
_SWINGS = ((0.31, 0.030), (0.83, 0.014), (1.9, 0.006))  # [Hz], [m]


def _swinging(time: Array) -> Array:
    """A road of three swings about the middle of the stroke [m], to which the first second leads."""
    swings = sum(amplitude * np.sin(2.0 * np.pi * frequency * time) for frequency, amplitude in _SWINGS)
    return np.asarray((_MIDDLE + swings) * np.clip(time, 0.0, 1.0))


def _stepping(time: Array) -> Array:
    """A road of steps of other heights than the paper has, about the middle of the stroke [m]."""
    heights = np.append(0.0, np.cumsum(_STEPS))[np.clip((time / _HELD).astype(np.int64), 0, len(_STEPS))]
    return np.asarray((_MIDDLE + heights) * np.clip(time, 0.0, 1.0))


def _recorded(wanted: Array, seed: int, name: str) -> Record:
    random = np.random.default_rng(seed)
    model = read_model(config_file("quarter_car_model.yaml"))
    states = Simulator(model).run(wanted, _STEP)[0][_SAMPLED - 1 :: _SAMPLED]
    deflection, rate = states[:, 2] - states[:, 0], states[:, 3] - states[:, 1]
    force = _STIFFNESS * deflection + _DAMPING * rate
    return Record(
        time=_STEP * _SAMPLED * np.arange(states.shape[0], dtype=np.float64),
        position=np.round(states[:, 0] / _RESOLUTION) * _RESOLUTION,
        effort=force + _NOISE * random.standard_normal(force.shape[0]),
        extra={"normal_load": normal_force(deflection, rate, model.value("angle"))},
        nominal={"normal_load": model.value("nominal_load")},
        source=name,
        effort_hold="linear",
    )


def _case() -> Case:
    def times(duration: float) -> Array:
        return np.asarray(_STEP * (np.arange(round(duration / _STEP)) + 0.5), dtype=np.float64)

    train = [_recorded(_swinging(times(16.0)), 31, "swings"), _recorded(_stepping(times(20.0)), 33, "steps")]
    validation = _recorded(road(times(16.0)), 32, "validation")
    return Case(train, [validation], build_model("rigid", {"mass": 1.1 * _MASS}, [term("viscous", coefficient=1500.0)]))


def _run() -> Evidence:
    case = _case()
    notes = [
        "Concealed: the bearings' friction, which grows with their load, falls with speed, and has a viscous part. The nominal"
        " model has the body's mass and nothing else, as a quarter car is usually written; the force is the suspension's.",
        "Learnt from a road of three swings and one of six steps; held back is the paper's road of a ramp and two steps.",
    ]
    found = found_in(case)
    named = ("coulomb", "load_dependence", "stribeck", "viscous")
    shown = evidence(case, found, named, ("guideway friction",), Limits(), notes)
    # What holds the body at rest: each of these is a force at speed zero, at the load around which it was recorded.
    held = [p for p in found.model.parameters() if p.name in ("coulomb.force", "stribeck.force", "load_dependence.force")]
    stiction = sum(p.value for p in held)
    return replace(
        shown,
        figures=[
            *shown.figures,
            Figure(f"break-away force, {_STICTION:g} N in the paper", stiction, "N"),
            Figure("break-away force, off from the paper's", 100.0 * abs(stiction / _STICTION - 1.0), "%", "<= 5"),
        ],
    )


VERIFICATION = Verification(
    id="concealed_bearing",
    title="Concealed: the bearings of a quarter car behind a model without friction",
    source="Al-Zughaibi 2018, Secs. 4 and 5: a car simulated without the friction that its rig has",
    run=_run,
)
