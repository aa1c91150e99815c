"""Forced harmonic oscillation: mass, damping, stiffness and friction from steady runs under a sinusoidal force.

With F_1, Q_1 the first harmonics (complex, of e^{j w t}) of force and position in the steady state, and R = F_1/Q_1, which is
(B/C) e^{j phi} where F = B sin(w t) makes the position C sin(w t - phi),

    R = k - m w^2 + j w (c + D) + P + F_C S_1/Q_1 + D_v V_1/Q_1,

S_1 and V_1 being the first harmonics of sgn(v) and |v| along the motion as it was measured: of a sine S_1/Q_1 = 4 j/(pi C), the
describing function of dry friction; taken from the motion itself, it stays exact when friction bends the sine. P and D are
those of a feedback that is not part of the force, if there is one. The means give the constant part, with Q_0, S_0, V_0,

    F_0 = k (Q_0 - q_0) + b + F_C S_0 + D_v V_0 .

All this is linear in the parameters: least squares over all runs, each weighted by how well its own periods agree. Corrected
in the printed slide: its damping formula needs D_i w_i in place of D_i; where its mass is concerned it holds for different w_i
only; and dry friction is missing there, so that its c holds what friction takes at that amplitude.

A body that rests for part of every period has an open friction there: such runs are refused. Runs must differ in frequency
(for mass and stiffness), and in frequency or amplitude (for viscous and dry friction).

Source: de Marchi 1998 (forced harmonic oscillation, pseudo-forced parametric oscillation); the terms of friction derived here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...method_settings import FILTER
from ...model import Model
from ...record import Array, Mask, Record
from ..conclusion import Fitted, concluded
from ..equations import equations
from ..free_parameters import FreeParameters
from ..mechanics import Mechanics
from ..oscillation.harmonics import Harmonics, Held, harmonics_of
from ..oscillation_effort import at_stamps
from ..result import Identification, IdentificationError, Method, Options

__all__ = [
    "METHOD",
    "MOST_RESTING",
    "Forced",
    "fit",
    "forced_mechanics",
    "forced_response",
]

_APART = 0.02  # relative difference of frequencies that tells a mass from a spring
MOST_RESTING = 0.05
"""Part of the time at rest from which on a forced run is refused: it leaves sgn(v) open."""
_PASSES = 3  # numerical: each takes the error that a rest leaves down to its own share of the period
_COLUMNS = ("mass", "viscous.coefficient", "stiffness.stiffness", "coulomb.force", "asymmetry.coefficient", "constant")


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
        IdentificationError: shorter than four periods, or not steady.
    """
    found = harmonics_of(record, frequency)
    ratio, covariance = _mean_of(found.force / found.position)
    return Forced(frequency, float(np.mean(np.abs(found.position))), float(ratio.real), float(ratio.imag), covariance)


def _mean_of(values: np.ndarray) -> tuple[complex, Array]:
    """Mean of complex ``values``, shape ``(n,)``, and the covariance of its parts from their scatter, shape ``(2, 2)``."""
    n = values.shape[0]
    mean = complex(np.mean(values))
    parts = np.stack([values.real, values.imag])
    floor = (1e-9 * abs(mean)) ** 2 * np.eye(2)
    return mean, np.cov(parts) / n + floor


