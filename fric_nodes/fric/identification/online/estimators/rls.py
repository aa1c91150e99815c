"""Recursive least squares on the filtered equations of motion; see :mod:`..recursive`."""

from __future__ import annotations

from ..kind import EstimatorKind
from ..recursive import OnlineIdentifier

__all__ = ["ESTIMATOR"]

ESTIMATOR = EstimatorKind(
    id="rls",
    title="recursive least squares in blocks",
    begin=lambda structure, options, hold: OnlineIdentifier(structure, options.forgetting_time, options),
    uses=("forgetting_time", "cutoff", "rest_velocity", "held"),
)
