"""LuGre at 1 kHz against an implicit integration at tight tolerance, through pre-sliding, break-away, sliding and reversals.

The equations (Canudas de Wit et al. 1995, Eqs. 1 to 5) and their Jacobian are typed here a second time and integrated by
scipy's Radau with a relative tolerance of 1e-10. The friction that the simulation gives for a sample is its mean over the
interval, so the reference is the mean as well, from the friction's impulse as a fourth state.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from ..figure import Figure
from ..model import build_model, term
from ..record import Array
from ..report.figures import Curve, stacked
from ..simulation import Simulator
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_MASS, _VISCOUS = 1.2, 10.0
_COULOMB, _SURPLUS, _STRIBECK = 4.0, 2.0, 0.01
_STIFFNESS, _DAMPING = 1e5, 100.0
_HOLD, _STEP = 0.01, 1e-3  # [s] for which a force is held, and between samples


def _effort() -> tuple[Array, dict[str, slice]]:
    """The force of each hold [N], and which samples belong to which regime."""
    t = _HOLD * (np.arange(30) + 0.5)
    presliding = 3.0 * np.sin(2 * np.pi * 5.0 * t)
    t = _HOLD * (np.arange(80) + 0.5)
    sliding = 12.0 * np.sin(2 * np.pi * 1.3 * t)
    per_hold = round(_HOLD / _STEP)
    regimes = {"pre-sliding": slice(0, 30 * per_hold), "sliding and reversals": slice(30 * per_hold, 110 * per_hold)}
    return np.concatenate([presliding, sliding]), regimes


def _right_side(t: float, y: Array, u: float) -> Array:
    _, v, z, _ = y
    g = _COULOMB + _SURPLUS * np.exp(-((v / _STRIBECK) ** 2))
    dz = v - _STIFFNESS * abs(v) / g * z
    friction = _STIFFNESS * z + _DAMPING * dz
    return np.array([v, (u - friction - _VISCOUS * v) / _MASS, dz, friction])


def _jacobian(t: float, y: Array, u: float) -> Array:
    _, v, z, _ = y
    fall = _SURPLUS * np.exp(-((v / _STRIBECK) ** 2))
    g, dg = _COULOMB + fall, -2.0 * v / _STRIBECK**2 * fall
    dv = 1.0 - _STIFFNESS * np.sign(v) / g * z + _STIFFNESS * abs(v) * z / g**2 * dg
    dz = -_STIFFNESS * abs(v) / g
    f_v, f_z = _DAMPING * dv, _STIFFNESS + _DAMPING * dz
    return np.array([[0, 1, 0, 0], [0, -(f_v + _VISCOUS) / _MASS, -f_z / _MASS, 0], [0, dv, dz, 0], [0, f_v, f_z, 0]])


def _reference(effort: Array) -> tuple[Array, Array]:
    """Position at the end of each sample [m] and mean friction over it [N]."""
    y = np.zeros(4)
    rows = [y]
    grid = _STEP * np.arange(1, round(_HOLD / _STEP) + 1)
    tolerance = 1e-10 * np.array([1e-3, 1e-2, 1e-5, 1e-2])
    for u in effort:
        answer = solve_ivp(
            _right_side, (0.0, grid[-1]), y, method="Radau", rtol=1e-10, atol=tolerance, t_eval=grid, args=(u,), jac=_jacobian
        )
        rows += list(answer.y.T)
        y = answer.y[:, -1]
    states = np.array(rows)
    return states[1:, 0], np.diff(states[:, 3]) / _STEP


def _run() -> Evidence:
    effort, regimes = _effort()
    position, expected = _reference(effort)
    model = build_model(
        "rigid",
        {"mass": _MASS},
        [
            term("coulomb", force=_COULOMB),
            term("stribeck", "exponential", force=_SURPLUS, velocity=_STRIBECK),
            term("presliding", "lugre", stiffness=_STIFFNESS, damping=_DAMPING),
            term("viscous", coefficient=_VISCOUS),
        ],
    )
    states, friction = Simulator(model).run(np.repeat(effort, round(_HOLD / _STEP)), _STEP)
    error = friction - expected
    figures = [
        Figure(f"largest force error, {name}, of that regime's force range", _share(error[at], expected[at]), "1", "<= 1e-4")
        for name, at in regimes.items()
    ]
    figures.append(Figure("largest position error, of the range", _share(states[:, 0] - position, position), "1", "<= 1e-4"))
    t = _STEP * np.arange(1, friction.shape[0] + 1)
    plot = stacked(
        [
            ("velocity [m/s]", [Curve("velocity", t, states[:, 1], "reference")]),
            (
                "friction [N]",
                [Curve("Radau", t, expected, "true", width=2.4), Curve("fric, 1 kHz", t, friction, "after", "dot")],
            ),
            ("error [N]", [Curve("force error", t, error, "before")]),
        ],
        "time [s]",
        180,
    )
    return Evidence(
        figures,
        [(plot, "LuGre through pre-sliding (to 0.3 s), break-away, sliding and reversals, beside the implicit integration.")],
        ["The simulation takes as many sub-steps as the natural frequency of the body on its bristles asks for: here eight."],
    )


def _share(error: Array, reference: Array) -> float:
    return float(np.max(np.abs(error)) / np.ptp(reference))


VERIFICATION = Verification(
    id="lugre-reference",
    title="LuGre against an implicit integration",
    source="Canudas de Wit et al. 1995, Eqs. 1-5; scipy's Radau, relative tolerance 1e-10",
    run=_run,
)
