"""What compensation does when its model is wrong: friction 30 % too large, delay, a coarser encoder, a change of friction.

The axis has the size of EMPS and pre-sliding after LuGre. Controllers are tuned from the wrong model, for the timing and
encoder that they run with; after two moves the axis is to rest.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go

from ..axis import Measurement, SimulatedAxis
from ..control.autotune import Required, Timing, autotune, plants_around
from ..control.controller import Controller, Setpoint
from ..control.feedbacks import CONTROLLERS
from ..control.feedbacks.adaptive import Adaptive
from ..control.feedforward import Feedforward
from ..control.feedforward_kind import Force
from ..control.loop import margins
from ..control.trial import Reference, follow, point_to_point, sine
from ..figure import Figure
from ..model import Model, build_model, term
from ..record import Array
from ..report.figures import Curve, stacked
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_TIMING = Timing(1e-3, 2e-3, 1e-6, 200.0)  # two samples of delay, ten times the step of the axis's own encoder
_TOO_LARGE = 1.3
_CYCLE = 3.0  # physical: encoder steps
_KINDS = ("pid", "nonlinear_pid", "cascade", "reset_integral", "disturbance_observer", "friction_observer", "adaptive")


def _axis(factor: float = 1.0, bias: float = 0.0) -> Model:
    return build_model(
        "rigid",
        {"mass": 95.0},
        [
            term("coulomb", force=20.0 * factor),
            term("stribeck", force=3.0 * factor, velocity=4e-3),
            term("presliding", "lugre", stiffness=1.5e6, damping=500.0),
            term("viscous", coefficient=205.0),
            term("bias", force=bias),
        ],
    )


def _ahead(model: Model) -> Force:
    made = Feedforward(_TIMING.period, preview=0.5 * _TIMING.period + _TIMING.delay, transition_time=0.0)
    made.set_model(model, at_once=True)
    return made


_LAST = 1500  # samples, 1.5 of the 4 s of rest


def _rested_at(kind: Controller, gains: Mapping[str, float], force: Force | None) -> Array:
    """Position less its mean in the last part of a rest, in steps of the encoder, shape ``(_LAST,)``."""
    reference = point_to_point(_TIMING.period, [0.0, 0.02, 0.005], 0.4, 4.0)
    axis = SimulatedAxis(_axis(), resolution=_TIMING.resolution, force_limit=_TIMING.force_limit)
    course = follow(axis, kind.build(gains, _TIMING.force_limit), reference, force, round(_TIMING.delay / _TIMING.period))
    last = course.position[-_LAST:]
    return np.asarray((last - np.mean(last)) / _TIMING.resolution)


def _resting(kind: Controller, gains: Mapping[str, float], force: Force | None) -> float:
    """Range of that, in steps of the encoder."""
    return float(np.ptp(_rested_at(kind, gains, force)))


def _over_compensated() -> list[Figure]:
    wrong = _axis(_TOO_LARGE)
    figures = []
    for name in _KINDS:
        kind = CONTROLLERS[name]
        gains = autotune(wrong, kind, _TIMING, draws=30).gains
        # What compensates by itself gets no second compensation.
        force = None if name in ("friction_observer", "adaptive") else _ahead(wrong)
        figures.append(Figure(f"friction 30 % too large, {name}: motion at rest", _resting(kind, gains, force), "steps",
                              f"<= {_CYCLE:g}"))  # fmt: skip
        if name == "friction_observer":
            stiff = {**gains, "reference_share": 0.0, "stiffness": 1e8, "bristle_damping": 0.0}
            title = "the same on the measured velocity, without bristles to speak of: it cycles"
            figures.append(Figure(title, _resting(kind, stiff, None), "steps", ">= 10"))
    return figures


def _unexpected() -> list[Figure]:
    """The same on a loop that autotuning was told nothing of: two samples of delay and an encoder ten times as coarse."""
    wrong, told = _axis(_TOO_LARGE), Timing(_TIMING.period, 0.0, 0.1 * _TIMING.resolution, _TIMING.force_limit)
    figures = []
    for name in _KINDS:
        kind = CONTROLLERS[name]
        gains = autotune(wrong, kind, told, draws=30).gains
        force = None if name in ("friction_observer", "adaptive") else _ahead(wrong)
        figures.append(Figure(f"the same, delay and encoder not known to autotuning, {name}", _resting(kind, gains, force),
                              "steps", f"<= {_CYCLE:g}"))  # fmt: skip
    return figures


def _kept() -> list[Figure]:
    """Margins of what autotuning gives, on a hundred plants that it hasn't drawn."""
    required, figures = Required(), []
    for name in _KINDS:
        kind = CONTROLLERS[name]
        tunable = kind.tunable
        assert tunable is not None
        gains = autotune(_axis(), kind, _TIMING, draws=100, calm=False).gains
        forms = tunable.linear(gains, _TIMING.period)
        found = [[margins(plant, form) for form in forms] for plant in plants_around(_axis(), _TIMING, 100, seed=99)]
        stable = sum(all(each.stable for each in one) for one in found)
        kept = sum(all(required.kept(each, _TIMING.period) for each in one) for one in found)
        figures += [
            Figure(f"100 plants within 20 %, {name}: stable", float(stable), "", ">= 100"),
            Figure(f"100 plants within 20 %, {name}: margins kept", float(kept), "", ">= 95"),
        ]
    return figures


