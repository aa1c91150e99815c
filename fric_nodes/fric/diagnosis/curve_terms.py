"""Terms of a friction curve over speed: which a curve has beyond the nominal model's, and which the mean forces speak for.

A curve is one of the candidates of :mod:`fric.identification.static_maps.curve`: Coulomb friction and a bias, and any of the
effects in :data:`FLAGS`. It is fitted to the mean forces [F] of runs at constant speeds [x/s], each weighted by its own error
and by the scatter from run to run.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from ..identification.static_maps.curve import Candidate, Choice, Curve, Points, fitted
from ..identification.static_maps.load import MeanForce
from ..model import Model
from ..record import Array

__all__ = [
    "FLAGS",
    "base_of",
    "force_of_term",
    "gain_of",
    "kept",
    "points_of",
    "refitted",
    "static_force",
    "terms_beyond",
    "weight_of",
    "with_effect",
]

FLAGS = {"viscous": "viscous", "stribeck": "stribeck", "quadratic_drag": "quadratic", "asymmetry": "asymmetry"}
"""Attribute of a candidate by the effect that it stands for."""


def points_of(means: Sequence[MeanForce]) -> Points:
    """Speeds [x/s], mean forces [F] and their standard errors [F] of ``means``, as points that a curve is fitted to."""
    columns = zip(*((mean.velocity, mean.friction, mean.force[1]) for mean in means), strict=True)
    return Points(*(np.array(column) for column in columns))


def base_of(nominal: Model) -> Candidate:
    """The nominal model's terms as a candidate."""
    laws = {held.effect.id: held.effect.law for held in nominal.terms}
    return Candidate("viscous" in laws, laws.get("stribeck", ""), "quadratic_drag" in laws, "asymmetry" in laws)


def terms_beyond(candidate: Candidate, base: Candidate) -> list[str]:
    """Effects of ``candidate`` that ``base`` lacks."""
    return [effect for effect, flag in FLAGS.items() if getattr(candidate, flag) and not getattr(base, flag)]


def without_effect(candidate: Candidate, effect: str) -> Candidate:
    return with_effect(candidate, effect, Candidate())


def with_effect(candidate: Candidate, effect: str, other: Candidate) -> Candidate:
    """``candidate`` with or without one effect, as ``other`` has it or not."""
    return Candidate(
        other.viscous if effect == "viscous" else candidate.viscous,
        other.stribeck if effect == "stribeck" else candidate.stribeck,
        other.quadratic if effect == "quadratic_drag" else candidate.quadratic,
        other.asymmetry if effect == "asymmetry" else candidate.asymmetry,
    )


def refitted(candidate: Candidate, points: Points, scatter: float) -> Curve:
    """The curve of ``candidate`` fitted to ``points``; a coefficient that would come out negative is zero.

    Args:
        candidate: the terms of the curve.
        points: mean forces over speed.
        scatter: of the means from run to run, beside their own errors [F].
    """
    curve = fitted(candidate, points, scatter)
    if curve is not None:
        return curve
    poorer = [
        fitted(replace(candidate, viscous=viscous, quadratic=quadratic, stribeck=stribeck), points, scatter)
        for viscous, quadratic, stribeck in product(
            {candidate.viscous, False}, {candidate.quadratic, False}, {candidate.stribeck, ""}
        )
    ]
    possible = [each for each in (*poorer, fitted(Candidate(), points, scatter)) if each is not None]
    return min(possible, key=lambda each: (each.cost, len(each.candidate.names)))


def _cost(curve: Curve, points: Points) -> float:
    """Weighted sum of squares [1] of ``points`` about a curve, which may have been fitted to others."""
    left = points.force - curve.force(points.velocity)
    return float(np.sum(left**2 / (points.error**2 + curve.scatter**2)))


def kept(choice: Choice, base: Candidate, points: Points, apart: Points) -> tuple[Curve, list[tuple[str, str]]]:
    """The chosen curve without the terms that make it worse on the means held back, and these terms, each with the reason.

    Args:
        choice: of the curve, by the means to learn from.
        base: the nominal model's terms, which stay.
        points: the means to learn from.
        apart: the means held back.
    """
    best = choice.best
    gone: list[tuple[str, str]] = []
    while True:
        poorer = {
            name: refitted(without_effect(best.candidate, name), points, best.scatter)
            for name in terms_beyond(best.candidate, base)
        }
        worst = min(poorer, key=lambda name: _cost(poorer[name], apart), default=None)
        if worst is None or _cost(poorer[worst], apart) > _cost(best, apart):
            return best, gone
        gone.append((worst, "makes the recordings held back worse"))
        best = poorer[worst]


def weight_of(choice: Choice, effect: str) -> float:
    """Weight of the candidates with ``effect`` (Burnham and Anderson 2002), beside the test for a Stribeck effect."""
    weights = np.array([math.exp(-0.5 * (curve.criterion - choice.all[0].criterion)) for curve in choice.all])
    have = np.array([bool(getattr(curve.candidate, FLAGS[effect])) for curve in choice.all])
    sure = float(np.sum(weights[have]) / np.sum(weights))
    return min(sure, 1.0 - choice.p_value) if effect == "stribeck" and math.isfinite(choice.p_value) else sure


def gain_of(effect: str, best: Curve, points: Points) -> float:
    """By how much the weighted sum of squares [1] rises when ``effect`` is taken from ``best`` and all else is refitted."""
    return refitted(without_effect(best.candidate, effect), points, best.scatter).cost - best.cost


def force_of_term(effect: str, curve: Curve, velocity: Array) -> Array:
    """The force of one term of ``curve`` [F], shape ``(n,)``."""
    alone = np.array(
        [
            value if name.split(".")[0] == effect or name == "stribeck.velocity" else 0.0
            for name, value in zip(curve.candidate.names, curve.values.tolist(), strict=True)
        ]
    )
    return replace(curve, values=alone).force(velocity)


def static_force(model: Model, velocity: Array) -> Array:
    """Force at constant ``velocity`` by a model's terms [F], shape ``(n,)``."""
    values = {p.name: p.value for p in model.parameters()}
    candidate = base_of(model)
    own = np.array([values[name] for name in candidate.names])
    return Curve(candidate, own, np.zeros((1, 1)), 0.0, 0.0, 0.0, 1).force(velocity)