def forced_mechanics(
    runs: Sequence[Forced], gains: Sequence[tuple[float, float]] | None = None, coulomb: bool = True, source: str = "recordings"
) -> Mechanics:
    """Mass, viscous coefficient, stiffness and Coulomb force from dynamic stiffnesses, dry friction by its describing function.

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
    answer, covariance, apart = _solved(columns, data, weight, source)
    n = columns.shape[1]
    whole = np.zeros((4, 4))
    whole[:n, :n] = covariance
    level = float(answer[3]) if coulomb else float("nan")
    return Mechanics(float(answer[0]), float(answer[1]), float(answer[2]), level, whole, (apart, apart))


def _solved(columns: Array, data: Array, weight: Array, source: str) -> tuple[Array, Array, float]:
    """Weighted least squares: parameters, covariance widened by the misfit where above 1, and the misfit.

    Raises:
        IdentificationError: the columns don't tell the parameters apart.
    """
    scaled = columns * weight[:, None]
    size = np.linalg.norm(scaled, axis=0)
    n = columns.shape[1]
    if data.shape[0] < n or np.any(size == 0.0) or np.linalg.matrix_rank(scaled / np.where(size, size, 1.0), tol=1e-6) < n:
        raise IdentificationError(
            source, "the forced runs are too much alike", "force it at different frequencies and with different amplitudes"
        )
    unit, *_ = np.linalg.lstsq(scaled / size, data * weight, rcond=None)
    left = data * weight - scaled / size @ unit
    freedom = data.shape[0] - n
    apart = float(np.sqrt(left @ left / freedom)) if freedom else 1.0
    inverse = np.linalg.inv((scaled / size).T @ (scaled / size)) / np.outer(size, size)
    return unit / size, inverse * max(apart, 1.0) ** 2, apart


def _rows(run: Harmonics, gain: tuple[float, float], relaxed: float, values: Array) -> tuple[Array, Array, Array]:
    """Columns ``(3, 6)``, data and weights ``(3,)`` of one run: both parts of its dynamic stiffness, and its means.

    ``values``, shape ``(6,)``, are those found before, or 0: with them friction's share is taken off each period, so that
    periods differ by what its harmonics are off by as well.
    """
    w, q = run.frequency, np.abs(run.position)
    each = run.force / run.position
    ratio = complex(np.mean(each))
    sign, speed = complex(np.mean(run.sign / run.position)), complex(np.mean(run.speed / run.position))
    force, position, sign_mean, speed_mean = np.mean(run.means, axis=0)
    size = float(np.mean(q))
    harmonic = np.array([-(w**2), 1j * w, 1.0, sign, speed, 0.0])
    constant = np.array([0.0, 0.0, position - relaxed, sign_mean, speed_mean, 1.0]) / size
    columns = np.stack([harmonic.real, harmonic.imag, constant])
    data = np.array([ratio.real - gain[0], ratio.imag - gain[1] * w, (force - gain[0] * position) / size])
    left = run.means[:, 0] - (gain[0] + values[2]) * run.means[:, 1] - run.means[:, 2:] @ values[3:5]
    _, covariance = _mean_of(each - values[3] * run.sign / run.position - values[4] * run.speed / run.position)
    drift = float(np.var(left, ddof=1)) / run.means.shape[0] / size**2
    variance = np.array([covariance[0, 0], covariance[1, 1], drift + float(np.trace(covariance)) * 0.25])
    return columns, data, 1.0 / np.sqrt(variance)


def _asked(structure: Model, options: Options, source: str) -> tuple[list[str], Mask]:
    """Names of the structure's parameters behind the columns, and which columns are fitted, shape ``(6,)``.

    Raises:
        IdentificationError: the structure holds what a forced run can't show.
    """
    if structure.plant.id != "rigid":
        raise IdentificationError(
            source,
            f"forced runs are fitted with the plant rigid, not {structure.plant.id}",
            "give its spring as a term (stiffness)",
        )
    allowed = {"stiffness", "viscous", "coulomb", "asymmetry", "bias"}
    strange = sorted({held.effect.id for held in structure.terms} - allowed)
    if strange:
        raise IdentificationError(
            source,
            f"a forced run can't be fitted with {', '.join(strange)}",
            f"use the terms {', '.join(sorted(allowed))}, or the method inverse-dynamics",
        )
    constant = "bias.force" if "bias.force" in structure.names else "asymmetry.force"
    names = [*_COLUMNS[:5], constant]
    present = np.array([name in structure.names and name not in options.held for name in names])
    # The mean position shifts with any constant force: without a term for it, it is fitted all the same and named.
    present[5] = True
    return names, present


def fit(structure: Model, records: Sequence[Record], options: Options) -> Identification:
    """Fit ``structure`` to steady forced runs, one recording each; ``options.gains`` are those of a feedback not in the force.

    Raises:
        IdentificationError: a recording holds no steady run, the body rests in it, or the runs don't differ.
    """
    source = records[0].source
    names, present = _asked(structure, options, source)
    if options.gains and len(options.gains) != len(records):
        raise IdentificationError(
            source, f"{len(options.gains)} feedback gain(s) for {len(records)} recording(s)", "give one for each recording"
        )
    runs = [harmonics_of(record) for record in records]
    w = np.array([run.frequency for run in runs])
    if present[0] and present[2] and np.ptp(w) < _APART * float(np.max(w)):
        raise IdentificationError(
            source, "the forced runs are too much alike: one frequency can't separate mass and stiffness", "force it at several"
        )
    for run in runs:
        if present[3] and run.resting > MOST_RESTING:
            raise IdentificationError(
                run.source,
                f"the joint rests for {100 * run.resting:.0f} % of the time",
                "force it harder, or at a higher frequency",
            )
    relaxed = structure.value("stiffness.position") if "stiffness.position" in structure.names else 0.0
    asked = _Asked(tuple(names), present, structure, relaxed)
    gains = list(options.gains) or [(0.0, 0.0)] * len(runs)
    answer, covariance, apart = _answered(runs, gains, asked, source)
    for _ in range(_PASSES if asked.whole(answer)[3] > 0.0 else 0):
        runs = [
            harmonics_of(record, run.frequency, asked.held(answer, gain[0]))
            for record, run, gain in zip(records, runs, gains, strict=True)
        ]
        answer, covariance, apart = _answered(runs, gains, asked, source, answer)
    return _result(structure, records, options, runs, (list(np.array(names)[present]), answer, covariance, apart))


@dataclass(frozen=True, eq=False)
class _Asked:
    """What is fitted.

    Attributes:
        names: of the parameters behind the columns; 6.
        present: which of them are fitted, shape ``(6,)``.
        structure: holds the values of the others.
        relaxed: position of the relaxed spring [x].
    """

    names: tuple[str, ...]
    present: Mask
    structure: Model
    relaxed: float

    def whole(self, answer: Array) -> Array:
        """Values of all columns, shape ``(6,)``, from those of the fitted ones; 0 where the structure holds no such term."""
        has = self.structure.names
        values = np.array([self.structure.value(name) if name in has else 0.0 for name in self.names])
        values[self.present] = answer
        return values

    def held(self, answer: Array, gain: float) -> Held:
        """What tells the friction of a resting body under a feedback of stiffness ``gain`` [F/x]."""
        values = self.whole(answer)
        return Held(float(values[2]) + gain, float(values[5] - values[2] * self.relaxed), float(values[3]))


def _answered(
    runs: Sequence[Harmonics], gains: Sequence[tuple[float, float]], asked: _Asked, source: str, before: Array | None = None
) -> tuple[Array, Array, float]:
    """Values of the fitted columns, their covariance and the misfit, as :func:`_solved`; ``before`` are those found before."""
    known = np.zeros(6) if before is None else asked.whole(before)
    parts = [_rows(run, gain, asked.relaxed, known) for run, gain in zip(runs, gains, strict=True)]
    columns, data, weight = (np.concatenate(each) for each in zip(*parts, strict=True))
    others = asked.whole(np.zeros(int(np.count_nonzero(asked.present))))
    return _solved(columns[:, asked.present], data - columns @ others, weight, source)


def _result(
    structure: Model,
    records: Sequence[Record],
    options: Options,
    runs: Sequence[Harmonics],
    found: tuple[list[str], Array, Array, float],
) -> Identification:
    names, answer, covariance, apart = found
    free = FreeParameters.of(structure, Options(held=options.held))
    free = free.without({name for name in free.names if name not in names})
    order = [names.index(name) for name in free.names]
    values, spread, messages = structure.values, covariance[np.ix_(order, order)].copy(), []
    values[free.index] = np.clip(answer[order], free.lower, free.upper)
    for k in np.flatnonzero(values[free.index] != answer[order]):
        messages.append(f"{free.names[k]} comes out as {answer[order][k]:.3g} +- {np.sqrt(spread[k, k]):.2g}, beyond its bound")
        spread[k, :] = spread[:, k] = np.nan
    if apart > 3.0:
        messages.append(
            f"the runs differ from one mass, spring and friction by {apart:.2g} times what their periods differ by, and the"
            " standard errors are widened by that much: friction depends on more than the direction of motion"
        )
    judged = [at_stamps(record) for record in records]
    if options.gains:
        judged = [
            replace(each, effort=each.effort - p * each.position - d * np.gradient(each.position, each.time))
            for each, (p, d) in zip(judged, options.gains, strict=True)
        ]
    rows = equations(judged, options)
    notes = [_note(run) for run in runs]
    result = concluded(METHOD, Fitted(structure.with_values(values), free, spread, rows, messages), judged, options)
    return replace(result, notes=(*notes, *result.notes))


def _note(run: Harmonics) -> str:
    left_out = f", {run.left_out:.2f} s before it was steady left out" if run.left_out > 0.0 else ""
    motion = f"{run.means.shape[0]} periods at {run.frequency:.6g} rad/s, amplitude {np.mean(np.abs(run.position)):.4g}"
    return f"{run.source}: {motion}{left_out}"


METHOD = Method(
    id="forced-oscillation",
    title="forced harmonic oscillation",
    needs="steady runs under a sinusoidal force, one recording each, at different frequencies and amplitudes",
    source="de Marchi 1998",
    fit=fit,
    uses=(*FILTER, "held", "gains"),
)
