"""Does the model describe the recording at all, and does it describe others as well?

What isn't determined is refused. A fit ends with an inertia of zero where the force does not accelerate the joint, and with a
prediction no better than a constant where it does not move it at all. With the share R^2 = 1 - NOE / 100 of the variance of the
force that p parameters explain, and n independent residuals (the rows over the length of their correlation), a constant does as
well unless

    F = (R^2 / p) / ((1 - R^2) / (n - p - 1))

is larger than its 99.9 % quantile; with less than a tenth of the variance explained, that decides.

A model that leaves more than half of the force does not describe the recording: a warning. Which change of the linear equation
u = m a + F sgn v + c v + b makes its sum of squares less than half names the likely reason: a term of the position (gravity, a
spring), a shift in time, or all of its dynamic terms being negative (a sign); likewise a constant that the model leaves over.
Without one, the force is another one's.

Recordings that no fit has seen are compared block by block, relative to their force where that is the larger one: their error
is larger when the mean of log(error) differs by Welch's test at 99 % and lies above 95 % of the training blocks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import f as f_distribution
from scipy.stats import ttest_ind

from ..model import Model
from ..record import Array, Record
from .equations import Equations, equations
from .free_parameters import FreeParameters
from .result import Identification, IdentificationError, Method, Options, Score
from .scoring import driving_force, force_along, score
from .statistics import bartlett_lag

__all__ = ["gap", "misfit", "refuse_undetermined", "validated"]

_HALF = 50.0  # percent of the force, of its norm or of its variance; physical: what is left outweighs what is described
_LITTLE = 0.1  # of the variance; physical: what explains more is at least said not to describe the recording
_CERTAIN = 0.999  # probability; statistical
_EXPLAINS = 0.5  # of a sum of squares, left by a reason that is named; physical: it explains as much as is left
_SHIFTS = 20  # rows to either side; numerical: of the search for a shift
_BLOCKS = 20  # of a recording; statistical: enough to tell a spread, and long beside the residual's correlation
_ROWS = 5  # of a block, at least; statistical: of fewer rows the mean square says little
_LEVEL = 0.01  # probability of a difference by chance; statistical
_NOTHING = 1e-3  # of the force's norm, that an inertia takes; physical: less than any force is measured to
_SEEN = 2.0  # standard errors; statistical


def refuse_undetermined(
    model: Model, free: FreeParameters, covariance: Array, found: Equations, scored: Score, source: str, by_force: bool
) -> None:
    """Refuse a fit that has found nothing.

    Args:
        model: with the values found.
        free: the parameters that were fitted.
        covariance: of their estimates, NaN where not known, shape ``(n_free, n_free)``.
        found: the equations that were fitted.
        scored: of the model on them.
        source: the recordings, for the message.
        by_force: True where these equations are what the method fits; of an axis that its controller has to hold up they say
            little.

    Raises:
        IdentificationError: the model explains no more of the force than a constant, or an inertia went to zero.
    """
    if by_force and scored.relative_force_error_percent > _HALF and not _more_than_constant(model, free, found, scored):
        raise IdentificationError(
            source,
            f"the model explains no more of the force than a constant does (NOE {scored.noe:.4g} %): "
            f"{', '.join(free.names)} don't relate this force to this motion",
            f"check {_joined(_reasons(model, found))}",
        )
    inertia = _without_inertia(model, free, covariance, found)
    if inertia:
        raise IdentificationError(
            source,
            f"{inertia} is not determined: the fit ends at zero, because the force shows no inertia (NOE {scored.noe:.3g} %)",
            f"give its value and hold it (--model FILE --hold {inertia}), record quicker reversals, or check "
            f"{_joined(_reasons(model, found))}",
        )


def _without_inertia(model: Model, free: FreeParameters, covariance: Array, found: Equations) -> str:
    """The name of an inertia that was fitted, takes next to none of the force and is not known to; empty when there is none."""
    acceleration = found.rows(lambda stretch: stretch.acceleration)
    share = float(np.sqrt(np.mean(acceleration**2) / max(float(np.mean(found.force**2)), 1e-300)))
    for k, (name, number) in enumerate(zip(free.names, free.index.tolist(), strict=True)):
        if name not in model.plant.inertia_names:
            continue
        value, error = float(model.values[number]), math.sqrt(max(covariance[k, k], 0.0))
        # NaN: on its bound.
        if value * share < _NOTHING and not value > _SEEN * error:
            return name
    return ""


def _more_than_constant(model: Model, free: FreeParameters, found: Equations, scored: Score) -> bool:
    """True when the variance that the model explains is more than chance gives as many parameters."""
    share = 1.0 - scored.noe / 100.0
    if not math.isfinite(share) or share <= 0.0:
        return False
    if share >= _LITTLE:
        return True
    residual = (driving_force(model, found) - found.rows(lambda stretch: force_along(model, stretch)))[found.sliding]
    p = len(free.names)
    n = residual.shape[0] / (1.0 + bartlett_lag(residual - float(np.mean(residual))))
    if n <= p + 2:
        return False
    ratio = (share / max(p, 1)) / ((1.0 - share) / (n - p - 1.0))
    return bool(ratio > float(f_distribution.ppf(_CERTAIN, max(p, 1), n - p - 1.0)))


def misfit(model: Model, found: Equations, scored: Score) -> str:
    """What to say of a model that leaves more than half of the force; empty for one that doesn't."""
    by_norm, by_variance = scored.relative_force_error_percent, scored.noe
    if not (by_norm > _HALF or by_variance > _HALF):
        return ""
    left = f"{by_norm:.3g} % of the force" if by_norm > _HALF else f"{by_variance:.3g} % of the variance of the force"
    return f"the model does not describe the recording: it leaves {left}; check {_joined(_reasons(model, found))}"


