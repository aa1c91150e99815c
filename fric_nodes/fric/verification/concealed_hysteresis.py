"""A pneumatic cylinder whose friction is larger while it speeds up, diagnosed from friction over velocity alone (Model A)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..figure import Figure
from ..model import build_model, term
from ..record import Record
from . import pneumatic_reference as reference
from .concealed_reference import Case, Limits, evidence, found_in
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_STEP = 5e-4  # [s]
_RESOLUTION, _NOISE = 1e-7, 4e-3  # [m], [N]
_TRAIN = (0.0212, 0.0225, 0.0208, 0.0240, 0.0218, 0.0230, 0.0209, 0.0221)  # commands of the valve, one for each slip
_VALIDATION = (0.0215, 0.0235, 0.0210, 0.0224, 0.0228)


def _recorded(commands: tuple[float, ...], seed: int, name: str) -> Record:
    random = np.random.default_rng(seed)
    position, force = reference.slips(0.02, commands, _STEP)
    return Record(
        time=_STEP * np.arange(position.shape[0], dtype=np.float64),
        position=np.round(position / _RESOLUTION) * _RESOLUTION,
        effort=force + _NOISE * random.standard_normal(force.shape[0]),
        source=name,
        effort_hold="linear",
    )


def _case() -> Case:
    values = reference.FRICTION
    terms = [
        term("coulomb", force=0.9 * values["F_C"]),
        term("stribeck", "hess_soom", force=values["F_S"] - values["F_C"], velocity=values["v_s"]),
        term("viscous", coefficient=1.1 * values["F_v"]),
    ]
    nominal = build_model("rigid", {"mass": 0.95 * reference.MASS}, terms)
    return Case([_recorded(_TRAIN, 41, "training")], [_recorded(_VALIDATION, 42, "validation")], nominal)


def _run() -> Evidence:
    case = _case()
    notes = [
        "Concealed: friction above its kinetic level while the piston speeds up, and none while it slows down. The nominal"
        " model is Model A, the Stribeck curve; the recordings are stick-slips under the force of the measured pressures.",
    ]
    named = ("accel_hysteresis", "frictional_lag")  # of which one is a sudden change of branch, the other a gradual one
    found = found_in(case)
    shown = evidence(case, found, named, ("guideway friction",), Limits(), notes)
    values = {p.name: p.value for p in found.model.parameters()}
    told = reference.FRICTION["F_S"] - reference.FRICTION["F_C"]
    surplus = values.get("accel_hysteresis.force", 0.0)
    return replace(
        shown,
        figures=[
            *shown.figures,
            Figure(f"friction more while it speeds up, {told:g} N in the paper", surplus, "N"),
            Figure("friction more while it speeds up, off from the paper's", 100.0 * abs(surplus / told - 1.0), "%", "<= 5"),
        ],
    )


VERIFICATION = Verification(
    id="concealed_hysteresis",
    title="Concealed: hysteresis of a pneumatic cylinder's friction behind a Stribeck curve",
    source="Szell, Secs. 4 and 5: Model A against Models B to D; the cylinder integrated by Radau's method",
    run=_run,
)
