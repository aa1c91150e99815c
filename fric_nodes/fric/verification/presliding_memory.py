"""Return-point memory: after an inner loop closes, friction is back on the outer curve as if the loop had never been.

A displacement is led over an outer loop, on whose rising branch it turns back twice. Once an inner loop has closed, laws with a
memory of their reversal points (GMS, Maxwell slip) go on along the outer curve; laws with a single state (LuGre, Dahl,
elasto-plastic) have forgotten where they turned and go on beside it.
"""

from __future__ import annotations

import numpy as np

from ..figure import Figure
from ..model import Term, build_model, term
from ..record import Array
from ..report.figures import Curve, scatter_and_curves
from ..simulation import Predictor
from .nested_loops import NestedLoops
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_LEVEL = 5.0  # [N]
_STIFFNESS = 1e5  # [N/m]
_TIP = 800  # amplitude of the outer loop, in steps
_STEP = 1e-7  # [m]
_TIME = 1e-3  # [s] for each step
_LOOPS = NestedLoops(_TIP, ((-150, -500), (350, 0)))


def _laws() -> dict[str, Term]:
    # Ten springs, the stiffer the sooner they slide; their limits are proportions, see the law.
    springs = {f"stiffness_{i}": _STIFFNESS / 55 * (11 - i) for i in range(1, 11)}
    limits = {f"limit_{i}": 8e-6 * i for i in range(1, 11)}
    return {
        "GMS": term("presliding", "gms", stiffness=_STIFFNESS, attraction=1e3),
        "Maxwell slip": term("presliding", "maxwell_slip", **springs, **limits),
        "LuGre": term("presliding", "lugre", stiffness=_STIFFNESS),
        "Dahl": term("presliding", "dahl", stiffness=_STIFFNESS),
        "elasto-plastic": term("presliding", "elasto_plastic", stiffness=_STIFFNESS, breakaway=0.5),
    }


def _force(law: Term, path: Array) -> tuple[Array, Array]:
    """Middle of each step along ``path`` [steps] and mean friction over it [N]."""
    model = build_model("rigid", {"mass": 1.0}, [term("coulomb", force=_LEVEL), law])
    middle = 0.5 * (path[1:] + path[:-1])
    n = middle.shape[0]
    velocity = np.diff(path) * _STEP / _TIME
    _, friction = Predictor(model).run(_TIME * np.arange(n, dtype=np.float64), _STEP * middle, velocity, np.zeros(n), _TIME)
    return middle, friction


def _deviations(law: Term) -> tuple[list[float], float, tuple[Array, Array], tuple[Array, Array]]:
    """Largest deviation after each inner loop, as a share of the force's range, that range, and both curves."""
    plain = _force(law, _LOOPS.path(inner=False))
    looped = _force(law, _LOOPS.path())
    span = float(np.ptp(plain[1]))
    return [each / span for each in _LOOPS.deviations(plain[1], looped[1])], span, plain, looped


def _run() -> Evidence:
    figures = []
    plots = []
    for name, law in _laws().items():
        found, span, plain, looped = _deviations(law)
        remembers = name in ("GMS", "Maxwell slip")
        for number, share in enumerate(found, start=1):
            goal = "<= 0.01" if remembers else ""
            if name == "LuGre":
                goal = ">= 0.01"
            figures.append(Figure(f"{name}: off the outer curve after inner loop {number}, of the range", share, "1", goal))
        if name in ("GMS", "Maxwell slip", "LuGre"):
            to_um = 1e6 * _STEP
            curves = [
                Curve("with two inner loops", looped[0] * to_um, looped[1], "before" if name == "LuGre" else "after"),
                Curve("outer loop alone", plain[0] * to_um, plain[1], "true", "dot"),
            ]
            caption = (
                f"{name}: largest deviation from the outer curve after the inner loops {100 * max(found):.2g} % of the range"
                f" of {span:.3g} N."
            )
            plots.append((scatter_and_curves(None, curves, "displacement [µm]", "friction [N]"), caption))
    notes = [
        "Displacement-driven, level 5 N, stiffness 1e5 N/m, steps of 0.1 µm. GMS and Maxwell slip have ten elements.",
        "LuGre's goal is the other way round: its deviation must be visible, since it has no memory of reversal points.",
    ]
    return Evidence(figures, plots, notes)


VERIFICATION = Verification(
    id="presliding-memory",
    title="Return-point memory of the pre-sliding laws",
    source="Lampaert et al. 2005; Amthor et al. 2008, Sec. 2 (hysteresis with non-local memory); Al-Bender et al. 2004",
    run=_run,
)
