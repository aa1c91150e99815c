"""Identification piece by piece: a recording that doesn't fit into memory, and whether its parameters stay what they are.

Each piece is identified by itself, by any method; of a piece nothing is kept but its row. The rows of a parameter are put
together as estimates of one quantity (:mod:`.random_effects`): its mean over the pieces, how much it scatters from piece to
piece beyond the standard errors, and its drift, the slope of a line through the pieces over time. A piece that can't be read
or fitted is left out and says why.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..bagio.pieces import Piece
from ..errors import InputError
from ..model import Model
from ..record import Record
from ..threads import linear_algebra_in_one
from .random_effects import random_effects
from .result import IdentificationError, Method, Options
from .workflow import Fitted, Progress, identified, silent

__all__ = ["Combined", "Piecewise", "Row", "identified_piecewise"]

_HOUR = 3600.0  # [s]
_QUANTILE = 1.959963984540054  # statistical level: 95 % of a normal distribution lie within so many standard deviations
_SERIOUS = ("warning", "fault")
_REASONS = 5  # why pieces are left out, told one by one
_REMARKS = 12  # on pieces, told one by one
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\d.,]*(e[-+]?\d+)?")
_NEEDED = 3  # pieces for a line through them, of which one more than the line has coefficients leaves a residual


@dataclass(frozen=True)
class Row:
    """What is kept of a piece.

    Attributes:
        begin: [s] from the first message of the recording.
        end: as that.
        values: of the fitted parameters, by name; empty where the piece was refused.
        errors: their standard errors; NaN where not known.
        refused: why the piece is left out; empty otherwise.
    """

    begin: float
    end: float
    values: dict[str, float] = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)
    refused: str = ""

    def half(self, name: str) -> float:
        """Half the width of the 95 % interval of a parameter; NaN where not known."""
        return _QUANTILE * self.errors.get(name, math.nan)


@dataclass(frozen=True)
class Combined:
    """One parameter over all pieces.

    Attributes:
        name: of the parameter.
        unit: its unit.
        value: mean over the pieces.
        error: its standard error; infinite with a single piece.
        half: half the width of its 95 % interval; as ``error``.
        scatter: standard deviation from piece to piece beyond the standard errors; NaN with a single piece.
        drift: change per hour; NaN with fewer than three pieces.
        drift_half: half the width of its 95 % interval.
        pieces: in how many pieces it was found with a standard error.
    """

    name: str
    unit: str
    value: float
    error: float
    half: float
    scatter: float
    drift: float
    drift_half: float
    pieces: int


@dataclass(frozen=True)
class Piecewise:
    """Result of an identification piece by piece.

    Attributes:
        model: the structure with the combined values and their standard errors.
        method: id of the method.
        rows: of all pieces, in their order.
        combined: of the fitted parameters.
        notes: what a user should know before trusting the values.
    """

    model: Model
    method: str
    rows: tuple[Row, ...]
    combined: tuple[Combined, ...]
    notes: tuple[str, ...]

    @property
    def used(self) -> tuple[Row, ...]:
        """The pieces that were not refused."""
        return tuple(row for row in self.rows if not row.refused)


def identified_piecewise(
    pieces: Iterable[Piece],
    structure: Callable[[Record], Model],
    method: Callable[[Model], Method],
    options: Callable[[Method], Options],
    progress: Progress = silent,
) -> Piecewise:
    """Identify each piece, and put the parameters together.

    The loads and temperatures that the values hold at are those of the first piece that was identified.

    Args:
        pieces: read one after the other.
        structure: model whose terms are fitted, for the first record.
        method: of that model.
        options: settings of the fit by that method.
        progress: told what is going on, a line for each piece.

    Raises:
        IdentificationError: no piece could be identified.
        InputError: the model or the settings can't be used.
    """
    rows: list[Row] = []
    seen: Counter[str] = Counter()
    begun: tuple[Model, Method, Options] | None = None
    model: Model | None = None
    for piece in pieces:
        refused = piece.refused
        if piece.record is not None:
            if begun is None:
                first = structure(piece.record)
                chosen = method(first)
                begun = _without_time(first), chosen, options(chosen)
            try:
                with linear_algebra_in_one():  # matrices are small: several threads wait for each other
                    found = _one(piece.record, begun, model)
                model = found.result.model
                seen.update(_remarks(found))
                rows.append(_row(piece, found))
            except InputError as error:
                refused = error.problem
        if refused:
            rows.append(Row(piece.begin, piece.end, refused=" ".join(refused.split())))
        progress(_line(rows[-1]))
        del piece
    if model is None or begun is None:
        reasons = "; ".join(dict.fromkeys(row.refused for row in rows[:_NEEDED]))
        raise IdentificationError("pieces", f"none of {len(rows)} could be identified: {reasons}", "choose other --pieces")
    names = list(dict.fromkeys(name for row in rows for name in row.values))
    combined = tuple(_combined(model, name, rows) for name in names)
    for each in combined:
        model = model.with_value(each.name, each.value)
    errors = {each.name: each.error for each in combined if math.isfinite(each.error)}
    used = [row for row in rows if not row.refused]
    provenance = {
        **{name: model.provenance[name] for name in ("recordings", "method")},
        "pieces": f"{len(used)} of {len(rows)}, from {rows[0].begin:.6g} s to {rows[-1].end:.6g} s",
    }
    model = replace(model, standard_errors=errors, provenance=provenance)
    return Piecewise(model, begun[1].id, tuple(rows), combined, _notes(rows, combined, seen))


def _without_time(model: Model) -> Model:
    """The model, unless it has a drift of its own.

    Raises:
        IdentificationError: it has one, whose time would begin anew with each piece.
    """
    for each in model.terms:
        if each.effect.id == "time_drift":
            problem = "can't be fitted piece by piece: its time would begin anew with each piece"
            raise IdentificationError(
                "time_drift", problem, "leave it out; the drift of every parameter is a result of the pieces"
            )
    return model


def _one(record: Record, begun: tuple[Model, Method, Options], before: Model | None) -> Fitted:
    """The identification of one piece; ``before`` is the result of an earlier one, None for the first."""
    structure, method, options = begun
    if before is not None:
        structure = replace(structure, nominal=before.nominal)
    return identified(structure, [record], (), method.id, options, experiments=False, foresight=before is None)


def _row(piece: Piece, found: Fitted) -> Row:
    result = found.result
    values = {name: result.model.value(name) for name in result.fitted}
    errors = {name: result.model.standard_errors.get(name, math.nan) for name in result.fitted}
    return Row(piece.begin, piece.end, values, errors)


def _remarks(found: Fitted) -> set[str]:
    """What is said of a piece, without its numbers, so that the same remark on many pieces is one."""
    checks = (f"the check '{each.check}' has a {each.verdict}" for each in found.result.checks if each.verdict in _SERIOUS)
    told = (*found.train[0].notes, *found.result.notes, *found.result.warnings)
    return {*checks, *(_NUMBER.sub("#", text) for text in told)}


def _line(row: Row) -> str:
    said = f"refused: {row.refused}" if row.refused else ", ".join(f"{name} {value:.5g}" for name, value in row.values.items())
    return f"{row.begin:.6g} s to {row.end:.6g} s: {said}"


def _combined(model: Model, name: str, rows: Sequence[Row]) -> Combined:
    held = [row for row in rows if name in row.values]
    sure = [row for row in held if math.isfinite(row.errors[name]) and row.errors[name] > 0.0]
    if not sure:
        value = float(np.median([row.values[name] for row in held]))
        return Combined(name, model.unit(name), value, math.inf, math.inf, math.nan, math.nan, math.inf, 0)
    values, errors = (np.array([each[name] for each in (getattr(row, kind) for row in sure)]) for kind in ("values", "errors"))
    mean = random_effects(values, errors)
    error, half = float(mean.errors[0]), float(mean.half[0])
    drift, drift_half = math.nan, math.inf
    if len(sure) >= _NEEDED:
        hours = np.array([0.5 * (row.begin + row.end) for row in sure]) / _HOUR
        line = random_effects(values, errors, np.column_stack([np.ones(hours.size), hours - np.mean(hours)]))
        drift, drift_half = float(line.values[1]), float(line.half[1])
    return Combined(name, model.unit(name), float(mean.values[0]), error, half, mean.scatter, drift, drift_half, len(sure))


def _notes(rows: Sequence[Row], combined: Sequence[Combined], seen: Counter[str]) -> tuple[str, ...]:
    notes = []
    refused = Counter(row.refused for row in rows if row.refused)
    used = len(rows) - refused.total()
    for reason, times in refused.most_common(_REASONS):
        notes.append(f"{times} of {len(rows)} pieces are left out: {reason}")
    if len(refused) > _REASONS:
        notes.append(f"further pieces are left out for {len(refused) - _REASONS} other reasons")
    for remark, times in seen.most_common(_REMARKS):
        notes.append(f"in {times} of {used} pieces: {remark}")
    if len(seen) > _REMARKS:
        notes.append(f"and {len(seen) - _REMARKS} further kinds of remarks on single pieces")
    for each in combined:
        if each.pieces < used:
            notes.append(f"{each.name}: {used - each.pieces} of {used} pieces give no standard error and do not count")
    if used == 1:
        notes.append("a single piece was identified: there is nothing to compare it with")
    notes.append("what is wrong in all pieces alike, such as the scale of the force, is not in the intervals")
    return tuple(notes)
