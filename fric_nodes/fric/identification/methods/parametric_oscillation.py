"""Parametric harmonic oscillation: mass, damping and stiffness from oscillations under known feedback gains.

A feedback u = -P q - D v makes an overdamped axis swing, and what it changes is known in newtons: with P_i, D_i in run i,

    m w_i^2 = k + P_i,    2 m sigma_i = c + D_i .

Two runs that differ in P give de Marchi's m = (P_i - P_j)/(w_i^2 - w_j^2), k = (P_i w_j^2 - P_j w_i^2)/(w_i^2 - w_j^2) (the
slide has a factor 2 in the denominator of m, which its own k contradicts); two that differ in D give m = (D_i - D_j)/(2
(sigma_i - sigma_j)). Here m, k, c are fitted to all runs at once, weighted by the covariances of w_i and sigma_i from the
method for free oscillations (the extended logarithmic decrement); the friction levels follow from each run, F_C = m w_i^2 x_k,
and are averaged. The covariance is that of everything by the delta rule. Where the runs differ by more than their standard
errors (friction is seldom the same twice) these are widened, the frequencies' and the dampings' each by what they themselves
leave, so that a damping that varies doesn't spoil a mass that the frequencies show. Without a spring of its own (k = 0) one
run with a feedback is enough.

Source: de Marchi 1998 (parametric harmonic oscillation).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from ...method_settings import FILTER
from ...model import Model
from ...record import Array, Record
from ..mechanics import Mechanics
from ..oscillation.conclusion import PHYSICAL, asked_of, closing, constant_force, oscillations
from ..oscillation.recording import Oscillation
from ..oscillation.result import FreeOscillation
from ..oscillation_effort import at_stamps
from ..result import Identification, IdentificationError, Method, Options
from .log_decrement import log_decrement

__all__ = ["METHOD", "Mechanics", "fit", "parametric_mechanics"]

_DIFFERENT = 3.0  # standard errors by which runs must differ to show a mass


def _weighted(
    predicted: Callable[[Array], Array], data: Array, covariances: Array, start: Array
) -> tuple[Array, Array, tuple[float, float]]:
    """Parameters whose ``predicted`` is nearest to ``data``, their covariance, and the misfit of both columns.

    Args:
        predicted: of parameters, shape ``(n, 2)``.
        data: shape ``(n, 2)``.
        covariances: shape ``(n, 2, 2)``.
        start: parameters to start from, shape ``(n_parameters,)``.
    """
    n = data.shape[0]
    scale = np.where(start != 0.0, np.abs(start), np.max(np.abs(start)))
    spread = np.sqrt(np.stack([np.diag(c) for c in covariances]))
    widened = np.ones(2)
    point = start / scale
    for _ in range(4):
        whiten = np.linalg.inv(np.linalg.cholesky(covariances * np.outer(widened, widened)))
        answer = least_squares(
            lambda trial, whiten=whiten: np.einsum("nij,nj->ni", whiten, predicted(trial * scale) - data).ravel(),
            point,
            method="lm",
            xtol=1e-12,
            ftol=1e-12,
        )
        point = answer.x
        off = (predicted(point * scale) - data) / spread
        # A column can't be judged by fewer runs than there are parameters for it: mass and spring, or the damping.
        misfit = np.sqrt(np.sum(off**2, axis=0) / np.maximum(np.array([n - 2.0, n - 1.0]), 0.5))
        free = np.array([n > 2, n > 1])
        widened = np.where(free, np.maximum(misfit, 1.0), 1.0)
    jacobian = answer.jac / scale
    return point * scale, np.linalg.inv(jacobian.T @ jacobian), (float(misfit[0]), float(misfit[1]))


def _straight_lines(squares: Array, decays: Array, known: Array, spring: bool, same: bool) -> tuple[float, float]:
    """Mass and stiffness by the printed formulas, as straight lines through all runs, unweighted: a start."""
    if same and spring:
        mass = float(np.polyfit(2.0 * decays, known[:, 1], 1)[0])
        return mass, mass * float(np.mean(squares)) - float(known[0, 0])
    columns = np.stack([squares, -np.ones(squares.shape[0])], axis=1) if spring else squares[:, None]
    answer, *_ = np.linalg.lstsq(columns, known[:, 0], rcond=None)
    return float(answer[0]), float(answer[1]) if spring else 0.0


def parametric_mechanics(
    runs: Sequence[tuple[float, float]],
    gains: Sequence[tuple[float, float]],
    covariances: Sequence[Array],
    spring: bool = True,
    source: str = "recordings",
) -> Mechanics:
    """Mass, viscous coefficient and stiffness from natural frequency and damping under several feedback gains.

    Args:
        runs: undamped natural frequency [rad/s] and damping ratio (mean of both directions) of each run.
        gains: P [F/x] and D [F s/x] of each.
        covariances: of frequency and ratio of each run, shape ``(2, 2)``.
        spring: False when the axis has no stiffness of its own.
        source: for messages.

    Raises:
        IdentificationError: the gains don't differ, or what they change can't be seen.
    """
    seen, known = np.array(runs, dtype=np.float64), np.array(gains, dtype=np.float64)
    spread = np.stack([np.sqrt(np.diag(c)) for c in covariances])
    same = np.ptp(known[:, 0]) < 1e-9 * np.max(np.abs(known[:, 0]), initial=0.0) or np.ptp(known[:, 0]) == 0.0
    if (spring and same and np.ptp(known[:, 1]) == 0.0) or (not spring and not np.any(known[:, 0])):
        raise IdentificationError(
            source,
            "every run has the same feedback gains, which does not determine the mass",
            "record runs whose proportional gains differ by a third or more, and give the gains (--gain P,D per recording)",
        )
    squares, decays = seen[:, 0] ** 2, seen[:, 0] * seen[:, 1]
    if not spring or not same:
        shown = np.ptp(squares) if spring else np.max(squares)
        if shown < _DIFFERENT * float(np.max(2.0 * seen[:, 0] * spread[:, 0])):
            raise IdentificationError(
                source, "the natural frequency doesn't change with the gain", "check the gains, and let them differ more"
            )
    mass, stiffness = _straight_lines(squares, decays, known, spring, bool(same))
    if mass <= 0.0:
        raise IdentificationError(
            source,
            f"frequencies and gains give the negative mass {mass:.3g}",
            "check the order and the sign of the gains (u = -P q - D v), and the sign of the force",
        )
    viscous = float(np.mean(2.0 * mass * decays - known[:, 1]))

    def predicted(point: Array) -> Array:
        m, c = point[0], point[1]
        k = point[2] if spring else 0.0
        frequency = np.sqrt(np.maximum(k + known[:, 0], 1e-300) / abs(m))
        ratio = 0.5 * (c + known[:, 1]) / (abs(m) * frequency)
        return np.stack([frequency, ratio], axis=1)

    start = np.array([mass, viscous, stiffness])[: 3 if spring else 2]
    found, inner, misfit = _weighted(predicted, seen, np.array(covariances), start)
    whole = np.zeros((4, 4))
    n = start.shape[0]
    whole[:n, :n] = inner
    return Mechanics(float(found[0]), float(found[1]), float(found[2]) if spring else 0.0, float("nan"), whole, misfit)


@dataclass(frozen=True, eq=False)
class _Runs:
    """Several oscillations with their natural parameters, and how they are weighted."""

    found: Sequence[Oscillation]
    results: Sequence[FreeOscillation]
    spring: bool
    position: float

    @property
    def values(self) -> Array:
        """Natural parameters, shape ``(n, 5)``."""
        return np.array([result.natural.values for result in self.results])

    @property
    def covariances(self) -> Array:
        """Of frequency and damping ratio, shape ``(n, 2, 2)``; a ratio that is held is taken as certain."""
        tiny = np.diag([1e-12, 1e-9]) ** 2
        return np.array([result.covariance[:2, :2] + tiny for result in self.results])

    def mechanics(self, values: Array) -> Mechanics:
        """Mass, damping and stiffness if the natural parameters were ``values``, shape ``(n, 5)``."""
        gains = [(each.feedback.proportional, each.feedback.derivative) for each in self.found]
        runs = [(float(row[0]), float(row[1])) for row in values]
        return parametric_mechanics(runs, gains, list(self.covariances), self.spring, self.found[0].source)

    def levels(self, values: Array, mass: float, stiffness: float) -> Array:
        """Difference of the viscous coefficient, Coulomb and constant force of each run, shape ``(n, 3)``."""
        springs = mass * values[:, 0] ** 2
        constant = np.array([each.feedback.constant for each in self.found]) + stiffness * self.position
        return np.stack(
            [2.0 * mass * values[:, 0] * values[:, 2], springs * values[:, 3], springs * values[:, 4] + constant], axis=1
        )

    def precision(self) -> Array:
        """Weights of the levels, shape ``(n, 3)``, from what a run's own parameters leave uncertain at unit mass."""
        base = self.values[:, :1]
        variance = np.array([np.diag(result.covariance)[2:] for result in self.results])
        variance = variance * np.concatenate([2.0 * base, base**2, base**2], axis=1) ** 2
        return np.asarray(1.0 / np.where(variance > 0, variance, 1.0))

    def estimate(self, values: Array) -> Array:
        """Mass and :data:`PHYSICAL`, shape ``(6,)``, if the natural parameters were ``values``, shape ``(n, 5)``."""
        first = self.mechanics(values)
        level = self.levels(values, first.mass, first.stiffness)
        weight = self.precision()
        mean = np.sum(weight * level, axis=0) / np.sum(weight, axis=0)
        return np.array([first.mass, first.stiffness, first.viscous, *mean])

    def widening(self) -> Array:
        """By how many standard errors each natural parameter differs from run to run, at least 1, shape ``(5,)``."""
        first = self.mechanics(self.values)
        level = self.levels(self.values, first.mass, first.stiffness)
        weight = self.precision() / first.mass**2
        mean = np.sum(weight * level, axis=0) / np.sum(weight, axis=0)
        n = len(self.results)
        apart = np.sqrt(np.sum(weight * (level - mean) ** 2, axis=0) / max(n - 1, 1))
        return np.asarray(np.maximum(np.array([*(first.misfit if n > 2 else (1.0, 1.0)), *apart]), 1.0))

    def covariance(self) -> Array:
        """Of :meth:`estimate`, shape ``(6, 6)``."""
        values, wide = self.values, self.widening()
        total = np.zeros((6, 6))
        for number, result in enumerate(self.results):
            joint = result.covariance * np.outer(wide, wide)
            spread = np.sqrt(np.maximum(np.diag(result.covariance), 0.0))
            slope = np.zeros((6, 5))
            for k in np.flatnonzero(spread > 0):
                step = np.zeros_like(values)
                step[number, k] = 0.1 * spread[k]
                slope[:, k] = (self.estimate(values + step) - self.estimate(values - step)) / (2.0 * step[number, k])
            total += slope @ joint @ slope.T
        return total


