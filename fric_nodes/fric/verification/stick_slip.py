"""Sticking is exact, and a stick-slip run has the slip times of its closed form, whatever the step.

A body of mass m is pulled over a rough plane through a spring k whose other end moves at the constant speed V. It sticks until
the spring pulls with the static force F_S, then slides against the Coulomb force F_C. With e the spring's extension,
D = (F_S - F_C)/k and w = sqrt(k/m), sliding is e = F_C/k + D cos(wt) + (V/w) sin(wt) from break-away on; the body stops when
de/dt = V again, after (2 pi - 2 atan(D w/V))/w, with e = F_C/k - D; then it rests for 2 D/V. With a Stribeck curve between
both forces there is no closed form; there an integration from event to event gives the slip times.

In the model the spring is the effect ``stiffness``, which pulls towards the frame, and the ramp k V t is the actuator's force.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from ..figure import Figure
from ..model import Model, Term, build_model, term
from ..record import Array
from ..report.figures import Curve, stacked
from ..simulation import Simulator
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_MASS, _SPRING, _SPEED = 1.0, 1000.0, 1e-3
_COULOMB, _STATIC, _STRIBECK = 4.0, 6.0, 0.01
_SLIPS = 10
_DURATION = 48.0  # [s], long enough for them
_STEP = 1e-3  # [s]


def _surplus(law: str) -> Term:
    surplus = _STATIC - _COULOMB
    if law == "static":
        return term("stribeck", "static", force=surplus)
    return term("stribeck", "exponential", force=surplus, velocity=_STRIBECK)


def _model(law: str) -> Model:
    return build_model(
        "rigid", {"mass": _MASS}, [term("coulomb", force=_COULOMB), _surplus(law), term("stiffness", stiffness=_SPRING)]
    )


def _simulated(law: str, step: float) -> tuple[Array, Array, Array]:
    """Times at which slips begin and end, each with its slip in a row, (n_slips, 2), and states and friction at the samples."""
    n = round(_DURATION / step)
    effort = _SPRING * _SPEED * step * (np.arange(n, dtype=np.float64) + 0.5)
    states, friction = Simulator(_model(law)).run(effort, step, 1)
    moving = np.r_[False, states[:, 1] != 0.0]
    begins = np.flatnonzero(~moving[:-1] & moving[1:])[:_SLIPS]
    ends = np.flatnonzero(moving[:-1] & ~moving[1:])[:_SLIPS] + 1
    return step * np.stack([begins, ends], axis=1), states, friction


def _slip_closed() -> tuple[float, float]:
    """Duration of a slip and the spring's force at its end, with static and Coulomb friction."""
    w = float(np.sqrt(_SPRING / _MASS))
    d = (_STATIC - _COULOMB) / _SPRING
    return float((2 * np.pi - 2 * np.arctan(d * w / _SPEED)) / w), _COULOMB - _SPRING * d


def _slip_integrated() -> tuple[float, float]:
    """The same with the Stribeck curve, integrated until the body stops."""

    def right_side(t: float, y: Array) -> list[float]:
        extension, v = y
        friction = _COULOMB + (_STATIC - _COULOMB) * np.exp(-((v / _STRIBECK) ** 2))
        return [_SPEED - v, (_SPRING * extension - friction) / _MASS]

    def stops(t: float, y: Array) -> float:
        return float(y[1]) if t > 1e-2 else 1.0

    stops.terminal = True  # type: ignore[attr-defined]
    stops.direction = -1.0  # type: ignore[attr-defined]
    answer = solve_ivp(
        right_side, (0.0, 10.0), [_STATIC / _SPRING, 0.0], method="DOP853", rtol=1e-12, atol=1e-15, events=stops, max_step=1e-3
    )
    return float(answer.t[-1]), _SPRING * float(answer.y[0, -1])


def _expected(slip: Callable[[], tuple[float, float]]) -> Array:
    """Times at which slips begin and end, (n_slips, 2)."""
    duration, left = slip()
    first = _STATIC / (_SPRING * _SPEED)
    rest = (_STATIC - left) / (_SPRING * _SPEED)
    begins = first + (duration + rest) * np.arange(_SLIPS)
    return np.stack([begins, begins + duration], axis=1)


def _rest() -> list[Figure]:
    """A body on a slope below break-away, for a million steps."""
    figures = []
    for law in ("static", "exponential"):
        slope = term("bias", force=0.999999 * _STATIC)
        model = build_model("rigid", {"mass": _MASS}, [term("coulomb", force=_COULOMB), _surplus(law), slope])
        simulator = Simulator(model, 0.1234567891)
        states, _ = simulator.run(np.zeros(1_000_000), _STEP, 1)
        moved = float(np.max(np.abs(states[:, 0] - 0.1234567891)))
        figures.append(Figure(f"way on a slope just below break-away in 1e6 steps ({law} surplus)", moved, "m", "== 0"))
    return figures


def _run() -> Evidence:
    figures = _rest()
    panels = []
    for law, slip in (("static", _slip_closed), ("exponential", _slip_integrated)):
        expected = _expected(slip)
        period = float(expected[1, 0] - expected[0, 0])
        whole, states, _ = _simulated(law, _STEP)
        half, _, _ = _simulated(law, 0.5 * _STEP)
        figures += [
            Figure(f"{law}: slips in the run", whole.shape[0], "", f">= {_SLIPS}"),
            Figure(f"{law}: slip times, relative change with half the step", _relative(whole, half), "1", "<= 1e-3"),
            Figure(f"{law}: times from slip to slip, relative change", _between(whole, half, period), "1", "<= 1e-3"),
            Figure(f"{law}: slip times at 1 kHz off the reference, relative", _relative(whole, expected), "1", "<= 1e-3"),
            Figure(f"{law}: times from slip to slip off the reference", _between(whole, expected, period), "1", "<= 1e-3"),
        ]
        t = _STEP * np.arange(1, states.shape[0] + 1)
        panels.append((f"{law} [mm]", [Curve(f"position, {law}", t, 1e3 * states[:, 0], "after")]))
    plots = [
        (
            stacked(panels, "time [s]", 200),
            "Stick-slip of a body pulled by a spring at 1 mm/s: with static friction, and with a Stribeck curve.",
        )
    ]
    notes = [
        "A slip begins and ends with the sampling interval in which the body breaks loose and comes to rest:"
        " its times at 1 kHz and 2 kHz can't agree better than to these intervals.",
        "Relative change: of a time since the start, divided by that time; of the time from one slip to the next,"
        " divided by the period.",
    ]
    return Evidence(figures, plots, notes)


def _relative(times: Array, others: Array) -> float:
    return float(np.max(np.abs(times / others - 1.0)))


def _between(times: Array, others: Array, period: float) -> float:
    return float(np.max(np.abs(np.diff(times - others, axis=0)))) / period


VERIFICATION = Verification(
    id="stick-slip",
    title="Sticking and stick-slip",
    source="closed form of the spring-pulled body, derived in the module; integration from event to event",
    run=_run,
)
