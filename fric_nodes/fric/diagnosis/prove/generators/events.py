"""The generator ``events``: every mode of the axis a smooth equation, solved to 1e-8, from one event to the next.

Events are all that isn't smooth: a body that sticks, breaks away or turns; a motor that meets the load or parts from it; a
sample of the controller, a delayed command that arrives; a sample of the recording; the edge of a disturbance; a load that
joins. Between them a Runge-Kutta pair with error control leads the states (:mod:`.events_steps`). No step size stands for
the physics: sticking is exact, an impact has no duration, and the instants of both are known to 1e-13 s. Corners without a
jump (a limited command, a dead zone, a chain that begins to pull) are no events; the error control takes them in short steps.

The steps are compiled: a recording of 30 s, with some hundred thousand samples of a controller, each an end of smoothness,
would take minutes with ``scipy.integrate.solve_ivp``, against which a test holds it.

The recorded force is the command's mean from its sample to the next: what a drive writes that averages its current. So a
recording holds what was applied, however fast the controller is.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ....errors import InputError
from ....record import Array
from ..course import Course, Run, Unreachable
from ..physics import Physics
from .controllers import CONTINUOUS, Controller
from .events_physics import HONOURED, N_STATES, compiled, encoder, first_state, numbers
from .events_steps import CHATTERS, advance
from .generator import Generator

__all__ = ["EVENTS"]

_SAME = 1e-11  # [s]: instants that are one
_SMALL = 1e-9  # of the usual size of a state: the absolute part of its error


def lead(physics: Physics, controller: Controller, course: Course, resolution: float, sample_time: float) -> Run:
    """What happens to ``physics`` under ``controller`` on ``course``; see :class:`.generator.Generator`.

    Raises:
        InputError: the axis has numbers that this generator doesn't honour, or a delay behind an analogue loop.
        Unreachable: its events have no end.
    """
    EVENTS.check(physics)
    analogue = controller.kind == CONTINUOUS
    if analogue and physics.delay > 0.0:
        raise InputError("generator 'events'", "an analogue loop has no line that delays its command", "take a sampled one")
    n = course.reference.shape[0]
    out = np.zeros((5, n))
    gains = np.array(
        [controller.stiffness, controller.damping, controller.integral, controller.smoothing, controller.largest, resolution]
    )
    period = math.inf if analogue else 1.0 / controller.rate
    waiting = np.zeros((2, 2 if analogue else int(physics.delay * controller.rate) + 4))
    edges = np.unique(np.concatenate([course.windows.ravel(), [physics.payload_time, math.inf]]))
    status = _lead(
        numbers(physics), gains, period, analogue, waiting, edges,
        _absolute(physics, controller, course), sample_time,
        course.reference, course.feedforward, course.load, course.warmer, course.windows, course.noise, out,
    )  # fmt: skip
    if status == CHATTERS:
        raise Unreachable("events without end")
    return Run(*out)


def _absolute(physics: Physics, controller: Controller, course: Course) -> Array:
    """The absolute part of the allowed error of each state, in its unit."""
    way = max(float(np.ptp(course.reference)), 1e-6)
    force = min(controller.largest, 1e6) / 20.0 if math.isfinite(controller.largest) else 1.0
    level = max(physics.coulomb + physics.stribeck, 1e-6)
    # In the order of the states; those of body and motor first.
    usual = [way, way, way, way, force, 1.0, level, 1.0, physics.displacement, 1.0, way, way, force]
    return _SMALL * np.array(usual)


@compiled
def _sampled(gains: Any, memory: Any, measured: float, wanted: float, rate: float, ahead: float, period: float) -> float:
    """Command of a sampled controller; its memory: position before, speed, integral, whether that has begun."""
    stiffness, damping, integral, smoothing, largest, _ = gains
    if memory[3] == 0.0:
        memory[0], memory[3] = measured, 1.0
    memory[1] += period / (smoothing + period) * ((measured - memory[0]) / period - memory[1])
    memory[0] = measured
    off = stiffness / damping * (wanted - measured) + rate - memory[1] if damping > 0.0 else 0.0
    u = ahead + damping * (off + integral * memory[2])
    if abs(u) < largest or u * off < 0.0:
        memory[2] += period * off
    return float(min(max(u, -largest), largest))


@compiled
def _disturbed(windows: Any, t: float) -> float:
    for j in range(windows.shape[0]):
        if windows[j, 0] <= t + _SAME and t + _SAME < windows[j, 1]:
            return 1.0
    return 0.0


@compiled
def _lead(
    p: Any, gains: Any, period: float, analogue: bool, waiting: Any, edges: Any, absolute: Any, sample_time: float,
    reference: Any, feedforward: Any, load: Any, warmer: Any, windows: Any, noise: Any, out: Any,
) -> float:  # fmt: skip
    n, lines, largest, resolution = reference.shape[0], waiting.shape[1], gains[4], gains[5]
    x, mode, now, memory = np.zeros(N_STATES), np.zeros(3), np.zeros(13), np.zeros(4)
    work, turned = np.zeros((9, N_STATES)), np.zeros(1)
    first_state(p, x, mode, reference[0])
    if analogue:
        now[9], now[10] = gains[0], gains[1]
    now[11] = largest
    k, tick, edge, first, last = 0, 0, 0, 0, 0
    t, h = 0.0, 1e-5
    while True:
        if t >= k * sample_time - _SAME:
            if k > 0:
                out[0, k - 1], out[4, k - 1] = x[12] / sample_time, turned[0] / sample_time
                x[12] = turned[0] = 0.0
            if k == n:
                return 0.0
            seen, rate = encoder(p, x)
            measured = seen + noise[k]
            if resolution > 0.0:
                measured = resolution * math.floor(measured / resolution + 0.5)
            out[1, k], out[2, k], out[3, k] = measured, seen, rate
            now[1], now[2] = load[k], warmer[k]
            now[5], now[7], now[8] = reference[k], k * sample_time, feedforward[k]
            now[6] = (reference[k + 1] - reference[k]) / sample_time if k + 1 < n else 0.0
            k += 1
        if t >= tick * period - _SAME and not analogue:
            seen, _ = encoder(p, x)
            measured = seen + noise[k - 1]
            if resolution > 0.0:
                measured = resolution * math.floor(measured / resolution + 0.5)
            wanted = now[5] + now[6] * (t - now[7])
            u = _sampled(gains, memory, measured, wanted, now[6], now[8], period)
            waiting[0, last % lines], waiting[1, last % lines] = t + p.delay, u
            now[12] = u
            last += 1
            tick += 1
        while first < last and waiting[0, first % lines] <= t + _SAME:
            now[0] = waiting[1, first % lines]
            first += 1
        while edges[edge] <= t + _SAME:
            edge += 1
        now[3] = _disturbed(windows, t)
        now[4] = p.payload if p.payload_time > 0.0 and t >= p.payload_time - _SAME else 0.0
        end = min(k * sample_time, edges[edge])
        if not analogue:
            end = min(end, tick * period)
        if first < last:
            end = min(end, waiting[0, first % lines])
        h = advance(p, x, mode, now, t, end, h, work, absolute, turned)
        if h == CHATTERS:
            return h
        t = end


EVENTS = Generator("events", HONOURED, lead, without=frozenset({"accel_hysteresis"}), apart=(("gap", "shaft"),))
"""Led from event to event."""