def _to_and_fro(duration: float) -> Reference:
    """A sine of 20 mm at 0.5 Hz that begins and ends at rest at 0."""
    period = _TIMING.period
    into = sine(period, 0.02, 0.5, duration, fade=1.0)
    away = np.clip((duration - into.time) / 1.0, 0.0, 1.0)
    position = into.position * away**3 * (10.0 - 15.0 * away + 6.0 * away * away)
    velocity = np.gradient(position, period)
    return Reference(period, position, velocity, np.gradient(velocity, period))


class _Changing:
    """An axis whose friction changes once, in motion.

    Args:
        before: its model until ``samples`` have gone by.
        after: and from then on.
    """

    def __init__(self, before: Model, after: Model, samples: int) -> None:
        self._axis = SimulatedAxis(before, resolution=_TIMING.resolution, force_limit=_TIMING.force_limit)
        self._after, self._left = after, samples

    @property
    def position(self) -> float:
        return self._axis.position

    def measure(self) -> Measurement:
        return self._axis.measure()

    def advance(self, force: float, duration: float) -> None:
        if self._left == 0:
            self._axis.become(self._after)
        self._left -= 1
        self._axis.advance(force, duration)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _learnt(title: str, before: Model, after: Model) -> list[Figure]:
    """Error from 10 s of motion after a change of friction on, over that before it; and the command meanwhile.

    Twenty seconds of motion come first, then the change, then fourteen seconds; the last four of both are compared. The
    motion goes on without a pause, so that nothing but friction changes.
    """
    kind = CONTROLLERS["adaptive"]
    limit, period = _TIMING.force_limit, _TIMING.period
    delay, change, part = round(_TIMING.delay / period), round(20.0 / period), round(4.0 / period)
    gains = autotune(before, kind, _TIMING, draws=30).gains
    reference = sine(period, 0.02, 0.5, 34.0)
    course = follow(_Changing(before, after, change), kind.build(gains, limit), reference, delay=delay)
    known = {"coulomb": after.value("coulomb.force"), "bias": after.value("bias.force")}
    ideal = follow(_Changing(after, after, 0), kind.build({**gains, **known}, limit), reference, delay=delay)
    former, now = _rms(course.error[change - part : change]), _rms(course.error[-part:])
    later = slice(change + round(0.1 / period), None)  # the plant's own jump comes first
    bump = float(np.max(np.abs(course.force[later])) - np.max(np.abs(ideal.force[later]))) / limit
    return [
        Figure(f"{title}: error before", former / _TIMING.resolution, "steps"),
        Figure(f"{title}: error 10 s later over that before", now / former, "1", "<= 1.2"),
        Figure(f"{title}: the same over that of a friction known from the start", now / _rms(ideal.error[-part:]), "1"),
        Figure(f"{title}: largest command over the limit", float(np.max(np.abs(course.force))) / limit, "1", "<= 1"),
        Figure(f"{title}: that above a friction's known from the start, over the limit", max(bump, 0.0), "1", "<= 0.05"),
    ]