def _joined(reasons: Sequence[str]) -> str:
    return reasons[0] if len(reasons) == 1 else ", ".join(reasons[:-1]) + " or " + reasons[-1]


def _least(columns: Array, target: Array) -> tuple[float, Array]:
    """Sum of squares that least squares leaves, and the values, shape ``(n_columns,)``."""
    size = np.linalg.norm(columns, axis=0)
    size[size == 0.0] = 1.0
    values = np.linalg.lstsq(columns / size, target, rcond=1e-10)[0]
    rest = target - columns / size @ values
    return float(rest @ rest), np.asarray(values / size)


def _reasons(model: Model, found: Equations) -> list[str]:
    """Likely reasons why the force does not belong to the motion, each as something to check."""
    use = found.clear
    v = found.velocity[use]
    a = found.rows(lambda stretch: stretch.acceleration)[use]
    q = found.rows(lambda stretch: stretch.position)[use]
    force, one = found.force[use], np.ones_like(v)
    if force.shape[0] < 4 * _SHIFTS:
        return _other()
    rigid = np.column_stack([a, np.sign(v), v, one])
    left, values = _least(rigid, force)
    spread = force - float(np.mean(force))
    reasons = []
    residual = (driving_force(model, found) - found.rows(lambda stretch: force_along(model, stretch)))[use]
    if float(np.mean(residual)) ** 2 > _EXPLAINS * float(np.mean(residual**2)):
        reasons.append("gravity or an offset of the force (a constant is left over: add the term bias)")
    if values[0] < 0.0 and values[1] < 0.0 and left < _EXPLAINS * float(spread @ spread):
        reasons.append("the sign of the effort or of the position (the force is against the acceleration)")
    bent = [np.sin(q), np.cos(q)] if model.units.position == "rad" else []
    if _least(np.column_stack([rigid, q, *bent]), force)[0] < _EXPLAINS * left:
        reasons.append("gravity or a spring (the force depends on the position: add stiffness, or use the plant pendulum)")
    best, at = left, 0
    for shift in range(-_SHIFTS, _SHIFTS + 1):
        rows = slice(max(-shift, 0), force.shape[0] - max(shift, 0))
        moved = force[max(shift, 0) : force.shape[0] + min(shift, 0)]
        rest = _least(rigid[rows], moved)[0] * force.shape[0] / moved.shape[0]
        if rest < best:
            best, at = rest, shift
    if best < _EXPLAINS * left:
        step = float(np.median(np.diff(found.time[use])))
        reasons.append(
            f"the times of force and motion (the force fits {abs(at) * step:.3g} s {'later' if at > 0 else 'earlier'})"
        )
    return reasons or _other()


def _other() -> list[str]:
    return ["that the effort belongs to this joint (another column)", "another joint's motion", "gravity", "the sign"]


def _blocks(model: Model, records: Sequence[Record], options: Options) -> tuple[Array, float]:
    """Logarithm of the force error of each block of ``records``, and of the force itself."""
    found = equations(list(records), options)
    residual = driving_force(model, found) - found.rows(lambda stretch: force_along(model, stretch))
    use = found.sliding
    residual, size = residual[use], float(np.sqrt(np.mean(found.force[use] ** 2)))
    count = min(_BLOCKS, residual.shape[0] // _ROWS)
    if count < 3 or size == 0.0:
        return np.zeros(0), 0.0
    parts = np.array_split(residual, count)
    return np.log([max(float(np.sqrt(np.mean(part**2))), 1e-12 * size) for part in parts]), math.log(size)


def validated(
    result: Identification, method: Method, records: Sequence[Record], validation: Sequence[Record], options: Options
) -> Identification:
    """``result`` with its score on ``validation``, and what is to be said of it beside the ``records`` that were fitted."""
    notes = tuple(f"validation, {record.source}: {note}" for record in validation for note in record.notes)
    notes += result.remarks_on(validation)
    result = replace(result, validation=score(result.model, validation, options), notes=(*result.notes, *notes))
    worse = gap(result.model, records, validation, options) if method.predicts else ""
    if not worse:
        return result
    return replace(result, warnings=(*result.warnings, worse), status=f"{result.status}; {worse}")


def gap(model: Model, records: Sequence[Record], validation: Sequence[Record], options: Options) -> str:
    """What to say when ``validation`` is described worse than ``records``, the training; empty when it is not."""
    (train, before), (other, after) = _blocks(model, records, options), _blocks(model, validation, options)
    if min(train.size, other.size) < 3:
        return ""
    # Noise does not grow with the force, what a model lacks may.
    other = other - max(after - before, 0.0)
    test = ttest_ind(other, train, equal_var=False, alternative="greater")
    if not float(test.pvalue) < _LEVEL or float(np.mean(other)) <= float(np.quantile(train, 0.95)):
        return ""
    times = float(np.exp(np.mean(other) - np.mean(train)))
    return (
        f"the validation error is {times:.3g} times the training error, more than blocks of the training recordings differ: "
        "the model does not hold for both; compare their load, temperature, speed and travel, or add what differs"
    )
