"""An experiment's settings as one declaration, from which a node, a test and a command make the same experiment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from .choice import Bounds
from .conductor import AUTO
from .motion import ExperimentError, Limits
from .runs import FORCED, FREE, Timing

__all__ = ["KINDS", "NUMBERS", "Number", "bounds_of", "timing_of"]

KINDS: Mapping[str, str] = {"auto": AUTO, "free": FREE, "forced": FORCED}
"""Kinds of experiment by their short names."""


class Number(NamedTuple):
    """A number to be set: name, default, documentation, unit and range."""

    name: str
    default: float
    doc: str
    unit: str
    lower: float
    upper: float


_X, _F, _K, _C = "m or rad", "N or N m", "N/m or N m/rad", "N s/m or N m s/rad"
NUMBERS = (
    Number("force_limit", 10.0, "largest command", _F, 1e-12, 1e12),
    Number("travel", 0.1, "largest distance from where the experiment begins; beyond it the force is cut", _X, 1e-12, 1e6),
    Number("deflection", 0.03, "largest deflection to let go from, and amplitude of forced runs", _X, 1e-12, 1e6),
    Number("proportional_low", 0.0, "smallest gain P; 0 lets an axis with a spring of its own swing freely", _K, 0.0, 1e12),
    Number("proportional_high", 1e4, "largest gain P", _K, 1e-12, 1e12),
    Number("proportional_first", 0.0, "gain P of the first run; 0: the smallest", _K, 0.0, 1e12),
    Number("derivative_low", 0.0, "smallest gain D; below 0 it may take viscous friction away", _C, -1e12, 0.0),
    Number("frequency_low", 3.0, "of forced runs", "rad/s", 1e-6, 1e6),
    Number("frequency_high", 30.0, "of forced runs", "rad/s", 1e-6, 1e6),
    Number("growth", 1.15, "swing relative to the release, or to the one before, from which on it is unstable", "", 1.01, 10.0),
    Number("wanted_error", 0.005, "relative standard error of inertia, damping and stiffness at which it ends", "", 1e-6, 1.0),
    Number("place_time", 1.0, "time in which the axis is led to its deflection", "s", 1e-3, 1e4),
    Number("settle_time", 5.0, "most that it gets to come to rest there", "s", 0.0, 1e4),
    Number("quiet_time", 0.5, "stillness that counts as rest", "s", 1e-3, 1e4),
    Number("oscillation_time", 10.0, "most that it gets to oscillate", "s", 1e-3, 1e5),
)


def bounds_of(values: Mapping[str, float], sample_time: float, fewest: int, most: int) -> Bounds:
    """Bounds from values of :data:`NUMBERS`.

    Raises:
        ExperimentError: they leave nothing between them.
    """
    for low, high in (("proportional_low", "proportional_high"), ("frequency_low", "frequency_high"), ("deflection", "travel")):
        if values[low] >= values[high]:
            raise ExperimentError(
                f"parameter '{low}'", f"is {values[low]:g}, {high} is {values[high]:g}", f"keep it below {high}"
            )
    if fewest > most:
        raise ExperimentError("parameter 'fewest_runs'", f"is {fewest}, most_runs is {most}", "keep it at most as large")
    return Bounds(
        Limits(values["force_limit"], values["travel"], values["growth"]),
        values["deflection"],
        (values["proportional_low"], values["proportional_high"]),
        values["derivative_low"],
        (values["frequency_low"], values["frequency_high"]),
        sample_time,
        first=values["proportional_first"],
        wanted=values["wanted_error"],
        fewest=fewest,
        most=most,
    )


def timing_of(values: Mapping[str, float], periods: int) -> Timing:
    """Timing from values of :data:`NUMBERS`."""
    return Timing(values["place_time"], values["settle_time"], values["quiet_time"], values["oscillation_time"], periods)
