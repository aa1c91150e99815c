"""The fit of ``fric bench fitting`` as it is written with scipy alone: solve_ivp for the motion, curve_fit for the parameters.

The same axis, the same six parameters, the same data and the same start values, as one writes it at first, and with what
makes it bearable: sticking takes Karnopp's zone (below a small velocity, and under less than the level of friction, nothing
accelerates), without which the solver's steps collapse at every reversal; the largest step is the time between samples, since
the force jumps there; and the step of the derivatives lies well above the noise that step control leaves in the motion.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import curve_fit

from ..record import Array, Record

__all__ = ["ByScipy", "fit_by_scipy"]

_ZONE = 1e-5  # [m/s] of Karnopp's sticking
_RELATIVE, _ABSOLUTE = 1e-6, 1e-9
_STEP = 1e-3  # relative, of derivatives


@dataclass(frozen=True, eq=False)
class ByScipy:
    """What the fit took and found.

    Attributes:
        values: of the parameters, in the order of the start.
        spent: in all [s].
        n_evaluations: free runs over the record.
        rmse: root mean square error of the position [m].
    """

    values: Array
    spent: float
    n_evaluations: int
    rmse: float


def fit_by_scipy(record: Record, start: Array, stribeck_velocity: float) -> ByScipy:
    """Fit mass, Coulomb, Stribeck surplus, asymmetry, viscous and bias, in this order, to a free run over ``record``.

    Args:
        record: evenly sampled from 0, its force held until the next sample.
        start: shape ``(6,)``.
        stribeck_velocity: [m/s], held.
    """
    effort, h, last = record.effort.tolist(), record.sample_time, record.n_samples - 1
    n_evaluations = 0

    def rate(
        t: float, x: Any, mass: float, coulomb: float, surplus: float, asymmetry: float, viscous: float, bias: float
    ) -> tuple[float, float]:
        v = float(x[1])
        push = effort[min(int(t / h), last)] - viscous * v - asymmetry * abs(v) - bias
        level = coulomb + surplus * math.exp(-((v / stribeck_velocity) ** 2))
        if abs(v) < _ZONE:
            if abs(push) <= level:
                return v, 0.0
            return v, (push - math.copysign(level, push)) / mass
        return v, (push - math.copysign(level, v)) / mass

    def motion(at: Array, *parameters: float) -> Array:
        nonlocal n_evaluations
        n_evaluations += 1
        begin = (float(record.position[0]), 0.0)
        answer = solve_ivp(
            rate,
            (0.0, float(at[-1])),
            begin,
            method="RK45",
            t_eval=at,
            max_step=h,
            args=parameters,
            rtol=_RELATIVE,
            atol=_ABSOLUTE,
        )
        return np.asarray(answer.y[0], dtype=np.float64)

    begun = time.perf_counter()
    values, _ = curve_fit(motion, record.time, record.position, p0=start, ftol=1e-6, xtol=1e-6, epsfcn=_STEP**2)
    spent = time.perf_counter() - begun
    off = motion(record.time, *values) - record.position
    return ByScipy(np.asarray(values), spent, n_evaluations - 1, float(np.sqrt(np.mean(off**2))))
