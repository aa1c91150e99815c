"""A simulated motion beside scipy's ``solve_ivp`` at the same accuracy: with exact stick, and with the stiff bristles of LuGre.

The force is a smooth function of time. ``solve_ivp`` takes it as it is; fric takes its value in the middle of each interval.
Both are compared with ``solve_ivp`` at tolerances far below. Before anything is timed, every method of a list goes through a
ladder of tolerances; the fastest run that is no less accurate than fric's is the one that stands beside it. Where none
is, the most accurate one stands there, and the errors say so.

Exact stick is written with events: the motion ends where the velocity passes 0, and the next one begins where the force leaves
the level of friction. LuGre (Canudas de Wit et al. 1995) is its three equations.
"""

from __future__ import annotations

import functools
import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from ...figure import Figure
from ...model import Model, Term, build_model, term
from ...record import Array
from ...simulation import simulate
from ..peer import Pair, Peer

__all__ = ["PEER", "model", "push", "with_bristles", "with_events"]

_STEP, _N = 1e-3, 2001  # [s], samples
_MASS, _COULOMB, _SURPLUS, _STRIBECK, _VISCOUS = 1.2, 4.0, 2.0, 0.01, 10.0
_STIFFNESS, _DAMPING = 1e5, 100.0
_LADDER = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)  # relative tolerances; the absolute one is a thousandth of it [m, m/s]
_FINE = 1e-11
_TURNS = 9

_Run = Callable[[str, float], Array]


def push(t: float) -> float:
    """Force [N]: motion both ways, reversals, and rests."""
    return 9.0 * math.sin(6.0 * math.pi * t) + 3.0 * math.sin(14.6 * math.pi * t)


def _level(v: float) -> float:
    return _COULOMB + _SURPLUS * math.exp(-((v / _STRIBECK) ** 2))


def with_events(method: str, tolerance: float) -> Array:
    """Positions [m] at the samples, shape ``(n,)``; slides and rests one after the other."""
    at, end = _STEP * np.arange(_N), _STEP * (_N - 1)
    position = np.zeros(_N)
    begun, x = 0.0, 0.0
    # Rest ends in the first interval in which the force leaves the level: from these values, and then to the root.
    beyond = np.array([abs(push(t)) - _level(0.0) for t in at.tolist()])
    while begun < end:
        if abs(push(begun)) <= _level(0.0) + 1e-9:  # numerical: the root below is known to that
            later = np.flatnonzero((at > begun) & (beyond > 0.0))
            stop = int(later[0]) if later.size else _N
            position[(at >= begun) & (np.arange(_N) < stop)] = x
            if stop == _N:
                break
            low = max(begun, float(at[stop - 1]))
            begun = float(brentq(lambda t: abs(push(t)) - _level(0.0) - 1e-8, low, float(at[stop]), xtol=1e-12))
        sign = math.copysign(1.0, push(begun))

        def rate(t: float, y: Any, sign: float = sign) -> tuple[float, float]:
            v = float(y[1])
            return v, (push(t) - sign * _level(v) - _VISCOUS * v) / _MASS

        def halt(_: float, y: Any) -> float:
            return float(y[1])

        halt.terminal, halt.direction = True, -sign  # type: ignore[attr-defined]
        inside = at[at >= begun]
        answer = solve_ivp(
            rate, (begun, end), (x, 0.0), method=method, t_eval=inside, events=halt, rtol=tolerance, atol=1e-3 * tolerance
        )
        first = _N - inside.shape[0]
        position[first : first + answer.t.shape[0]] = answer.y[0]
        if answer.status != 1:
            break
        begun, x = float(answer.t_events[0][0]), float(answer.y_events[0][0][0])
    return position


def with_bristles(method: str, tolerance: float) -> Array:
    """Positions [m] at the samples, shape ``(n,)``."""

    def rate(t: float, y: Any) -> tuple[float, float, float]:
        v, z = float(y[1]), float(y[2])
        deflecting = v - _STIFFNESS * abs(v) / _level(v) * z
        friction = _STIFFNESS * z + _DAMPING * deflecting + _VISCOUS * v
        return v, (push(t) - friction) / _MASS, deflecting

    at = _STEP * np.arange(_N)
    atol = tolerance * np.array([1e-3, 1e-3, 1e-5])  # a deflection [m] is smaller than a motion
    answer = solve_ivp(rate, (0.0, at[-1]), (0.0, 0.0, 0.0), method=method, t_eval=at, rtol=tolerance, atol=atol)
    return np.asarray(answer.y[0])


def model(*more: Term) -> Model:
    """The axis in fric, with ``more`` terms."""
    surplus = term("stribeck", "exponential", force=_SURPLUS, velocity=_STRIBECK)
    return build_model(
        "rigid", {"mass": _MASS}, [term("coulomb", force=_COULOMB), surplus, *more, term("viscous", coefficient=_VISCOUS)]
    )


def _timed(run: Callable[[], object]) -> float:
    begun = time.perf_counter()
    run()
    return time.perf_counter() - begun


def _pair(name: str, model: Model, other: _Run, methods: Sequence[str], fine: str) -> Pair:
    effort = np.array([push((k + 0.5) * _STEP) for k in range(_N)])
    truth = other(fine, _FINE)

    def error(position: Array) -> float:
        return float(np.sqrt(np.mean((position - truth) ** 2)) / np.ptp(truth))

    mine = error(simulate(model, effort, _STEP, fused=True).position)
    tried = []
    for method in methods:
        for tolerance in _LADDER:
            off = error(other(method, tolerance))
            spent = _timed(lambda m=method, tol=tolerance: other(m, tol))  # type: ignore[misc]
            tried.append((off, spent, method, tolerance))
            if off <= mine:
                break
    good = [each for each in tried if each[0] <= mine]
    off, _, method, tolerance = min(good, key=lambda each: each[1]) if good else min(tried)

    def beside() -> list[Figure]:
        return [
            Figure("error of fric, RMS of the range", mine, "1"),
            Figure(f"error of the other ({method}, rtol {tolerance:g})", off, "1"),
        ]

    return Pair(
        f"simulation of {_STEP * (_N - 1):g} s against solve_ivp, {name}",
        lambda: _timed(lambda: simulate(model, effort, _STEP, fused=True)),
        functools.partial(_timed, functools.partial(other, method, tolerance)),
        turns=_TURNS,
        even=True,
        beside=beside,
    )


def prepare(_: Path) -> Sequence[Pair]:
    """Exact stick with events, and LuGre as a stiff equation."""
    bristles = term("presliding", "lugre", stiffness=_STIFFNESS, damping=_DAMPING)
    return (
        _pair("exact stick by events", model(), with_events, ("RK45", "LSODA"), "DOP853"),
        _pair("LuGre, stiff", model(bristles), with_bristles, ("LSODA", "BDF", "Radau"), "LSODA"),
    )


PEER = Peer("solve_ivp", prepare)
