"""How every fit ends: standard errors into the model, warnings and status, the score on what was fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..model import Model
from ..record import Array, Record
from .equations import Equations
from .free_parameters import FreeParameters
from .misfit import misfit, refuse_undetermined
from .result import Identification, Method, Options
from .scoring import score
from .verdict import warnings_of

__all__ = ["Fitted", "concluded", "standard_errors"]


@dataclass(frozen=True, eq=False)
class Fitted:
    """What a method has found.

    Attributes:
        model: with the values found.
        free: the parameters that were fitted.
        covariance: of their estimates, shape ``(n_free, n_free)``.
        found: the equations of the recordings.
        messages: what had to be said before the fit.
        timing: part of the covariance that comes from not knowing when the force acts, or None.
    """

    model: Model
    free: FreeParameters
    covariance: Array
    found: Equations
    messages: Sequence[str]
    timing: Array | None = None


def standard_errors(free: FreeParameters, covariance: Array) -> dict[str, float]:
    """Standard error by name, of those parameters that have one."""
    variance = np.diag(covariance)
    return {name: float(np.sqrt(value)) for name, value in zip(free.names, variance, strict=True) if value >= 0}


def concluded(method: Method, fitted: Fitted, records: Sequence[Record], options: Options, trouble: str = "") -> Identification:
    """The result of ``method``; ``trouble`` replaces the status when the fit didn't end well.

    Raises:
        IdentificationError: the fit has found nothing (:func:`fric.identification.misfit.refuse_undetermined`).
    """
    model = fitted.model.with_values(fitted.model.values, standard_errors(fitted.free, fitted.covariance))
    warnings, status = warnings_of(model, fitted.free, fitted.covariance)
    # Structures are compared by equations that are the same for all of them.
    train = score(model, records, options, None if model.has_slip_dynamics else fitted.found)
    source = ", ".join(record.source for record in records)
    if not trouble:
        refuse_undetermined(model, fitted.free, fitted.covariance, fitted.found, train, source, method.predicts == "force")
    wrong = misfit(model, fitted.found, train)
    return Identification(
        model=model,
        fitted=fitted.free.names,
        covariance=fitted.covariance,
        method=method.id,
        status=trouble or wrong or status,
        warnings=(*fitted.messages, *warnings, *([wrong] if wrong and trouble else [])),
        notes=fitted.found.notes,
        train=train,
    )
