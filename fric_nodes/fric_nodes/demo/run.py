"""The demonstration from start to end: excite and record, identify, compensate, measure the gain, make the page.

Only the recording is handed to the identification. The true axis is read by the plant's process, and at the end for the page.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from fric.control.feedbacks.pid import PidGains
from fric.control.tuning import LoopMargins, tune
from fric.errors import InputError
from fric.files import write_text
from fric.identification import METHODS
from fric.identification.result import Identification, Options
from fric.identification.scoring import score
from fric.identification.screen import screened
from fric.model_file import read_model, write_model
from fric.shared_files import config_file

from ..domain import graph_domain
from .graph import Graph, NodeSetup
from .outcome import Run, read_run
from .picture import write_picture
from .report import DemoOutcome, demo_report

__all__ = ["DemoSettings", "run_demo"]

_FILTER_TIME = 5e-4  # [s] of the PID's derivative
_MOTIONS = {"excitation": 44.5, "demo_motion": 21.5}  # parameter file of the motion: time of the axis until it has ended [s]
# Who takes joint_states, so that the recorder doesn't miss the beginning: PID, recorder, and in lock-step the excitation.
_LISTENERS = {"lock-step": 3, "wall": 2}
_START_TIME = 5.0  # [s] that a node may take to start
# In wall time a command acts a quarter of a millisecond after the measurement that it answers, twice that on a busy machine.
_DELAY_PERIODS = {"lock-step": 0.0, "wall": 0.25}


@dataclass(frozen=True)
class DemoSettings:
    """What to run.

    Attributes:
        out: folder for bags, model and page.
        clock: ``lock-step`` or ``wall``.
        rate: samples per second.
        seed: of motion and noise.
    """

    out: Path
    clock: str = "lock-step"
    rate: float = 500.0
    seed: int = 1


def identify(bag: Path) -> Identification:
    """The model found in ``bag``, from nothing but the recording."""
    from fric.bagio.read import read_record

    record = screened(read_record(bag, repair=True))
    return METHODS["prediction-error"].fit(read_model(config_file("start_model.yaml")), [record], Options())


def _duration(settings: DemoSettings, motion: str) -> float:
    """Time of the axis that covers the motion [s]; in wall time it begins a while after the axis has."""
    return _MOTIONS[motion] + (_START_TIME if settings.clock == "wall" else 0.0)


def _nodes(settings: DemoSettings, gains: PidGains, motion: str, model: Path | None, bag: Path) -> list[NodeSetup]:
    """The five nodes of one run, in the order in which they are started."""
    loop: dict[str, object] = {"period": 1.0 / settings.rate, "lock_step": settings.clock == "lock-step"}
    compensator = loop | {"enabled": model is not None} | ({} if model is None else {"model_file": model})
    pid = loop | {
        "kp": gains.proportional,
        "ki": gains.integral,
        "kd": gains.derivative,
        "filter_time": gains.filter_time,
    }
    plant = loop | {
        "seed": settings.seed,
        "duration": _duration(settings, motion),
        "wait_for_subscribers": _LISTENERS[settings.clock],
    }
    recorder = {"bag": bag, "log_time": "stamp" if settings.clock == "lock-step" else "receive"}
    excitation = loop | {"seed": settings.seed, "wait_for_subscribers": 3}
    return [
        NodeSetup("recorder", recorder),
        NodeSetup("compensator", compensator, config_file("compensator.yaml")),
        NodeSetup("pid", pid, config_file("pid.yaml")),
        NodeSetup("plant", plant, config_file("plant.yaml")),
        NodeSetup("excitation", excitation, config_file(f"{motion}.yaml")),
    ]


def _run(
    settings: DemoSettings, gains: PidGains, motion: str, model: Path | None, name: str, tell: Callable[[str], None]
) -> tuple[Run, float | None]:
    """One recorded run of the graph, and the lock-step rate that the plant reports."""
    bag = settings.out / "bags" / name
    *others, excitation = _nodes(settings, gains, motion, model, bag)
    with graph_domain() as domain, Graph(others, settings.out / "logs" / name, domain) as graph:
        if settings.clock == "wall":
            # The motion must not begin before there is an axis to follow it.
            graph.wait_for_text("plant", "started", timeout=60.0)
        graph.start(excitation)
        graph.wait_for("plant", timeout=60.0 + 10.0 * _MOTIONS[motion])
        graph.stop()
        words, recorded = graph.text_of("plant"), graph.text_of("recorder")
    lost = re.search(r"([1-9]\d*) lost", recorded)
    if lost is not None:
        tell(f"the recorder lost {lost.group(1)} messages of this run: the machine is too busy for its rate")
    found = re.search(r"(\d+(?:\.\d+)?) samples/s", words)
    return read_run(bag, 1.0 / settings.rate), float(found.group(1)) if found else None


def _described(gains: PidGains, margins: LoopMargins) -> tuple[dict[str, str], dict[str, str]]:
    return (
        {
            "proportional gain": f"{gains.proportional:.4g} N/m",
            "integral gain": f"{gains.integral:.4g} N/(m s)",
            "derivative gain": f"{gains.derivative:.4g} N s/m",
            "derivative filter": f"{1e3 * gains.filter_time:.2g} ms",
        },
        {
            "gain margin": f"{margins.gain_margin:.2f}",
            "phase margin": f"{margins.phase_margin:.1f}°",
            "largest sensitivity": f"{margins.sensitivity:.2f}",
            "crossover": f"{margins.crossover:.1f} Hz",
        },
    )


def run_demo(settings: DemoSettings, tell: Callable[[str], None]) -> DemoOutcome:
    """Run everything and write the page to ``out/report.html``; ``tell`` is given a line per step.

    Raises:
        InputError: a setting can't be used, the folder holds a demo already, or a node failed.
    """
    if settings.clock not in _DELAY_PERIODS:
        raise InputError("--clock", f"'{settings.clock}' is not known", f"use one of {', '.join(_DELAY_PERIODS)}")
    if (settings.out / "bags").exists():
        raise InputError(settings.out, "holds the bags of an earlier run", "choose another --out, or remove it first")
    truth = read_model(config_file("demo_axis.yaml"))
    period = 1.0 / settings.rate
    damping = truth.value("viscous.coefficient")
    delay = _DELAY_PERIODS[settings.clock] * period
    gains, margins = tune(truth.value("mass"), damping, period, delay=delay, filter_time=_FILTER_TIME)
    tell("exciting the axis under the PID alone, and recording it")
    excitation, _ = _run(settings, gains, "excitation", None, "excitation", tell)
    tell(f"identifying its friction from {excitation.bag}, by prediction error")
    result = identify(excitation.bag)
    model = settings.out / "model.yaml"
    write_model(result.model, model)
    tell("following a contour with the PID alone")
    before, _ = _run(settings, gains, "demo_motion", None, "contour", tell)
    tell("following the same contour with the identified model fed forward")
    after, rate = _run(settings, gains, "demo_motion", model, "contour_compensated", tell)
    result = replace(result, validation=score(result.model, [before.record], Options()))
    described, margins_described = _described(gains, margins)
    outcome = DemoOutcome(
        clock=settings.clock,
        period=period,
        truth=truth,
        result=result,
        excitation=excitation,
        before=before,
        after=after,
        margins=margins_described,
        gains=described,
        commands=_commands(settings, gains, model),
        rate=rate if settings.clock == "lock-step" else None,
    )
    write_picture(outcome, settings.out / "picture.png")
    write_text(settings.out / "report.html", demo_report(outcome))
    return outcome


def _commands(settings: DemoSettings, gains: PidGains, model: Path) -> list[str]:
    """The run with the model as commands for five terminals."""
    lines = []
    for node in _nodes(settings, gains, "demo_motion", model, settings.out / "bags" / "by_hand"):
        rest = " ".join(node.command()[3:])
        lines.append(f"fric node {node.name} {rest}")
    recording, start, out = settings.out / "bags" / "excitation", config_file("start_model.yaml"), settings.out / "identified"
    lines.append(f"fric identify {recording} --model {start} --method prediction-error --out {out}")
    return lines
