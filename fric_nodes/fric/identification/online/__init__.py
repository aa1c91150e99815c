"""Online identification, one sample after the other: recursive least squares, and Kalman filters on the friction state."""

from __future__ import annotations

from ...model import Model
from ...registry import discover
from .estimate import Estimate, Estimator, State
from .kalman import KalmanIdentifier
from .kind import EstimatorKind, OnlineOptions
from .recursive import OnlineIdentifier

__all__ = [
    "ESTIMATORS",
    "Estimate",
    "Estimator",
    "EstimatorKind",
    "KalmanIdentifier",
    "OnlineIdentifier",
    "OnlineOptions",
    "State",
    "make_estimator",
]

ESTIMATORS: dict[str, EstimatorKind] = {
    kind.id: kind for kind in discover(f"{__name__}.estimators", "ESTIMATOR", EstimatorKind)
}
"""Every online estimator by its id."""


def make_estimator(kind: str, structure: Model, options: OnlineOptions | None = None, hold: str = "preceding") -> Estimator:
    """The estimator of that name.

    Args:
        kind: one of :data:`ESTIMATORS`.
        structure: the terms to estimate; its values are the start.
        options: its settings, of the type that the estimator declares; None: the defaults.
        hold: how a sample's force relates to the intervals beside it, for those that take it as it was sent.

    Raises:
        ValueError: there is no such estimator.
    """
    if kind not in ESTIMATORS:
        raise ValueError(f"estimator '{kind}', must be one of {', '.join(ESTIMATORS)}")
    found = ESTIMATORS[kind]
    return found.begin(structure, found.settings() if options is None else options, hold)
