"""Errors of the instruments that a recording can't tell from the parameters of a structure.

The errors that an instrument can have (a wrong scale of the force, a delay or an offset between force and position) are columns
like the parameters' sensitivities, got by disturbing the recording. Where the parameters' columns span one of them, it goes
unnoticed into the parameters, and how far is the solution of that least-squares problem.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import savgol_filter

from ..record import Array, Mask, Record
from .design.search import Problem
from .foreseen import Finding
from .result import Options
from .sensitivity import VIEWS, View, sensitivities

__all__ = ["instrument_errors"]

_SPANNED = 0.96  # R^2 from which on an instrument's error goes unnoticed: a correlation of 0.98
_ITSELF = 0.995  # correlation of a column with an instrument's error from which on the parameter is that error
_SMOOTH = 0.03  # [s] over which the noise of a force is taken out before its derivative
_DISTINCT = 3e-3  # singular values below, relative to the largest, tell nothing
_HARMLESS = 0.002  # relative change of a parameter


@dataclass(frozen=True)
class _Fault:
    """An error that an instrument may have.

    Attributes:
        title: in a sentence.
        unit: how much of it is spoken of, in a sentence.
        amount: the same, as the argument of ``disturb``.
        disturb: a recording with so much of it.
        remedy: what would show it.
        serious: False for what no recording shows, which is worth a note.
    """

    title: str
    unit: str
    amount: float
    disturb: Callable[[Record, float], Record]
    remedy: str
    serious: bool = True


def _delayed(record: Record, amount: float) -> Record:
    """``record`` with its effort later by ``amount`` [s], but for its noise, which a derivative would only make louder."""
    width = max(round(_SMOOTH / record.sample_time) // 2 * 2 + 1, 5)
    if width > record.n_samples:
        return record
    smooth = savgol_filter(record.effort, width, 2)
    return replace(record, effort=record.effort + np.interp(record.time - amount, record.time, smooth) - smooth)


def _faults(records: Sequence[Record]) -> list[_Fault]:
    units = records[0].units
    largest = max(float(np.max(np.abs(record.effort))) for record in records)
    step = records[0].sample_time
    return [
        _Fault(
            "the scale of the force (a motor constant, a gain)",
            "1 %",
            0.01,
            lambda record, amount: replace(record, effort=record.effort * (1.0 + amount)),
            "weigh the moving part and hold its mass (--hold mass), or hang a known weight on it",
            # It goes into everything in every recording; where the force has no unit of force, it is known to be there.
            serious=units.force not in ("N", "N m"),
        ),
        _Fault(
            "a delay between force and position",
            f"{1e3 * step:.3g} ms",
            step,
            _delayed,
            "record quick motion at several frequencies: only a delay turns the phase in proportion to the frequency",
        ),
        _Fault(
            "an offset of the force",
            f"{0.01 * largest:.2g} {units.force}",
            0.01 * largest,
            lambda record, amount: replace(record, effort=record.effort + amount),
            "record motion in both directions, and the force at rest with the drive off",
        ),
    ]


def _column(
    fault: _Fault, problem: Problem, records: Sequence[Record], options: Options, predicts: str, n_rows: int
) -> Array | None:
    """What the fault changes in the errors, per its amount, shape ``(n_rows,)``; None when it changes which rows there are."""
    part = 0.1
    sides = []
    for sign in (part, -part):
        disturbed = [fault.disturb(record, sign * fault.amount) for record in records]
        sides.append(VIEWS[predicts](problem.model, disturbed, options, problem.index).errors(problem.model))
        if sides[-1].shape[0] != n_rows:
            return None
    return np.asarray((sides[0] - sides[1]) / (2.0 * part))


def _is_itself(
    alike: float, k: int, fault: _Fault, problem: Problem, records: Sequence[Record], options: Options, predicts: str
) -> bool:
    """True when parameter ``k`` is this very fault: when it looks like it in the mirrored motion as well."""
    mirrored = [replace(record, position=-record.position, effort=-record.effort, reference=None) for record in records]
    view = VIEWS[predicts](problem.model, mirrored, options, problem.index)
    changed = _column(fault, problem, mirrored, options, predicts, view.rows().shape[0])
    if changed is None:
        return False
    use = view.rows()
    own = sensitivities(view, problem.model, problem.free, problem.size)[use, k]
    across = float(own @ changed[use])
    return across * math.copysign(1.0, alike) > _ITSELF * float(np.linalg.norm(own) * np.linalg.norm(changed[use]))


def instrument_errors(
    problem: Problem, view: View, columns: Array, use: Mask, records: Sequence[Record], options: Options, predicts: str
) -> list[Finding]:
    """Errors of the instruments that the parameters would take up unnoticed.

    Args:
        problem: the model, its free parameters, and what is known of them.
        view: what the method predicts.
        columns: sensitivities at the rows used, shape ``(n, n_parameters)``.
        use: rows used, of all.
        records: to be fitted.
        options: of the fit.
        predicts: what the method predicts, a key of :data:`fric.identification.sensitivity.VIEWS`.
    """
    found = []
    size = np.linalg.norm(columns, axis=0)
    shown = np.flatnonzero(size > 1e-9 * np.max(size, initial=0.0))
    scaled = columns[:, shown] / size[shown]
    names = [problem.free.names[k] for k in shown.tolist()]
    for fault in _faults(records):
        column = _column(fault, problem, records, options, predicts, use.shape[0])
        if column is None or not np.any(column[use]):
            continue
        column = column[use]
        alike = scaled.T @ column / float(np.linalg.norm(column))
        k = int(np.argmax(np.abs(alike)))
        if abs(alike[k]) > _ITSELF and _is_itself(float(alike[k]), int(shown[k]), fault, problem, records, options, predicts):
            continue
        # In units of the parameters' sizes: of all changes that do, the smallest.
        change = np.linalg.lstsq(columns[:, shown], column, rcond=_DISTINCT)[0]
        left = column - columns[:, shown] @ change
        most = float(np.max(np.abs(change)))
        if float(left @ left) > (1.0 - _SPANNED) * float(column @ column) or most < _HARMLESS:
            continue
        moved = [k for k in np.argsort(np.abs(change))[::-1].tolist() if abs(change[k]) > 0.3 * most]
        changes = ", ".join(f"{names[k]} by {100.0 * change[k]:+.2g} %" for k in moved)
        message = (
            f"{fault.title} can't be detected here: {fault.unit} of it would change {changes}. To detect it, {fault.remedy}"
        )
        found.append(Finding("instrument", tuple(names[k] for k in moved), message, fault.serious))
    return found
