"""The compiled loops of every model: motion from force, force from motion, and motion followed sample by sample.

They are written once, over the names of :mod:`fric.engine.assembled`, and compiled for each structure by
:mod:`fric.engine.compile`, which also hands in the work space of a step, the last arguments.
"""

from __future__ import annotations

from typing import Any

from ..effect import Context
from .assembled import (
    ACTUATED,
    ACTUATED_RATE,
    MEMORY,
    N_STATES,
    PUSHED,
    RIGID,
    SEEN,
    SEEN_RATE,
    Inner,
    Surroundings,
    command,
    drive,
    force,
    level_sum,
    prepare,
    pushed,
    remember,
    remembers,
    slip,
    step,
    unpacked,
)
from .kernel import kernel, local_array

__all__ = ["LOOPS", "advance", "fan", "lead", "observe", "predict", "pursue", "respond", "simulate"]


@kernel
def advance(p: Any, x: Any, x_next: Any, s: Inner, u: float, h: float, around: Surroundings) -> float:
    """One step of the plant and of what its terms remember; ``x`` and ``s.z`` are led on in place."""
    q, v = x[0], x[1]
    friction = step(p, x, x_next, s, u, h, around)
    for j in range(N_STATES):
        x[j] = x_next[j]
    if not RIGID:
        for j in range(s.z.shape[0]):
            s.z[j] = s.z_next[j]
    if MEMORY and remembers(p):
        w = (x[0] - q) / h
        change = x[1] - v
        bend = 1.0 if change > 0.0 else (-1.0 if change < 0.0 else 0.0)
        direction = -1.0 if w < 0.0 else 1.0
        remember(
            Context(
                0.5 * (q + x[0]), w, direction, around.time + 0.5 * h, around.load, around.temperature, bend, h, s.memory, u
            ),
            p,
        )
    return friction


def simulate(
    p: Any, u: Any, h: float, n_sub: int, t_0: float, load: Any, temperature: Any, states: Any, z: Any, memory: Any,
    x_out: Any, friction_out: Any, applied_out: Any, z_next: Any, constants: Any,
) -> None:  # fmt: skip
    """Lead ``states``, ``z`` and ``memory``, in place, over ``len(u)`` intervals of ``h`` [s] in ``n_sub`` steps each.

    ``u[k]`` is commanded over the whole interval k. ``x_out[k]`` is the mechanical state at the end of interval k,
    ``friction_out[k]`` the contact's mean friction force [F] over it and ``applied_out[k]`` the mean of what comes out of the
    command path. ``load`` and ``temperature`` hold one value, or one for each interval.
    """
    prepare(p, constants)
    p = unpacked(p)
    x, x_next = local_array(N_STATES), local_array(N_STATES)
    for j in range(N_STATES):
        x[j] = states[j]
    s = Inner(z, z_next, memory, constants)
    h_sub = h / n_sub
    each = 1.0 / n_sub
    for k in range(u.shape[0]):
        load_k = load[k] if load.shape[0] > 1 else load[0]
        temperature_k = temperature[k] if temperature.shape[0] > 1 else temperature[0]
        total = 0.0
        applied = 0.0
        for m in range(n_sub):
            around = Surroundings(t_0 + k * h + m * h_sub, load_k, temperature_k)
            given = command(u[k], h_sub, memory, p)
            applied += given
            total += advance(p, x, x_next, s, given, h_sub, around)
        for j in range(N_STATES):
            x_out[k, j] = x[j]
        friction_out[k] = total * each
        applied_out[k] = applied * each
    for j in range(N_STATES):
        states[j] = x[j]


def predict(
    p: Any, t: Any, q: Any, v: Any, a: Any, h: float, load: Any, temperature: Any, z: Any, memory: Any, u_out: Any,
    friction_out: Any, z_next: Any, constants: Any,
) -> None:  # fmt: skip
    """Force that has to come out of the command path for the motion ``q``, ``v``, ``a``, all of shape ``(n_samples,)``.

    Slip dynamics are led from half a step before each sample to half a step after it at the sample's velocity, so that the mean
    force over the step belongs to the sample itself and no half step of delay creeps in. ``z`` and ``memory`` are led on in
    place.
    """
    prepare(p, constants)
    p = unpacked(p)
    for k in range(q.shape[0]):
        load_k = load[k] if load.shape[0] > 1 else load[0]
        temperature_k = temperature[k] if temperature.shape[0] > 1 else temperature[0]
        direction = 1.0 if v[k] > 0.0 else (-1.0 if v[k] < 0.0 else 0.0)
        motion = drive(p, q[k], v[k], a[k])
        rest = push = without = 0.0
        # Forces are straight lines over the force that pushes, on either side of none: with none, with what is found then,
        # and where the line through both gives what pushed.
        for trial in range(3 if PUSHED and pushed(p) else 1):
            c = Context(q[k], v[k], direction, t[k], load_k, temperature_k, a[k], h, memory, push)
            rest = motion + force(c, p)
            friction = direction * level_sum(c, p) if RIGID else slip(z, z_next, v[k], h, level_sum(c, p), constants, p)
            if trial == 0:
                without = push = rest + friction
            elif trial == 1 and push != 0.0:
                push = without / max(1.0 - (rest + friction - without) / push, 0.05)
        if not RIGID:
            for j in range(z.shape[0]):
                z[j] = z_next[j]
        friction_out[k] = friction
        u_out[k] = rest + friction
        if MEMORY and remembers(p):
            remember(c, p)


