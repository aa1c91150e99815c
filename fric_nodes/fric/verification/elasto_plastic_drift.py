"""Drift under a load that oscillates below break-away: none for the elasto-plastic model, some for LuGre.

A body is held by friction against a constant load, on which a smaller oscillation acts; together they stay below the break-away
share of the slip level. A real contact moves to and fro without going anywhere. LuGre lets its bristles slip however small the
load is, and creeps on with every cycle. Drift is measured as the position at equal phase, at the end of each cycle: after the
last of 1000 cycles minus after the first, in which the start dies out.
"""

from __future__ import annotations

import numpy as np

from ..figure import Figure
from ..model import Term, build_model, term
from ..record import Array
from ..report.figures import Curve, scatter_and_curves
from ..simulation import Simulator
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_CYCLES = 1000
_SAMPLES = 100  # per cycle
_STEP = 1e-3  # [s]
_LOAD, _AMPLITUDE = 2.0, 1.5  # [N]; break-away begins at 0.7 times 6 N
_STIFFNESS, _DAMPING = 1e5, 600.0


def _cycles(law: Term) -> tuple[Array, Array, Array]:
    """Position at the end of each cycle, and position and force over the last one, (n_cycles,) and twice (n_samples,)."""
    terms = [
        term("coulomb", force=4.0),
        term("stribeck", "exponential", force=2.0, velocity=0.01),
        law,
        term("viscous", coefficient=10.0),
    ]
    simulator = Simulator(build_model("rigid", {"mass": 1.0}, terms))
    effort = _LOAD + _AMPLITUDE * np.sin(2 * np.pi * (np.arange(_SAMPLES) + 0.5) / _SAMPLES)
    states, friction = simulator.run(np.tile(effort, _CYCLES), _STEP)
    position = states[:, 0]
    return position[_SAMPLES - 1 :: _SAMPLES], position[-_SAMPLES:], friction[-_SAMPLES:]


def _run() -> Evidence:
    bound = _cycles(term("presliding", "elasto_plastic", stiffness=_STIFFNESS, damping=_DAMPING, breakaway=0.7))
    creeping = _cycles(term("presliding", "lugre", stiffness=_STIFFNESS, damping=_DAMPING))
    swing = float(np.ptp(bound[1]))
    drift = float(abs(bound[0][-1] - bound[0][0]))
    lugre = float(creeping[0][-1] - creeping[0][0])
    figures = [
        Figure("elasto-plastic: drift over 1000 cycles", drift, "m", "<= 1e-15"),
        Figure("elasto-plastic: drift over the last 900 of them", float(abs(bound[0][-1] - bound[0][99])), "m", "<= 1e-15"),
        Figure("elasto-plastic: drift, of the oscillation's amplitude", drift / (0.5 * swing), "1", "<= 1e-9"),
        Figure("elasto-plastic: amplitude", 0.5 * swing, "m"),
        Figure("LuGre: drift over 1000 cycles", lugre, "m", ">= 1e-6"),
        Figure("LuGre: drift, of the oscillation's amplitude", lugre / (0.5 * swing), "1"),
    ]
    n = np.arange(1.0, _CYCLES + 1)
    over = scatter_and_curves(
        None,
        [
            Curve("LuGre", n, 1e3 * (creeping[0] - creeping[0][0]), "before"),
            Curve("elasto-plastic", n, 1e3 * (bound[0] - bound[0][0]), "after"),
        ],
        "cycle",
        "position since the first cycle [mm]",
        320,
    )
    last = scatter_and_curves(
        None,
        [
            Curve("LuGre, last cycle", 1e6 * (creeping[1] - creeping[1][0]), creeping[2], "before"),
            Curve("elasto-plastic, last cycle", 1e6 * (bound[1] - bound[1][0]), bound[2], "after"),
        ],
        "displacement since the cycle's start [µm]",
        "friction [N]",
    )
    plots = [
        (over, f"Position at the end of each cycle: LuGre goes on by {1e3 * lugre:.3g} mm, the elasto-plastic model stays."),
        (last, "Friction over displacement in the last cycle: the elasto-plastic law is a spring with damping, LuGre slips."),
    ]
    notes = [
        "Load 2 N, oscillation 1.5 N at 10 Hz, slip level 6 N at rest, elastic up to 0.7 of it, mass 1 kg, 1 kHz.",
        "Bristle damping 600 N s/m is close to critical, so that the start of the oscillation dies out in the first cycle.",
    ]
    return Evidence(figures, plots, notes)


VERIFICATION = Verification(
    id="elasto-plastic-drift",
    title="No drift under a load below break-away",
    source="Dupont, Hayward, Armstrong, Altpeter 2002, Sec. III (presliding drift of LuGre)",
    run=_run,
)
