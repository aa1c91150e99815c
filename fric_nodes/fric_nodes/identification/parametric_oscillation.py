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

Forced runs, F = B sin(w t), response of amplitude C that lags by phi, R = B/C, the feedback not in F:

    R cos phi = k + P - m w^2,    R sin phi = (c + D) w + 4 F_C/(pi C)

(linear in m, k, c, F_C: least squares over all runs). Corrected in the slide: the damping formula needs D_i w_i in place of
D_i; it holds for different w_i only, where m is concerned; and the describing function of dry friction, the last term, is
missing there, so that its c holds what friction takes at that amplitude.

Source: de Marchi 1998 (parametric harmonic oscillation).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from ..model import Model
from ..record import Array, Record
from .log_decrement import log_decrement
from .oscillation.conclusion import PHYSICAL, asked_of, closing, constant_force, oscillations
from .oscillation.recording import Oscillation
from .oscillation.result import FreeOscillation
from .result import Identification, IdentificationError, Method, Options

__all__ = ["METHOD", "Forced", "Mechanics", "fit", "forced_mechanics", "forced_response", "parametric_mechanics"]

_DIFFERENT = 3.0  # standard errors by which runs must differ to show a mass


@dataclass(frozen=True)
class Mechanics:
    """Mass, viscous coefficient, stiffness and Coulomb force with their covariance, in this order.

    Attributes:
        mass: [F s^2/x].
        viscous: c [F s/x].
        stiffness: k [F/x].
        coulomb: F_C [F]; NaN where it isn't asked for.
        covariance: shape ``(4, 4)``; zero for what was held.
        misfit: by how many standard errors the runs differ: their frequencies and dampings, or both parts of their dynamic
            stiffness; taken into account in the covariance where above 1.
    """

    mass: float
    viscous: float
    stiffness: float
    coulomb: float
    covariance: Array
    misfit: tuple[float, float]


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
            "every run has the same feedback gains: they show no mass",
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
class Forced:
    """Response of an axis to a sinusoidal force.

    Attributes:
        frequency: w [rad/s].
        amplitude: C of the position [x].
        stiff: R cos phi [F/x].
        lossy: R sin phi [F/x].
        covariance: of ``stiff`` and ``lossy``, shape ``(2, 2)``.
    """

    frequency: float
    amplitude: float
    stiff: float
    lossy: float
    covariance: Array


def forced_response(record: Record, frequency: float) -> Forced:
    """Dynamic stiffness of a steady forced run at ``frequency`` [rad/s], from the first harmonics of force and position.

    Raises:
        IdentificationError: shorter than two periods.
    """
    if record.duration * frequency < 4.0 * np.pi:
        raise IdentificationError(record.source, "shorter than two periods of the force", "record for longer")
    angle = frequency * record.time
    columns = np.stack([np.cos(angle), np.sin(angle), np.ones_like(angle)], axis=1)
    # A force held from its stamp to the next is centred half a sample later.
    late = {"following": 0.5, "preceding": -0.5, "linear": 0.0}[record.effort_hold] * record.sample_time * frequency
    parts, noise = [], []
    for values in (record.effort, record.position):
        answer, *_ = np.linalg.lstsq(columns, values, rcond=None)
        left = values - columns @ answer
        n = 2 * int(record.duration * frequency / (2.0 * np.pi))
        # What is left repeats itself with the period (friction's harmonics): half periods count, not samples.
        blocks = left[: left.shape[0] // n * n].reshape(n, -1).mean(axis=1)
        noise.append(2.0 * (float(np.var(left)) / left.shape[0] + float(np.var(blocks)) / n))
        parts.append(complex(answer[0], -answer[1]))
    force, position = parts[0] * np.exp(-1j * late), parts[1]
    ratio = force / position
    variance = (noise[0] + abs(ratio) ** 2 * noise[1]) / abs(position) ** 2
    return Forced(frequency, abs(position), float(ratio.real), float(ratio.imag), variance * np.eye(2))


def forced_mechanics(
    runs: Sequence[Forced], gains: Sequence[tuple[float, float]] | None = None, coulomb: bool = True, source: str = "recordings"
) -> Mechanics:
    """Mass, viscous coefficient, stiffness and Coulomb force from forced runs.

    Args:
        runs: at different frequencies; for ``coulomb`` at different amplitudes or frequencies.
        gains: P [F/x] and D [F s/x] of a feedback that isn't part of the force, for each run; None: there is none.
        coulomb: whether to fit dry friction too.
        source: for messages.

    Raises:
        IdentificationError: the runs don't differ enough.
    """
    known = np.zeros((len(runs), 2)) if gains is None else np.array(gains, dtype=np.float64)
    w = np.array([run.frequency for run in runs])
    dry = np.array([4.0 / (np.pi * run.amplitude) for run in runs])
    zero, one = np.zeros_like(w), np.ones_like(w)
    upper = np.stack([-(w**2), zero, one, zero], axis=1)
    lower = np.stack([zero, w, zero, dry], axis=1)
    columns = np.concatenate([upper, lower])[:, : 4 if coulomb else 3]
    data = np.concatenate([[r.stiff for r in runs] - known[:, 0], [r.lossy for r in runs] - known[:, 1] * w])
    weight = 1.0 / np.sqrt(np.concatenate([[r.covariance[0, 0] for r in runs], [r.covariance[1, 1] for r in runs]]))
    scaled = columns * weight[:, None]
    size = np.linalg.norm(scaled, axis=0)
    if np.linalg.matrix_rank(scaled / size, tol=1e-6) < columns.shape[1]:
        raise IdentificationError(
            source, "the forced runs are too much alike", "force it at different frequencies and with different amplitudes"
        )
    answer, *_ = np.linalg.lstsq(scaled, data * weight, rcond=None)
    left = data * weight - scaled @ answer
    freedom = data.shape[0] - columns.shape[1]
    apart = float(left @ left) / freedom if freedom else 1.0
    n = columns.shape[1]
    whole = np.zeros((4, 4))
    whole[:n, :n] = np.linalg.inv(scaled.T @ scaled) * max(apart, 1.0)
    level = float(answer[3]) if coulomb else float("nan")
    return Mechanics(float(answer[0]), float(answer[1]), float(answer[2]), level, whole, (float(np.sqrt(apart)),) * 2)


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
)
