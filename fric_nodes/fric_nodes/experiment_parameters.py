"""An experiment as ROS parameters, and the conductor that they describe."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path

from fric.experiment.choice import Bounds
from fric.experiment.conductor import Conductor
from fric.experiment.motion import ExperimentError
from fric.experiment.settings import KINDS, NUMBERS, bounds_of, timing_of
from fric.record import Units

from .parameters import NodeParameter, Settings

__all__ = ["EXPERIMENT", "bounds_in", "conductor_in", "folder_in"]

_SPRINGS = {"auto": None, "yes": True, "no": False}
EXPERIMENT = (
    NodeParameter("out", "experiment", "folder for bags, model.yaml and report.html; must not exist"),
    NodeParameter("controller", "", "node of a PID whose gains to set (such as pid); empty: give the force itself"),
    NodeParameter("kind", "auto", "free oscillations, forced runs, or auto: what friction allows", choices=tuple(KINDS)),
    NodeParameter("spring", "auto", "whether the axis has a spring of its own; auto: found out", choices=tuple(_SPRINGS)),
    NodeParameter("position_unit", "m", "unit of positions", choices=("m", "rad")),
    NodeParameter("force_unit", "N", "unit of efforts"),
    NodeParameter(
        "effort_hold", "preceding", "when an effort in a joint state acts", choices=("following", "preceding", "linear")
    ),
    NodeParameter("more_terms", ["presliding"], "effects fitted besides in the end, where they explain the runs better"),
    NodeParameter("fewest_runs", 4, "runs made in any case", "", 1, 1000),
    NodeParameter("most_runs", 12, "runs made at most", "", 1, 1000),
    NodeParameter("periods", 12, "periods of a forced run that count", "", 4, 10_000),
    NodeParameter("filter_time", 0.001, "time constant of the velocity's filter in the feedback", "s", 0.0, 10.0),
    *(NodeParameter(n.name, n.default, n.doc, n.unit, n.lower, n.upper) for n in NUMBERS),
)  # fmt: skip


def folder_in(settings: Settings) -> Path:
    """The folder of the results, which must not exist.

    Raises:
        ExperimentError: it does.
    """
    out = Path(settings.text("out"))
    if out.exists():
        raise ExperimentError(out, "exists already", "name another folder (parameter 'out')")
    return out


def bounds_in(settings: Settings, period: float) -> Bounds:
    """The limits within which the experiment chooses; ``period`` [s] is that of the samples.

    Raises:
        InputError: they can't be used.
    """
    numbers = {n.name: settings.number(n.name) for n in NUMBERS}
    bounds = bounds_of(numbers, period, settings.integer("fewest_runs"), settings.integer("most_runs"))
    if settings.text("controller") and bounds.proportional[0] <= 0.0:
        raise ExperimentError("parameter 'proportional_low'", "is 0", "a controller needs a gain to lead the axis by")
    return bounds


def conductor_in(
    settings: Settings,
    bounds: Bounds,
    submit: Callable[[Callable[[], object]], Future[object]],
    say: Callable[[str], None],
) -> Conductor:
    """The conductor of the experiment that ``settings`` describe; ``submit`` has work done elsewhere, ``say`` takes messages.

    Raises:
        InputError: a value can't be used.
    """
    numbers = {n.name: settings.number(n.name) for n in NUMBERS}
    return Conductor(
        bounds,
        timing_of(numbers, settings.integer("periods")),
        KINDS[settings.text("kind")],
        submit,
        say,
        joint=settings.text("joint"),
        units=Units(settings.text("position_unit"), settings.text("force_unit")),
        effort_hold=settings.text("effort_hold"),
        spring=_SPRINGS[settings.text("spring")],
        one_gain=bool(settings.text("controller")),
        more=settings.texts("more_terms"),
    )
