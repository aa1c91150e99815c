"""A small axis, simulated within a moment: 4 s at 500 Hz, seeded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from fric.diagnosis.track import Track
from fric.model import Model, Term, build_model, term
from fric.record import Record
from fric.simulation import simulate

STEP = 2e-3  # [s]
MASS = 2.0
NOMINAL = build_model("rigid", {"mass": MASS}, [term("coulomb", force=4.0), term("viscous", coefficient=20.0)])


def recorded(*lacks: Term, seed: int = 0, duration: float = 4.0, noise: float = 1e-7) -> Record:
    """The nominal axis and what it ``lacks``, to and fro under two sines of force; noise of the position [m]."""
    t = STEP * np.arange(round(duration / STEP))
    effort = 18.0 * np.sin(5.0 * t) + 9.0 * np.sin(17.0 * t)
    moved = simulate(with_terms(*lacks), effort, STEP, n_substeps=4)
    disturbed = moved.position[: t.size] + noise * np.random.default_rng(seed).standard_normal(t.size)
    return replace(Record(t, disturbed, effort, effort_hold="following"), source=f"run {seed}")


def with_terms(*more: Term) -> Model:
    """The nominal model with further terms."""
    return NOMINAL.with_terms((*NOMINAL.terms, *more))


def followed(*lacks: Term, bandwidth: float = 45.0) -> Track:
    """The same recording, as an observer follows it."""
    return Track.of([recorded(*lacks)], bandwidth, NOMINAL)
