"""The compiled part of :mod:`fric.friction.asperity`: the life of an asperity, and a population over time.

An asperity has four states, each in a block of its own of the array: the place of its tip, its extension (base minus tip), its
clock and the number of the event that it lives through. In odd events it is in contact with a wave and its tip lies in [0, w]
from the wave's left end; in even ones it moves freely between two waves, at [0, alpha w] from the end of the left one. Waves
are numbered by the same count: their lengths come from a hash of seed, asperity and number, so that a step is a pure function
of the states and may be repeated at will. A solver may hand in states interpolated between two trials of a step: the number is
rounded and the extension kept within what the contact can hold.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..engine.kernel import kernel, loop
from .asperity_growth import aged, fresh, growth_rate, impulse, strength

__all__ = ["advance", "heights", "run", "run_under_load", "start", "uniform"]

# SplitMix64 (Steele, Lea, Flood 2014): increments of the three counters, multipliers of the finalizer.
_SEED, _ASPERITY, _EVENT = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xD1B54A32D192ED03), np.uint64(0xAEF17502108EF2D9)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_UNIT = 2.0**-53

_MOST_CONTACTS = 64  # of one asperity in one step; beyond, their mean stands for the rest


@kernel
def uniform(seed: int, asperity: int, event: int) -> float:
    """A random number in (0, 1), the same for the same three counters."""
    x = np.uint64(seed) * _SEED + np.uint64(asperity) * _ASPERITY + np.uint64(event) * _EVENT
    x = (x ^ (x >> _S30)) * _FIRST
    x = (x ^ (x >> _S27)) * _SECOND
    x = x ^ (x >> _S31)
    return (np.int64(x >> _S11) + 0.5) * _UNIT


@kernel
def wave(seed: int, asperity: int, event: int) -> float:
    """Length of the wave of this event, or of the last wave before it, over the mean length."""
    number = (event - 1) | 1
    u = uniform(seed, asperity, number)
    # The wave that is found at a random place is a long one rather than a short one: its density is that of w times w.
    return 2.0 * math.sqrt(u) if number == 1 else 2.0 * u


@loop
def heights(out: Any, j: int, n: int, seed: int) -> None:
    """Heights of ``n`` asperities, uniform from zero on, over their own mean, to ``out[j:j+n]``."""
    total = 0.0
    for a in range(n):
        out[j + a] = uniform(seed, a, 0)
        total += out[j + a]
    for a in range(n):
        out[j + a] *= n / total


@loop
def start(z: Any, n: int, seed: int, law: int, gap: float, mean_wave: float) -> None:
    """Relaxed states, shape ``(4 n,)``, at a random place of the topography, contacts fresh."""
    for a in range(n):
        touches = uniform(seed, a, -1) * (1.0 + gap) < 1.0
        length = wave(seed, a, 1) * mean_wave
        z[a] = uniform(seed, a, -2) * (length if touches else gap * length)
        z[n + a] = 0.0
        z[2 * n + a] = fresh(law)
        z[3 * n + a] = 1.0 if touches else 2.0


@kernel
def when(
    target: float, speed: float, late: float, clock: float, reach: float, rate: float,
    law: int, growth: float, beta: float, gamma: float,
) -> tuple[float, float]:  # fmt: skip
    """When a base that moves on at ``speed`` is ``target`` further than the limit of sticking is, and the clock then.

    ``reach`` is the limit where mu* is 1. The base's lead is a convex function of time: Newton's method comes down to its last
    root from any time behind that without leaping over it. ``late``, or beyond, is the answer when it is later than that.
    """
    low = reach * strength(law, clock, growth, beta, gamma)
    if law == 0:
        # What the limit grows by until then is less than all that it ever grows by, and than it would at its present rate.
        rest = reach * (growth - 1.0) * clock
        t = (target + rest) / speed
        slope = speed - rest * rate
        if slope > 0.0:
            t = min(t, target / slope)
    else:
        t = (target + reach * strength(law, clock + late * rate, growth, beta, gamma) - low) / speed
        if t > late:
            return late, clock
    for _ in range(60):
        c = aged(law, clock, t * rate)
        lead = speed * t - (reach * strength(law, c, growth, beta, gamma) - low) - target
        growing = reach * rate * growth_rate(law, c, growth, beta, gamma)
        slope = speed - growing
        if lead <= 0.0 or slope <= 0.0:
            return t, c
        back = lead / slope
        t -= back
        x = back * rate
        if law == 0:
            if 0.5 * growing * x * back <= 1e-14 * slope * t:  # what is left
                return t, c * (1.0 + x * (1.0 + x * (0.5 + x / 6.0)))
        elif back <= 1e-7 * t:
            return t, aged(law, clock, t * rate)
    return t, aged(law, clock, t * rate)


@kernel
def limit_over_time(
    law: int, c_0: float, c_1: float, r: float, growth: float, beta: float, gamma: float
) -> float:  # fmt: skip
    """Integral of mu* over ``r`` characteristic times, in which the clock goes from ``c_0`` to ``c_1``."""
    if law == 0:
        return growth * r - (growth - 1.0) * (c_0 - c_1)
    return impulse(law, c_0, r, growth, beta, gamma)


@loop
def live(
    a: int, s: float, speed: float, h: float, q: float, d: float, clock: float, event: int, reach: float,
    seed: int, law: int, growth: float, rate: float, beta: float, gamma: float, gap: float, mean_wave: float,
) -> tuple[float, float, float, float, int, int]:  # fmt: skip
    """One asperity over a step in which something happens to it, with any number of contacts.

    ``s`` is the direction, ``d`` the extension in it. Integral of the extension over time, then the states (with the extension
    in direction ``s``), then how many contacts it has lost.
    """
    left = h
    total = 0.0
    lost = 0
    length = wave(seed, a, event) * mean_wave
    while True:
        if event & 1:
            limit = reach * strength(law, clock, growth, beta, gamma)
            if d > limit or d < -limit:  # the limit has fallen, or the states have been interpolated: the tip follows
                kept = limit if d > limit else -limit
                q += s * (d - kept)
                d = kept
            q = min(max(q, 0.0), length)
            slips = 0.0
            begin = clock
            if d < limit * (1.0 - 1e-12) or speed < reach * rate * growth_rate(law, clock, growth, beta, gamma):
                slips = left
                if limit - d < speed * left:
                    slips, begin = when(limit - d, speed, left, clock, reach, rate, law, growth, beta, gamma)
                if slips >= left:
                    total += left * (d + 0.5 * speed * left)
                    return total, q, d + speed * left, aged(law, clock, left * rate), event, lost
            total += slips * (d + 0.5 * speed * slips)
            left -= slips
            limit = reach * strength(law, begin, growth, beta, gamma)
            room = length - q if s > 0.0 else q
            slides = left
            end = begin
            if room < speed * left:
                slides, end = when(room, speed, left, begin, reach, rate, law, growth, beta, gamma)
            if slides >= left:
                end = aged(law, begin, left * rate)
                d = reach * strength(law, end, growth, beta, gamma)
                total += reach / rate * limit_over_time(law, begin, end, left * rate, growth, beta, gamma)
                return total, q + s * (speed * left - (d - limit)), d, end, event, lost
            total += reach / rate * limit_over_time(law, begin, end, slides * rate, growth, beta, gamma)
            left -= slides
            lost += 1
            # The base is as far beyond the wave as the asperity is extended.
            over = reach * strength(law, end, growth, beta, gamma)
            d = 0.0
            clock = fresh(law)
            event += 1
            q = over if s > 0.0 else gap * length - over
            if lost >= _MOST_CONTACTS and left > 0.0 and left < h:
                share = h / (h - left)
                return total * share, min(max(q, 0.0), gap * length), d, clock, event, int(lost * share)
        else:
            to_go = gap * length - q if s > 0.0 else q
            if speed * left < to_go:
                return total, q + s * speed * left, 0.0, fresh(law), event, lost
            if to_go > 0.0:
                left = max(left - to_go / speed, 0.0)
            event += 1
            d = 0.0
            clock = fresh(law)
            length = wave(seed, a, event) * mean_wave
            q = 0.0 if s > 0.0 else length


@loop
def advance(
    z: Any, z_next: Any, i: int, v: float, h: float, y: Any, j: int, n: int, first: int, reach: float, stiffness: float,
    mass: float, seed: int, law: int, growth: float, time: float, beta: float, gamma: float, gap: float, mean_wave: float,
) -> float:  # fmt: skip
    """Mean force [F] of ``n`` asperities over a step ``h`` at ``v``; leads their states ``z[i:]`` to ``z_next[i:]``.

    They are numbered from ``first``; ``y[j:]`` are the heights over the mean one, ``reach`` the extension at which a fresh
    contact of mean height slips [x], ``stiffness`` [F/x] and ``mass`` [F s^2/x] those of one asperity.
    """
    s = 1.0 if v >= 0.0 else -1.0
    speed = abs(v)
    x = speed * h
    rate = 1.0 / time
    r = h * rate
    fade = math.exp(-r)
    fade_mean = -math.expm1(-r) / r if r > 0.0 else 1.0
    rise = growth - 1.0
    i_d, i_c, i_e = i + n, i + 2 * n, i + 3 * n
    total = 0.0
    lost = 0
    for a in range(n):
        q, d, clock = z[i + a], s * z[i_d + a], max(z[i_c + a], 0.0)
        event = max(int(z[i_e + a] + 0.5), 1)
        if law == 0:
            clock = min(clock, 1.0)
        own = reach * y[j + a]
        if law == 0 and event & 1:
            # What happens nearly always, in few operations: it sticks, or it slips, throughout.
            limit = own * (growth - rise * clock)
            later = clock * fade
            beyond = d + x - own * (growth - rise * later)
            if beyond <= 0.0 and d >= -limit:
                z_next[i + a] = q
                z_next[i_d + a] = s * (d + x)
                z_next[i_c + a] = later
                z_next[i_e + a] = event
                total += d + 0.5 * x
                continue
            if abs(d - limit) <= 1e-12 * limit and speed * time >= own * rise * clock:
                length = wave(seed, first + a, event) * mean_wave
                q_next = q + s * beyond
                if 0.0 < q_next < length:
                    z_next[i + a] = q_next
                    z_next[i_d + a] = s * (d + x - beyond)
                    z_next[i_c + a] = later
                    z_next[i_e + a] = event
                    total += own * (growth - rise * clock * fade_mean)
                    continue
        elif not event & 1:
            q_next = q + s * x
            if 0.0 < q_next < gap * mean_wave * wave(seed, first + a, event):
                z_next[i + a] = q_next
                z_next[i_d + a] = 0.0
                z_next[i_c + a] = clock
                z_next[i_e + a] = event
                continue
        area, q, d, clock, event, gone = live(
            first + a, s, speed, h, q, d, clock, event, own, seed, law, growth, rate, beta, gamma, gap, mean_wave
        )
        total += area / h
        lost += gone
        z_next[i + a] = q
        z_next[i_d + a] = s * d
        z_next[i_c + a] = clock
        z_next[i_e + a] = event
    # What a tip has of kinetic energy when it lets go is lost with it.
    return s * (stiffness * total + 0.5 * mass * speed * lost / h)


@kernel
def carrying(
    z: Any, y: Any, sunk: float, n: int, first: int, seed: int, margin: float, mean_wave: float
) -> tuple[float, int, int]:  # fmt: skip
    """Sum of (height - ``sunk``) over the asperities that carry load, how many these are, and how many touch.

    An asperity in contact carries while its base is within ``margin`` wave lengths of the wave that it touches.
    """
    total = 0.0
    carriers = 0
    touching = 0
    for a in range(n):
        event = int(z[3 * n + a] + 0.5)
        if event & 1 and y[a] > sunk:
            touching += 1
            length = wave(seed, first + a, event) * mean_wave
            base = z[a] + z[n + a]
            if -margin * length <= base <= (1.0 + margin) * length:
                total += y[a] - sunk
                carriers += 1
    return total, carriers, touching


@loop
def run(
    position: Any, h: float, lift: float, z: Any, work: Any, y: Any, reach: float, stiffness: float, mass: float, seed: int,
    law: int, growth: float, time: float, beta: float, gamma: float, gap: float, mean_wave: float, margin: float,
    force_out: Any, load_out: Any, touching_out: Any,
) -> None:  # fmt: skip
    """Lead a population along ``position``, ``(n_samples,)``, the speed constant between samples and the separation all along.

    ``lift`` is how far the bodies are separated, over the mean height. Outputs have one value for each interval: mean
    tangential force [F] over it; load as a sum of overlaps, and number of asperities that touch, at its end. Asperities are
    independent: a block that fits into the fastest memory, ``work`` with shape ``(9 m,)``, goes all the way before the next
    one begins.
    """
    n = y.shape[0]
    most = work.shape[0] // 9
    force_out[:] = 0.0
    load_out[:] = 0.0
    touching_out[:] = 0.0
    for first in range(0, n, most):
        m = min(most, n - first)
        overlap = work[8 * most : 8 * most + m]
        now, later = work[: 4 * m], work[4 * m : 8 * m]
        for a in range(m):
            overlap[a] = max(y[first + a] - lift, 0.0)
            for part in range(4):
                now[part * m + a] = z[part * n + first + a]
        for k in range(position.shape[0] - 1):
            v = (position[k + 1] - position[k]) / h
            force_out[k] += advance(
                now, later, 0, v, h, overlap, 0, m, first, reach, stiffness, mass, seed, law, growth, time, beta, gamma, gap,
                mean_wave,
            )  # fmt: skip
            now, later = later, now
            total, _, touching = carrying(now, overlap, 0.0, m, first, seed, margin, mean_wave)
            load_out[k] += total
            touching_out[k] += touching
        for a in range(m):
            for part in range(4):
                z[part * n + first + a] = now[part * m + a]


@loop
def run_under_load(
    position: Any, h: float, wanted: float, lift: Any, z: Any, z_next: Any, y: Any, overlap: Any, reach: float,
    stiffness: float, mass: float, seed: int, law: int, growth: float, time: float, beta: float, gamma: float, gap: float,
    mean_wave: float, margin: float, force_out: Any, lift_out: Any, touching_out: Any,
) -> None:  # fmt: skip
    """As :func:`run`, with the separation ``lift[0]`` adapted after each interval to a load.

    The overlaps of those that carry load then add up to ``wanted``; ``lift_out`` has the separation.
    """
    n = y.shape[0]
    for k in range(position.shape[0] - 1):
        for a in range(n):
            overlap[a] = max(y[a] - lift[0], 0.0)
        v = (position[k + 1] - position[k]) / h
        force_out[k] = advance(
            z, z_next, 0, v, h, overlap, 0, n, 0, reach, stiffness, mass, seed, law, growth, time, beta, gamma, gap, mean_wave
        )
        for j in range(4 * n):
            z[j] = z_next[j]
        for a in range(n):
            if overlap[a] <= 0.0:  # out of reach: when it comes back its contact is new
                z[2 * n + a] = fresh(law)
        total, carriers, touching = carrying(z, y, lift[0], n, 0, seed, margin, mean_wave)
        for _ in range(20):  # the sum falls along straight pieces that grow flatter: Newton's method, from anywhere
            if carriers == 0:
                if total >= wanted or lift[0] <= 0.0:
                    break
                lift[0] = 0.0
            elif abs(total - wanted) <= 1e-9 * wanted:
                break
            else:
                lift[0] += (total - wanted) / carriers
            total, carriers, touching = carrying(z, y, lift[0], n, 0, seed, margin, mean_wave)
        touching_out[k] = touching
        lift_out[k] = lift[0]
