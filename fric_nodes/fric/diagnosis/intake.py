"""What a diagnosis takes in: recordings that are of use, without the faults that can be taken out of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..instrument import Correction, inspect
from ..instrument import Finding as Check
from ..instrument.lines import error_again
from ..instrument.view import View
from ..model import Model
from ..record import Array, Record
from ..signals.resolution import noise_of
from .start import DiagnosisError

__all__ = ["of_use", "refuse", "without_faults"]

_STILL = 12.0  # times the noise of a position, that hardly any sample of an hour is off by to either side
_FLICKERS = 3  # values


def refuse(train: Sequence[Record], validation: Sequence[Record]) -> None:
    """Refuse to go on without recordings of either kind, or with one that is learnt from and held back.

    Raises:
        DiagnosisError: that is so.
    """
    if not train or not validation:
        raise DiagnosisError("diagnose", "needs recordings to learn from and one held back", "give TRAIN and --validate")
    for held in validation:
        for other in train:
            same = held.n_samples == other.n_samples and np.array_equal(held.position, other.position)
            if same and np.array_equal(held.effort, other.effort) and np.any(held.mask & other.mask):
                raise DiagnosisError(
                    held.source, "is the recording that is learnt from, too", "hold another recording back for --validate"
                )


def of_use(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Those of ``records`` in which a force moves the axis, and a note for each that is left out.

    Raises:
        DiagnosisError: there is none.
    """
    held, notes = [], []
    refusal: DiagnosisError | None = None
    for record in records:
        if _rests(record.position):
            problem, remedy = "holds nothing but rest", "record the axis in motion"
        elif float(np.ptp(record.effort)) == 0.0:
            problem, remedy = "has no force signal: it never changes", "record the effort, or give --topic"
        else:
            held.append(record)
            continue
        refusal = refusal or DiagnosisError(record.source, problem, remedy)
        notes.append(f"{record.source} {problem}: left out")
    if not held and refusal is not None:
        raise refusal
    return held, notes


def _rests(position: Array) -> bool:
    """True where a position shows nothing but its noise, or flickers between neighbouring steps of its encoder."""
    return float(np.ptp(position)) <= _STILL * noise_of(position) or np.unique(position).size <= _FLICKERS


def without_faults(
    train: Sequence[Record], validation: Sequence[Record], nominal: Model, checks: Sequence[Check]
) -> tuple[list[Record], list[Record], list[str]]:
    """The recordings without the faults of sign, unit and clock that can be taken out of them.

    What all recordings learnt from have is taken out of those held back alike, unless these are seen not to have it; what these
    alone have is taken out of them, unless those learnt from give a warning of the same: then the axis is unlike its model. A
    delay is left in: it may belong to the axis, and is a candidate like others.
    """
    held, kept_apart, notes = list(train), list(validation), []
    wrong = [(check, correction) for check in checks if (correction := _correction_of(check)) is not None]
    for check, correction in wrong:
        for k in range(len(held)) if check.recording is None else [check.recording]:
            held[k] = correction.apply(held[k])
        notes.append(f"corrected before anything was fitted: {correction.text} ({check.detail})")
    of_all: dict[str, Correction] = {}
    for check, correction in wrong:
        if correction.position_error is not None:
            continue  # where an encoder's lines lie is known only to the recording that shows them
        if check.recording is None or sum(each.check == check.check for each, _ in wrong) == len(held):
            of_all.setdefault(check.check, correction)
    unlike = {check.check for check in checks if check.verdict == "warning" and check.correction is None}
    own_checks = [[each for each in checks if each.recording in (k, None)] for k in range(len(train))]
    for k, record in enumerate(validation):
        seen = inspect([record], nominal)
        own_checks.append(list(seen))
        right = {check.check for check in seen if check.verdict == "ok"}
        for name, correction in of_all.items():
            if name in right:
                notes.append(f"{record.source} is right as it is: not corrected by {correction.text}")
            else:
                kept_apart[k] = correction.apply(kept_apart[k])
        for check in seen:
            own = _correction_of(check)
            if own is not None and check.check not in of_all and check.check not in unlike:
                kept_apart[k] = own.apply(kept_apart[k])
                notes.append(f"corrected in {record.source} alone: {own.text} ({check.detail})")
    both, known = _without_known_lines([*held, *kept_apart], own_checks)
    return both[: len(held)], both[len(held) :], [*notes, *known]


def _without_known_lines(records: Sequence[Record], checks: Sequence[Sequence[Check]]) -> tuple[list[Record], list[str]]:
    """``records`` without the error within an encoder's lines in those that don't show it by themselves, and notes.

    All are of one encoder: what it errs by is known where any of them shows it.

    Args:
        records: corrected by what each of them shows.
        checks: of each of them.
    """
    held = list(records)
    notes: list[str] = []
    lines = [check for own in checks for check in own if check.check == "interpolation"]
    shown = [check.correction.position_error for check in lines if check.correction and check.correction.position_error]
    if not shown:
        return held, notes
    largest = max(shown, key=lambda error: error.amplitude)
    for k, (record, line) in enumerate(zip(records, lines, strict=True)):
        moves_itself = line.verdict == "ok" and line.value > 0.0
        error = None if line.correction or moves_itself else error_again(View(record), largest)
        if error is not None:
            correction = Correction(position_error=error)
            held[k] = correction.apply(record)
            notes.append(f"corrected in {record.source}, too: {correction.text}")
    return held, notes


def _correction_of(check: Check) -> Correction | None:
    """What takes out the fault that ``check`` has found, or the error within an encoder's lines; else None."""
    correction = check.correction
    if correction is None or correction.effort_shift != 0.0:
        return None
    return correction if check.verdict == "fault" or correction.position_error is not None else None