def observe(
    p: Any, u: Any, y: Any, h: Any, n_sub: int, load: Any, temperature: Any,
    alpha: float, beta: float, noise: float, states: Any, z: Any, memory: Any, innovation: Any,
    z_next: Any, constants: Any,
) -> None:  # fmt: skip
    """Follow the measured positions ``y``: predict each from the state before it, then correct position and velocity.

    ``innovation[k]`` is ``y[k]`` minus its prediction [x], for ``len(u)`` intervals of lengths ``h`` [s]. The correction has
    the constant gains of an alpha-beta filter. A contact that sticks exactly is left at rest while the innovation stays within
    three times ``noise`` [x]: the noise of an encoder must not shake it loose. Where the sensor sees a motor, the load is
    carried along, unless it sticks: what was learnt about both together must not push the one into the other. Where it sees the
    load, the motor is carried along. A run that is part of a recording gives, after its ``states``, the time at which it begins
    [s].
    """
    prepare(p, constants)
    p = unpacked(p)
    x, x_next = local_array(N_STATES), local_array(N_STATES)
    for j in range(N_STATES):
        x[j] = states[j]
    s = Inner(z, z_next, memory, constants)
    t = states[N_STATES] if states.shape[0] > N_STATES else 0.0
    for k in range(u.shape[0]):
        h_sub = h[k] / n_sub
        load_k = load[k] if load.shape[0] > 1 else load[0]
        temperature_k = temperature[k] if temperature.shape[0] > 1 else temperature[0]
        for m in range(n_sub):
            around = Surroundings(t + m * h_sub, load_k, temperature_k)
            advance(p, x, x_next, s, command(u[k], h_sub, memory, p), h_sub, around)
        e = y[k] - x[SEEN]
        innovation[k] = e
        if SEEN != 0:
            x[0] += alpha * e
            if x[1] != 0.0:
                x[1] += beta * e / h[k]
        x[SEEN] += alpha * e
        if ACTUATED != SEEN:
            x[ACTUATED] += alpha * e
        if not (RIGID and x[SEEN_RATE] == 0.0 and abs(e) <= 3.0 * noise):
            x[SEEN_RATE] += beta * e / h[k]
            if ACTUATED != SEEN:
                x[ACTUATED_RATE] += beta * e / h[k]
        t += h[k]
    for j in range(N_STATES):
        states[j] = x[j]


def pursue(
    p: Any, u: Any, extra: Any, y: Any, h: Any, n_sub: int, load: Any, temperature: Any,
    alpha: float, beta: float, gain: float, noise: float, states: Any, z: Any, memory: Any, behind: Any,
    z_next: Any, constants: Any,
) -> None:  # fmt: skip
    """Make the model keep up with the measured positions ``y`` by impulses alone, as a force that it lacks would.

    ``behind[k]`` is how far the model is behind ``y[k]`` [x], for ``len(u)`` intervals of lengths ``h`` [s]. After each the
    velocity gets ``gain (beta e + alpha (e - e_before))/h``: with a ``gain`` of one, and were the model a mass alone, this is
    the alpha-beta filter of :func:`observe`, but the position is never set, so that every bit of the motion has been paid for
    by a force, whatever the model's own friction is. A contact that sticks exactly is the exception: where the body rests and
    is seen to rest it is put where it is seen, and left at rest while it is within three times ``noise`` [x] of it. Bristles
    are the other: an impulse would ring on them, and with a ``gain`` of one they get the alpha-beta filter itself. Where the
    sensor sees a motor, the load is carried along, unless it sticks; where it sees the load, the motor is. ``extra`` is a force
    that acts behind the command path besides, one value or ``(n,)`` [F]. A run that is part of a recording gives, after its
    ``states``, the time at which it begins [s].
    """
    prepare(p, constants)
    p = unpacked(p)
    x, x_next = local_array(N_STATES), local_array(N_STATES)
    for j in range(N_STATES):
        x[j] = states[j]
    s = Inner(z, z_next, memory, constants)
    t = states[N_STATES] if states.shape[0] > N_STATES else 0.0
    before = 0.0
    for k in range(u.shape[0]):
        h_sub = h[k] / n_sub
        load_k = load[k] if load.shape[0] > 1 else load[0]
        temperature_k = temperature[k] if temperature.shape[0] > 1 else temperature[0]
        besides = extra[k] if extra.shape[0] > 1 else extra[0]
        for m in range(n_sub):
            around = Surroundings(t + m * h_sub, load_k, temperature_k)
            advance(p, x, x_next, s, command(u[k], h_sub, memory, p) + besides, h_sub, around)
        e = y[k] - x[SEEN]
        behind[k] = e
        push = beta * e + alpha * (e - before) if RIGID else beta * e
        before = e
        if not RIGID:
            x[SEEN] += alpha * e
            if SEEN != 0:
                x[0] += alpha * e
            if ACTUATED != SEEN:
                x[ACTUATED] += alpha * e
        elif x[SEEN_RATE] == 0.0 and (k == 0 or abs(y[k] - y[k - 1]) <= 3.0 * noise):
            for j in range(0, N_STATES, 2):
                x[j] += alpha * e
            before = (1.0 - alpha) * e
            push = beta * e if abs(e) > 3.0 * noise else 0.0
        if SEEN != 0 and x[1] != 0.0:
            x[1] += gain * push / h[k]
        x[SEEN_RATE] += gain * push / h[k]
        if ACTUATED != SEEN:
            x[ACTUATED_RATE] += gain * push / h[k]
        t += h[k]
    for j in range(N_STATES):
        states[j] = x[j]


