"""Online identification, one sample after the other: recursive least squares, and Kalman filters on the friction state."""

from __future__ import annotations

from ...model import Model
from ..result import Options
from .estimate import Estimate, Estimator, State
from .kalman import KalmanIdentifier
from .recursive import OnlineIdentifier

__all__ = ["ESTIMATORS", "Estimate", "Estimator", "KalmanIdentifier", "OnlineIdentifier", "State", "make_estimator"]

ESTIMATORS = ("rls", "ekf", "ukf")
"""Names of the estimators."""


def make_estimator(
    kind: str, structure: Model, forgetting_time: float = 60.0, options: Options | None = None, hold: str = "preceding"
) -> Estimator:
    """The estimator of that name.

    Args:
        kind: one of :data:`ESTIMATORS`.
        structure: the terms to estimate; its values are the start.
        forgetting_time: how long information counts, in time of informative motion [s].
        options: which parameters are held or freed; for ``rls`` the filter settings too.
        hold: how a sample's force relates to the intervals beside it, for those that take it as it was sent.

    Raises:
        ValueError: there is no such estimator.
    """
    if kind not in ESTIMATORS:
        raise ValueError(f"estimator '{kind}', must be one of {', '.join(ESTIMATORS)}")
    if kind == "rls":
        return OnlineIdentifier(structure, forgetting_time, options)
    return KalmanIdentifier(structure, forgetting_time, options, kind, hold)
