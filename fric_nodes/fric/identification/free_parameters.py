"""Which parameters a fit may move, between which bounds, and from which start values it tries.

Start values are chosen by dimension from what the recording holds (a velocity between the slowest and the fastest motion,
a stiffness from friction level and travel), never by the name of an effect, so that a new effect needs nothing here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..model import Model, NamedParameter
from ..record import Array, Index, Mask
from .equations import Equations
from .result import Options

__all__ = ["FreeParameters", "candidates"]


@dataclass(frozen=True, eq=False)
class FreeParameters:
    """The free part of a model's parameter vector.

    Attributes:
        index: positions in ``model.values``, shape ``(n_free,)``.
        linear: True where the force is linear in the parameter, shape ``(n_free,)``.
        lower: bounds, shape ``(n_free,)``.
        upper: bounds, shape ``(n_free,)``.
        names: their names.
    """

    index: Index
    linear: Mask
    lower: Array
    upper: Array
    names: tuple[str, ...]

    @classmethod
    def of(cls, model: Model, options: Options) -> FreeParameters:
        """All parameters of ``model`` but those held by the options and shape parameters that were not freed.

        A parameter of the plant that is given as 0 (no spring, no damper) is held as well, unless it is freed.

        Raises:
            InputError: an option names a parameter that the model doesn't have, or bounds that leave nothing between them.
        """
        for name in (*options.held, *options.freed, *(bound[0] for bound in options.bounds)):
            if name not in model.names:
                raise InputError("--hold/--free/--bound", f"no parameter '{name}'", f"choose from {', '.join(model.names)}")
        free = [
            (number, parameter)
            for number, parameter in enumerate(model.parameters())
            if parameter.name not in options.held
            and (parameter.name in options.freed or not (parameter.declaration.shape or _absent(parameter)))
        ]
        declared = [parameter.declaration for _, parameter in free]
        tiny = np.finfo(np.float64).tiny
        lower = np.array([max(d.lower, tiny) if d.positive else d.lower for d in declared])
        upper = np.array([d.upper for d in declared])
        names = tuple(parameter.name for _, parameter in free)
        for name, low, high in options.bounds:
            if name in names:
                k = names.index(name)
                lower[k], upper[k] = max(lower[k], low), min(upper[k], high)
                if not lower[k] < upper[k]:
                    allowed = f"[{declared[k].lower:g}, {declared[k].upper:g}]"
                    problem = f"{low:g} to {high:g} leaves nothing of what {name} may be, {allowed}"
                    raise InputError("--bound", problem, "give the lower bound first, and bounds that overlap with it")
        index = np.array([number for number, _ in free], dtype=np.int64)
        return cls(index, np.array([d.linear for d in declared], dtype=np.bool_), lower, upper, names)

    def without(self, names: set[str]) -> FreeParameters:
        """The rest when ``names`` are held as well."""
        keep = np.array([name not in names for name in self.names], dtype=np.bool_)
        return FreeParameters(
            self.index[keep],
            self.linear[keep],
            self.lower[keep],
            self.upper[keep],
            tuple(name for name in self.names if name not in names),
        )

    def within_reach(self, model: Model, equations: Equations) -> FreeParameters:
        """The same with nonlinear parameters kept within ten times the range of their candidates.

        Beyond that a recording can't tell one value from another (a Stribeck velocity far above every speed), and a solver that
        wanders there doesn't come back.
        """
        declared = list(model.parameters())
        level = float(np.median(np.abs(equations.force)))
        lower, upper = self.lower.copy(), self.upper.copy()
        for k in np.flatnonzero(~self.linear):
            tried = candidates(declared[int(self.index[k])].declaration.dimension, equations, level)
            value = declared[int(self.index[k])].value
            if tried.size:
                low = max(lower[k], min(0.1 * float(tried[0]), value))
                high = min(upper[k], max(10.0 * float(tried[-1]), value))
                if low < high:  # bounds that someone gave may lie beyond all reach, and then they are meant
                    lower[k], upper[k] = low, high
        return FreeParameters(self.index, self.linear, lower, upper, self.names)

    def at_bound(self, model: Model) -> Mask:
        """True for each free parameter whose value lies on a bound, shape ``(n_free,)``."""
        values = model.values[self.index]
        # The solver stops a hair inside; a value of that size is the bound for every purpose.
        near = 1e-9 + 1e-6 * np.abs(values)
        return np.asarray((values - self.lower <= near) | (self.upper - values <= near), dtype=np.bool_)

    def only(self, linear: bool) -> FreeParameters:
        """The linear ones, or the others."""
        return self.without({name for name, is_linear in zip(self.names, self.linear, strict=True) if is_linear != linear})


def _absent(parameter: NamedParameter) -> bool:
    """True for what a plant is said to be without."""
    return parameter.value == 0.0 and "." not in parameter.name


def candidates(dimension: str, equations: Equations, level: float) -> Array:
    """Start values worth trying for a nonlinear parameter of this dimension, ascending.

    Args:
        dimension: as in :class:`fric.parameter.Parameter`.
        equations: the recording.
        level: typical friction level [F].
    """
    fastest = float(np.max(np.abs(equations.velocity)))
    travel = max(float(np.ptp(stretch.position)) for stretch in equations.stretches)
    distance = np.geomspace(1e-5, 0.1, 13) * travel
    if dimension == "x/s":
        return np.geomspace(max(0.3 * equations.rest_velocity, 1e-3 * fastest), 0.5 * fastest, 12)
    if dimension == "F/x":
        return np.sort(level / distance)
    if dimension == "x":
        return distance
    if dimension == "s":
        return np.geomspace(equations.stretches[0].sample_time, 10.0, 9)
    return np.empty(0)