def lead(
    p: Any, u: Any, q: Any, v: Any, h: Any, n_sub: int, load: Any, temperature: Any, stiffness: float, damping: float,
    states: Any, z: Any, memory: Any, y_out: Any, extra_out: Any, z_next: Any, constants: Any,
) -> None:  # fmt: skip
    """Lead the model along a motion: a stiff spring and damper add to what ``u`` does what it takes to be at ``q`` with ``v``.

    They act on the body that the command moves, and what is behind a transmission follows. ``q[k]`` and ``v[k]`` are wanted at
    the beginning of interval k, of length ``h[k]`` [s]; ``y_out[k]`` is the sensor's position at its end and ``extra_out[k]``
    the force that spring and damper give over it, behind the command path, whose delay would make them swing. Together with
    ``u`` they are a recording of this model on that motion.
    """
    prepare(p, constants)
    p = unpacked(p)
    x, x_next = local_array(N_STATES), local_array(N_STATES)
    for j in range(N_STATES):
        x[j] = states[j]
    s = Inner(z, z_next, memory, constants)
    t = states[N_STATES] if states.shape[0] > N_STATES else 0.0
    for k in range(u.shape[0]):
        h_sub = h[k] / n_sub
        load_k = load[k] if load.shape[0] > 1 else load[0]
        temperature_k = temperature[k] if temperature.shape[0] > 1 else temperature[0]
        extra = stiffness * (q[k] - x[ACTUATED]) + damping * (v[k] - x[ACTUATED_RATE])
        for m in range(n_sub):
            around = Surroundings(t + m * h_sub, load_k, temperature_k)
            advance(p, x, x_next, s, command(u[k], h_sub, memory, p) + extra, h_sub, around)
        y_out[k] = x[SEEN]
        extra_out[k] = extra
        t += h[k]
    for j in range(N_STATES):
        states[j] = x[j]


def respond(p: Any, u: Any, h: float, n_sub: int, memory: Any, applied_out: Any) -> None:
    """What comes out of the command path, its mean over each interval, ``(len(u),)``, when ``u[k]`` is commanded over it."""
    p = unpacked(p)
    for k in range(u.shape[0]):
        applied = 0.0
        for _ in range(n_sub):
            applied += command(u[k], h / n_sub, memory, p)
        applied_out[k] = applied / n_sub


def fan(
    p: Any, u: Any, h: float, n_sub: int, around: Any, states: Any, slips: Any, memories: Any,
    friction_out: Any, z_next: Any, constants: Any,
) -> None:  # fmt: skip
    """Lead many copies of the plant over one interval of ``h`` [s], each from its own state, with its own values and force.

    ``p`` is ``(n, n_parameters)``, ``u`` ``(n,)``; ``states``, ``slips`` and ``memories`` have one row for each copy and are
    led on in place. ``around`` holds time [s], relative load and temperature difference at the start; ``friction_out`` ``(n,)``
    the contact's mean friction force [F].
    """
    x, x_next = local_array(N_STATES), local_array(N_STATES)
    h_sub = h / n_sub
    for i in range(u.shape[0]):
        prepare(p[i], constants)
        values = unpacked(p[i])
        s = Inner(slips[i], z_next, memories[i], constants)
        for j in range(N_STATES):
            x[j] = states[i, j]
        total = 0.0
        for m in range(n_sub):
            moment = Surroundings(around[0] + m * h_sub, around[1], around[2])
            total += advance(values, x, x_next, s, command(u[i], h_sub, memories[i], values), h_sub, moment)
        for j in range(N_STATES):
            states[i, j] = x[j]
        friction_out[i] = total / n_sub


LOOPS = (simulate, predict, observe, pursue, lead, respond, fan)
"""The loops, in the order of :class:`fric.engine.compile.Loops`."""
