"""From natural parameters to a model's: what each method for free oscillations does with a structure and recordings.

With the mass m held, and a feedback u = u_0 - P q - D v that acts meanwhile,

    k = m w^2 - P,  F_v = 2 m w zeta - D,  D_v = 2 m w D_zeta,  F_C = m w^2 x_k,  b + D_C = m w^2 D_x + k q_0 + u_0 .

A bias and an asymmetric Coulomb level do the same while sliding: where a structure has both, the bias is fitted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...method_settings import FILTER
from ...model import Model
from ...record import Array, Mask, Record
from ...simulation import predict_force
from ..conclusion import standard_errors
from ..free_parameters import FreeParameters
from ..result import Identification, IdentificationError, Method, Options
from ..verdict import warnings_of
from .motion import Natural
from .recording import Oscillation, find_oscillation
from .result import FreeOscillation
from .scoring import score_of

__all__ = [
    "ALL",
    "PHYSICAL",
    "asked_of",
    "closing",
    "constant_force",
    "free_oscillation_method",
    "gains_of",
    "identified",
    "oscillations",
    "physical",
]

ALL: Mask = np.ones(5, dtype=np.bool_)

PHYSICAL = ("stiffness.stiffness", "viscous.coefficient", "asymmetry.coefficient", "coulomb.force", "constant")
"""Parameters of a model in the order of the natural ones; ``constant`` is that of :func:`constant_force`."""

_LINEAR = 0.01
_EFFECTS = {"stiffness", "viscous", "coulomb", "asymmetry", "bias"}


def constant_force(model: Model, held: Sequence[str]) -> str | None:
    """The parameter that takes the constant part of the force, or None."""
    for name in ("bias.force", "asymmetry.force"):
        if name in model.names and name not in held:
            return name
    return None


def asked_of(model: Model, source: str, spring: bool = True) -> Mask:
    """Which natural parameters the terms of ``model`` can explain, shape ``(5,)``; ``spring`` asks for one among them.

    Raises:
        IdentificationError: it has other terms, or none that makes it oscillate.
    """
    present = {held.effect.id for held in model.terms}
    strange = sorted(present - _EFFECTS)
    if strange:
        raise IdentificationError(
            source,
            f"a free oscillation can't be fitted with {', '.join(strange)}",
            f"use the terms {', '.join(sorted(_EFFECTS))}, or the method output-error",
        )
    if spring and "stiffness" not in present and model.plant.id == "rigid":
        raise IdentificationError(source, "the structure has no spring", "add the term stiffness (--terms stiffness,...)")
    # The centre of the oscillation is always free: where a spring is relaxed isn't known to the last step of an encoder.
    return np.array([True, "viscous" in present, "asymmetry" in present, "coulomb" in present, True])


def physical(natural: Natural, mass: float, found: Oscillation, position: float) -> Array:
    """Values of :data:`PHYSICAL`, shape ``(5,)``, for a spring that is relaxed at ``position`` [x]."""
    w, feedback = natural.frequency, found.feedback
    spring = mass * w**2
    stiffness = spring - feedback.proportional
    return np.array(
        [
            stiffness,
            2.0 * mass * w * natural.damping - feedback.derivative,
            2.0 * mass * w * natural.damping_difference,
            spring * natural.offset,
            spring * natural.offset_difference + stiffness * position + feedback.constant,
        ]
    )


def _propagated(result: FreeOscillation, mass: float, found: Oscillation, position: float) -> tuple[Array, Array]:
    """:func:`physical` and its covariance, ``(5,)`` and ``(5, 5)``."""
    values = result.natural.values
    spread = np.sqrt(np.maximum(np.diag(result.covariance), 0.0))
    slope = np.zeros((5, 5))
    for k in np.flatnonzero(spread > 0):
        step = np.zeros(5)
        step[k] = max(1e-3 * spread[k], 1e-9 * abs(values[k]))
        up, down = (physical(Natural.of(values + sign * step), mass, found, position) for sign in (1.0, -1.0))
        slope[:, k] = (up - down) / (2.0 * step[k])
    return physical(result.natural, mass, found, position), slope @ result.covariance @ slope.T


def _combined(values: list[Array], covariances: list[Array], asked: Mask) -> tuple[Array, Array, float]:
    """Mean weighted by the inverse covariances, its covariance, and the reduced sum of squares of what they differ by."""
    if len(values) == 1:
        return values[0], covariances[0], 1.0
    some = np.ix_(asked, asked)
    # A stiffness and a friction coefficient may be many orders of magnitude apart.
    scale = np.sqrt(np.mean([np.diag(covariance[some]) for covariance in covariances], axis=0))
    information = [
        np.linalg.inv(covariance[some] / np.outer(scale, scale)) / np.outer(scale, scale) for covariance in covariances
    ]
    spread = np.linalg.inv(np.sum(information, axis=0) * np.outer(scale, scale)) * np.outer(scale, scale)
    mean = spread @ np.sum([w @ v[asked] for w, v in zip(information, values, strict=True)], axis=0)
    apart = sum(float((v[asked] - mean) @ w @ (v[asked] - mean)) for w, v in zip(information, values, strict=True))
    freedom = (len(values) - 1) * int(np.sum(asked))
    whole, covariance = np.zeros(5), np.zeros((5, 5))
    whole[asked], covariance[some] = mean, spread
    return whole, covariance, apart / freedom if freedom else 1.0


def identified(
    method: str,
    analyse: Callable[[Oscillation, Mask], FreeOscillation],
    structure: Model,
    records: Sequence[Record],
    options: Options,
) -> Identification:
    """The identification of ``structure`` from ``records`` by ``analyse``; several recordings are weighted together."""
    asked = asked_of(structure, records[0].source)
    mass = structure.plant.inertia(*structure.plant_values)
    position = structure.value("stiffness.position") if "stiffness.position" in structure.names else 0.0
    found = oscillations(structure, records, options)
    results = [analyse(each, asked) for each in found]
    pairs = [_propagated(result, mass, each, position) for result, each in zip(results, found, strict=True)]
    values, covariance, apart = _combined([v for v, _ in pairs], [c for _, c in pairs], asked)
    warnings = [
        f"{structure.plant.parameters[0].name} is held at {mass:g}: a free oscillation shows only ratios to it"
        " (several runs with different feedback gains show it: parametric-oscillation)"
    ]
    if len(records) > 1 and apart > 3.0:
        warnings.append(
            f"the recordings differ by {np.sqrt(apart):.2g} times their standard errors, which are widened by that much:"
            " something changes from one to the next"
        )
        covariance = covariance * apart
    for result, record in zip(results, records, strict=True):
        prefix = f"{record.source}: " if len(records) > 1 else ""
        warnings += [f"{prefix}{warning}" for warning in result.warnings]
    trouble = next((result.status for result in results if "not to be relied" in result.status or ", but" in result.status), "")
    names = (*PHYSICAL[:4], constant_force(structure, options.held) or "")
    notes = [f"{each.source}: {len(each.turns) - 1} half cycles between reversals used" for each in found]
    notes += [f"{each.source}: {note}" for each in found for note in each.notes]
    return closing(method, structure, (names, values, covariance), (records, found), options, (trouble, warnings, notes))


def oscillations(structure: Model, records: Sequence[Record], options: Options, judge: bool = True) -> list[Oscillation]:
    """The free oscillation in each recording, the plant's own spring and damper counted as a feedback.

    Args:
        structure: the plant.
        records: the recordings.
        options: with the gains where they are given.
        judge: whether a force is held against that of the mass, which then must be known.
    """
    mass = structure.plant.inertia(*structure.plant_values) if judge else None
    found = [find_oscillation(record, gains, mass) for record, gains in zip(records, gains_of(records, options), strict=True)]
    if structure.plant.id == "rigid":
        return found
    own = []
    for each in found:
        reach = 0.5 * float(np.ptp(each.position))
        probe = np.array([reach, -reach, 0.0, 0.0])
        speed = np.array([0.0, 0.0, 1.0, -1.0]) * reach * np.pi / each.half_period
        force = predict_force(structure.with_terms(()), np.zeros(4), probe, speed, np.zeros(4), each.sample_time)
        half = predict_force(structure.with_terms(()), np.zeros(1), 0.5 * probe[:1], np.zeros(1), np.zeros(1), each.sample_time)
        proportional, derivative = float(force[0] - force[1]) / (2.0 * reach), float(force[2] - force[3]) / (2.0 * speed[2])
        bend = abs(float(half[0]) / (0.5 * reach) / proportional - 1.0) if proportional else 0.0
        notes = each.notes
        if bend > _LINEAR:
            notes = (
                *notes,
                f"the plant's own restoring force differs by {100 * bend:.2g} % from a spring's over the half amplitude",
            )
        feedback = replace(
            each.feedback,
            proportional=each.feedback.proportional + proportional,
            derivative=each.feedback.derivative + derivative,
        )
        own.append(replace(each, feedback=feedback, notes=notes))
    return own


def gains_of(records: Sequence[Record], options: Options) -> list[tuple[float, float] | None]:
    """The feedback gains given for each recording.

    Raises:
        IdentificationError: there are some, but not one pair for each recording.
    """
    if not options.gains:
        return [None] * len(records)
    if len(options.gains) != len(records):
        raise IdentificationError(
            records[0].source,
            f"{len(options.gains)} feedback gain(s) for {len(records)} recording(s)",
            "give one gain for each recording, in their order",
        )
    return list(options.gains)


def closing(
    method: str,
    structure: Model,
    found: tuple[Sequence[str], Array, Array],
    recordings: tuple[Sequence[Record], Sequence[Oscillation]],
    options: Options,
    said: tuple[str, list[str], list[str]],
) -> Identification:
    """The result with values that respect their bounds, warnings and score.

    Args:
        method: its id.
        structure: the model to put the values into.
        found: names (those that the model doesn't have are left out), values and covariance of what was fitted.
        recordings: the recordings, and the oscillation found in each.
        options: of the fit.
        said: a status that replaces the usual one (or an empty text), warnings and notes.
    """
    names, numbers, covariance = found
    trouble, warnings, notes = said
    free = FreeParameters.of(structure, Options(held=options.held))
    free = free.without({name for name in free.names if name not in names})
    order = [list(names).index(name) for name in free.names]
    values, spread = structure.values, covariance[np.ix_(order, order)].copy()
    wanted = numbers[order]
    values[free.index] = np.clip(wanted, free.lower, free.upper)
    for k in np.flatnonzero(values[free.index] != wanted):
        warnings.append(f"{free.names[k]} comes out as {wanted[k]:.3g} +- {np.sqrt(spread[k, k]):.2g}, beyond its bound")
        spread[k, :] = spread[:, k] = np.nan
    model = structure.with_values(values)
    if not {"bias.force", "asymmetry.force"} & set(names):
        size, error = float(numbers[-1]), float(np.sqrt(max(covariance[-1, -1], 0.0)))
        if abs(size) > 4.0 * error:
            warnings.append(
                f"it swings about a point that a constant force of {size:.3g} +- {error:.2g} explains: add the term bias"
            )
    model = model.with_values(model.values, standard_errors(free, spread))
    more, status = warnings_of(model, free, spread)
    train, score_notes = score_of(model, *recordings, options)
    return Identification(
        model=model,
        fitted=free.names,
        covariance=spread,
        method=method,
        status=trouble or status,
        warnings=(*warnings, *more),
        notes=(*notes, *score_notes),
        train=train,
    )


def free_oscillation_method(
    name: str, title: str, source: str, analyse: Callable[[Oscillation, Mask], FreeOscillation]
) -> Method:
    """The method that fits a structure to free oscillations by ``analyse``; the mass is held.

    Its ``fit`` raises IdentificationError where a recording holds no free oscillation, or the structure is of another kind.
    """
    return Method(
        id=name,
        title=title,
        needs="a free oscillation: released from a deflection, no force but a spring or a feedback of position and velocity",
        source=source,
        fit=partial(identified, name, analyse),
        needs_force=False,
        uses=(*FILTER, "held", "gains"),
    )
