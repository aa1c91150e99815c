"""A quantity that follows another with one time constant, exact over a step in which the other is constant.

Equation: tau dy/dt = u - y. Over a step of length h, with r = h / tau, y(h) = u + (y(0) - u) exp(-r), and the mean of y
over the step is u + (y(0) - u) (1 - exp(-r)) / r. Neither has a limit on the step.
"""

from __future__ import annotations

import math

from ..engine.kernel import kernel

__all__ = ["mean_decay"]


@kernel
def mean_decay(r: float) -> float:
    """The mean of exp(-s) over s from 0 to ``r`` >= 0: (1 - exp(-r)) / r, without loss of digits for small ``r``."""
    return -math.expm1(-r) / r if r > 0.0 else 1.0
