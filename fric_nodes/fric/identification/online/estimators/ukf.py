"""Unscented Kalman filter on the friction state; see :mod:`..kalman`."""

from __future__ import annotations

from ..kalman import KalmanIdentifier
from ..kind import EstimatorKind

__all__ = ["ESTIMATOR"]

ESTIMATOR = EstimatorKind(
    id="ukf",
    title="unscented Kalman filter, sample by sample, with slip dynamics and nonlinear parameters",
    begin=lambda structure, options, hold: KalmanIdentifier(structure, options.forgetting_time, options, "ukf", hold),
    uses=("forgetting_time", "cutoff", "rest_velocity", "held", "freed"),
)