def fit(structure: Model, records: Sequence[Record], options: Options) -> Identification:
    """Fit mass and friction of ``structure`` to free oscillations under different feedback gains.

    The gains are ``options.gains``, or are found from the recorded force.

    Raises:
        IdentificationError: a recording holds no free oscillation, or the gains don't differ.
    """
    spring = any(held.effect.id == "stiffness" for held in structure.terms)
    asked = asked_of(structure, records[0].source, spring)
    records = [at_stamps(record) for record in records]
    found = oscillations(structure, records, options, judge=False)
    results = [log_decrement(each, asked) for each in found]
    runs = _Runs(found, results, spring, structure.value("stiffness.position") if spring else 0.0)
    estimate, covariance, wide = runs.estimate(runs.values), runs.covariance(), runs.widening()
    warnings = [f"{record.source}: {w}" for record, result in zip(records, results, strict=True) for w in result.warnings]
    if wide[0] > 3.0:
        warnings.append(
            f"the frequencies differ from one mass and spring by {wide[0]:.2g} times their standard errors, which are widened"
            " by that much: check the gains"
        )
    vary = [
        name for name, factor in zip(("damping", "its difference", "Coulomb force"), wide[1:4], strict=True) if factor > 3.0
    ]
    if vary:
        warnings.append(
            f"{', '.join(vary)} differ from run to run by {max(wide[1:4]):.2g} times their standard errors: the values are"
            " means, their standard errors widened by that much"
        )
    names = (structure.plant.parameters[0].name, *PHYSICAL[:4], constant_force(structure, options.held) or "")
    notes = [
        f"{each.source}: P = {each.feedback.proportional:.6g}, D = {each.feedback.derivative:.3g}"
        f"{'' if each.feedback.known else ' (from the recorded force)'}, w_0 = {result.natural.frequency:.6g} rad/s"
        for each, result in zip(found, results, strict=True)
    ]
    notes += [f"{each.source}: {note}" for each in found for note in each.notes]
    return closing(METHOD.id, structure, (names, estimate, covariance), (records, found), options, ("", warnings, notes))


METHOD = Method(
    id="parametric-oscillation",
    title="parametric harmonic oscillation",
    needs="free oscillations under P + D feedback, with gains that differ from one recording to the next",
    source="de Marchi 1998",
    fit=fit,
    needs_force=False,
    uses=(*FILTER, "held", "gains"),
)
