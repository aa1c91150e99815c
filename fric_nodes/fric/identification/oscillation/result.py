"""What every method for free oscillations gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...record import Array, Mask
from .motion import NATURAL, Natural

__all__ = ["Curves", "FreeOscillation", "status_of"]

_MANY = 8
_UNSURE = 0.2


@dataclass(frozen=True, eq=False)
class Curves:
    """What depends on the amplitude; all of shape ``(n,)``.

    Attributes:
        time: [s].
        amplitude: [x].
        frequency: instantaneous [rad/s]; over the amplitude it is the backbone.
        damping: equivalent ratio, all losses taken as viscous: -A'/(A omega) [1].
        centre: about which it swings [x].
    """

    time: Array
    amplitude: Array
    frequency: Array
    damping: Array
    centre: Array


@dataclass(frozen=True, eq=False)
class FreeOscillation:
    """Natural parameters of a free oscillation.

    Attributes:
        natural: the parameters.
        covariance: shape ``(5, 5)``, in the order of :data:`.motion.NATURAL`; zero rows for parameters that were not asked for.
        first: time [s] and position [x] of the first reversal.
        direction: of the motion after it, 1 or -1.
        half_cycles: complete half cycles behind the estimate.
        misfit: root mean square of what the model leaves of the data, over what noise explains; near 1 when it fits.
        curves: over the amplitude.
        status: what was reached, and what to do next.
        warnings: what a user should know before trusting the values.
        plain: the estimate by the method's textbook formulas alone, without the correction of its bias.
    """

    natural: Natural
    covariance: Array
    first: tuple[float, float]
    direction: int
    half_cycles: int
    misfit: float
    curves: Curves
    status: str
    warnings: tuple[str, ...] = ()
    plain: Natural | None = None

    @property
    def standard_errors(self) -> Natural:
        """Standard errors of the natural parameters, by the same names."""
        return Natural.of(np.sqrt(np.maximum(np.diag(self.covariance), 0.0)))


def status_of(natural: Natural, covariance: Array, asked: Mask, half_cycles: int, misfit: float) -> tuple[str, tuple[str, ...]]:
    """The sentence that says what to do next, and the warnings behind it; ``asked`` marks the fitted parameters, ``(5,)``."""
    error = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    values = natural.values
    # A difference is as good as its mean is: half a per cent of the mean is a good figure even when it is all there is.
    size = np.array([values[0], values[1], max(abs(values[1]), abs(values[2])), values[3], max(abs(values[3]), abs(values[4]))])
    unsure = [NATURAL[k] for k in range(5) if asked[k] and error[k] > _UNSURE * max(abs(size[k]), 1e-300)]
    warnings = []
    if misfit > 2.0:
        warnings.append(
            f"the half cycles leave {misfit:.2g} times what noise explains: friction or stiffness depend on amplitude or"
            " velocity"
        )
    if unsure:
        warnings += [
            f"{name} is hardly determined: {values[k]:.3g} +- {error[k]:.2g}"
            for k, name in enumerate(NATURAL)
            if name in unsure
        ]
        return (
            f"converged; not to be relied on: {', '.join(unsure)}. Release it from a larger deflection, or record several"
            " releases",
            tuple(warnings),
        )
    if misfit > 2.0:
        return (
            "converged, but the residual is larger than noise: look at the curves over the amplitude, and identify the larger"
            " and the smaller amplitudes apart",
            tuple(warnings),
        )
    if half_cycles < _MANY:
        return (
            f"converged on only {half_cycles} half cycles: release it from a larger deflection for smaller standard errors",
            tuple(warnings),
        )
    return "converged; check it on a release from another deflection (--validate)", tuple(warnings)