def _rested() -> list[Figure]:
    """Thirty minutes of rest at 1 kHz, of which the law gets an encoder that flickers by a step."""
    kind = CONTROLLERS["adaptive"]
    law = kind.build(autotune(_axis(), kind, _TIMING, draws=30).gains, _TIMING.force_limit)
    axis = SimulatedAxis(_axis(), resolution=_TIMING.resolution, force_limit=_TIMING.force_limit)
    follow(axis, law, _to_and_fro(10.0), delay=2)
    assert isinstance(law, Adaptive)
    # The last motion is a second ago before anything counts as rest.
    follow(axis, law, point_to_point(_TIMING.period, [axis.position] * 2, 1.0), delay=2)
    held, learnt = law.theta.copy(), law.learnt
    random = np.random.default_rng(1)
    here = Setpoint(axis.position)
    for flicker in (random.uniform(size=1_800_000) < 0.1).tolist():
        law.answer(here, axis.position + _TIMING.resolution * flicker, _TIMING.period)
    return [
        Figure("30 min of rest: samples learnt from", float(law.learnt - learnt), "1", "<= 0"),
        Figure("30 min of rest: change of the Coulomb force", float(abs(law.theta[0] - held[0]) / held[0]), "1", "<= 0"),
    ]


def _picture() -> tuple[go.Figure, str]:
    """The axis at rest with the friction observer's defaults, and on the measured velocity."""
    kind = CONTROLLERS["friction_observer"]
    gains = autotune(_axis(_TOO_LARGE), kind, _TIMING, draws=30).gains
    stiff = {**gains, "reference_share": 0.0, "stiffness": 1e8, "bristle_damping": 0.0}
    t = _TIMING.period * np.arange(_LAST, dtype=np.float64)
    plot = stacked(
        [
            (
                "position [steps]",
                [
                    Curve("on the measured velocity", t, _rested_at(kind, stiff, None), "before"),
                    Curve("defaults", t, _rested_at(kind, gains, None), "after"),
                ],
            )
        ],
        "time [s]",
    )
    return plot, (
        "At rest with a friction 30 % too large, two samples of delay and a coarse encoder. Compensation on the measured "
        "velocity cycles; on the velocity of the reference, as by default, the axis stands."
    )


def _run() -> Evidence:
    figures = [*_kept(), *_over_compensated(), *_unexpected()]
    figures += _learnt("friction doubled", _axis(), _axis(2.0))
    figures += _learnt("friction halved", _axis(), _axis(0.5))
    figures += _learnt("more friction in one direction, then in the other", _axis(bias=8.0), _axis(bias=-8.0))
    figures += _rested()
    notes = [
        "A loop is held to be at rest when its true position moves by no more than three steps of its encoder.",
        "The friction that is learnt scales the identified curve, with its Stribeck part and its bristles, and is foretold by "
        "the delay; what is left at a reversal is below the encoder's step, before a change of friction and after it.",
    ]
    return Evidence(figures, [_picture()], notes)


VERIFICATION = Verification(
    id="compensation-robust",
    title="Compensation with a wrong model, and friction that changes",
    source="Astrom and Wittenmark 1995, section 11.5; Canudas de Wit et al. 1995, section V",
    run=_run,
)
