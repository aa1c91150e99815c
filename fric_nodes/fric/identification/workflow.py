"""A whole identification: what the recordings can tell, the fit, and how it does on recordings kept apart."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..instrument import inspect
from ..model import Model
from ..record import Record
from .choice import method_for, refuse_unused
from .equations import nominal_conditions
from .force_needed import require_force
from .foreseen import Foreseen
from .identifiability import foresee
from .misfit import validated
from .result import Identification, Method, Options
from .screen import screened

__all__ = ["Fitted", "identified", "silent"]

_OVER = 20  # numerical: samples over which a speed is taken, so that an encoder's step doesn't count as one
_NEARLY_ALL = 0.999  # statistical: share of the recording that is no faster, so that a single spike doesn't count
Progress = Callable[[str], None]


def silent(text: str) -> None:
    """Progress that nobody reads."""


class Fitted(NamedTuple):
    """A result, with what it was found from.

    Attributes:
        result: of the fit.
        train: the recordings as they were fitted.
        validation: the recordings kept apart, treated alike.
        options: settings of the fit.
    """

    result: Identification
    train: tuple[Record, ...]
    validation: tuple[Record, ...]
    options: Options


def identified(
    structure: Model,
    train: Sequence[Record],
    validation: Sequence[Record] = (),
    method: str | None = None,
    options: Options | None = None,
    progress: Progress = silent,
    experiments: bool = True,
    foresight: bool = True,
) -> Fitted:
    """Fit ``structure`` to recordings.

    Args:
        structure: model whose terms are fitted and whose values are the start.
        train: recordings of one joint, as they were read.
        validation: recordings kept apart from the fit; may be empty.
        method: id of the method; None for the usual one of the structure.
        options: settings of the fit; None lets the method choose.
        progress: told what is going on, a line at a time.
        experiments: look for excitations that would help, which takes a few seconds where something can't be determined.
        foresight: say before the fit what the recordings can tell.

    Raises:
        InputError: the recordings don't determine the model, or can't be used.
    """
    options = Options() if options is None else options
    chosen = method_for(method, structure)
    refuse_unused(chosen, options)
    # What a load or a temperature is relative to belongs to the model: a recording under another load has another mean.
    structure = replace(structure, nominal=nominal_conditions(train) | dict(structure.nominal))
    records, kept_apart = (
        [replace(screened(each), nominal=structure.nominal) for each in held] for held in (train, validation)
    )
    if chosen.needs_force:
        require_force(records, structure, options.held)
    progress("checking the recordings for faults of their instruments")
    checks = inspect(records)
    for finding in checks:
        if finding.verdict in ("warning", "fault"):
            progress(f"{finding.verdict}: {finding.detail}{'; ' + finding.remedy if finding.remedy else ''}")
    foreseen = _foreseen(structure, records, options, chosen, progress, experiments) if foresight else None
    progress(f"fitting {', '.join(structure.names)} by {chosen.id}")
    result = chosen.fit(structure, records, options)
    provenance = {
        "recordings": ", ".join(record.source for record in records),
        "method": chosen.id,
        "equations": str(result.train.n_samples),
        "largest speed": f"{_fastest(records):.4g} {structure.units.position}/s",
    }
    result = replace(result, foreseen=foreseen, checks=checks, model=replace(result.model, provenance=provenance))
    if kept_apart:
        result = validated(result, chosen, records, kept_apart, options)
    return Fitted(result, tuple(records), tuple(kept_apart), options)


def _fastest(records: Sequence[Record]) -> float:
    """Largest speed of the recordings, as the mean over some samples [x/s]."""
    found = 0.0
    for record in records:
        over = min(_OVER, record.n_samples - 1)
        if over > 0:
            way = record.position[over:] - record.position[:-over]
            speeds = np.abs(way) / (record.time[over:] - record.time[:-over])
            found = max(found, float(np.quantile(speeds, _NEARLY_ALL)))
    return found


def _foreseen(
    structure: Model, records: Sequence[Record], options: Options, method: Method, progress: Progress, experiments: bool
) -> Foreseen | None:
    """What the recordings can tell, said before the fit; None where the method sees something else, or nothing can be said."""
    if not method.predicts:
        return None
    progress("checking which parameters the recordings determine")
    try:
        found = foresee(structure, records, options, method.predicts, experiments)
    except InputError:
        return None  # the fit will say it
    for line in found.warnings:
        progress(f"before the fit: {line}")
    return found
