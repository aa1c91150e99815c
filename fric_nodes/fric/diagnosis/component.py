"""In which component something sits that no known effect explains.

A force has the signature of what makes it, also where its law isn't known. Each component has some ways in which it can act,
free in what a law would fix: friction whose level or slope changes with time as it likes, friction that goes with the motor's
force; an actuator whose gain changes with time as it likes; a load whose mass or whose pull changes with time as it likes, a
force that swings at one frequency whatever the axis does, a force that hangs on the position and lags behind it; a sensor whose
reading is off by a wave along the travel. What a contact takes up where the body rests isn't missing there. Each is fitted,
together with the nominal parameters, to what is missing, and what it explains is held against the number of its coefficients
(Schwarz's criterion); the best names the component. The effects of the registry take part: where one of them comes closest, its
component is named. Observers of several speeds see different sides of it, a slow one the level of a force, a fast one how a
contact sticks: they are heard alike.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..model import Model
from ..record import Array
from .along import REST
from .candidates import FRICTION, place_of
from .least_squares import Fit
from .motion import Motion
from .pieces import amplitudes_of, in_pieces
from .screen import Tried
from .track import Track

__all__ = ["Signature", "agreed", "signatures"]

_LEVEL, _GAIN = "friction whose level changes with time", "an actuator whose gain changes with time"
_FORCE = "a force that changes with time"
_SPAN = 0.25  # [s], of the steps in which something changes with time, at least
_ROWS = 6000  # that a fit uses at most
_MOST_WAVES = 25.0  # cycles over the travel, from _FEWEST_WAVES on,
_FEWEST_WAVES = 0.7
_DETUNED = 0.2  # of a cycle, by which neighbouring ones differ over the travel
_FEWEST_SWINGS = 8  # in a run, of a force that swings at one frequency
_LAGS = 12  # widths of a force that lags behind the position
_KNOTS = (0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875)  # of the travel, from where on such a force may pull


@dataclass(frozen=True)
class Signature:
    """One way in which a component can act.

    Attributes:
        component: part of the machine.
        title: the way, in words.
        share: of the missing force's energy that it explains.
        evidence: how far it is to be believed: the information criterion of Bayes per independent number, the less the better.
        n_coefficients: that it has to choose.
    """

    component: str
    title: str
    share: float
    evidence: float
    n_coefficients: int


@dataclass(frozen=True, eq=False)
class _Motions:
    """What a force can hang on, one array per run: motion, applied force and time."""

    motion: Sequence[Motion]
    effort: Sequence[Array]
    time: Sequence[Array]


def signatures(track: Track, fit: Fit, tried: Sequence[Tried] = ()) -> list[Signature]:
    """What each component could have to do with the force that ``fit`` lacks, the likeliest first.

    Args:
        track: the recordings.
        fit: whose residual is to be explained.
        tried: effects of the registry with what they leave, if they are to take part; those in which force is linear do.
    """
    missing = fit.residual
    stride = max(missing.shape[0] // _ROWS, 1)
    nominal = fit.jacobian[::stride]
    target = missing[::stride]
    alone = _left(nominal, target)
    independent = max(track.independent, 50.0)
    held = _Motions(track.motion, [run.effort for run in track.runs], track.time)
    found: dict[str, Signature] = {}

    def hear(component: str, title: str, columns: Array, n: int) -> None:
        left = _left(np.concatenate([nominal, columns], axis=1), target)
        signature = _marked(component, title, left / max(alone, 1e-300), n, independent)
        if title not in found or signature.evidence < found[title].evidence:
            found[title] = signature

    for component, title, columns in _ways(track, held, missing, fit.model):
        hear(component, title, columns[::stride], columns.shape[1])
    time = _times(track, held.time, stride)
    for component, title, signal in _stepping(held, fit.model):
        left = alone * (1.0 - found[title].share) if title in found else alone
        column = track.seen(signal)[::stride]
        hear(component, title, *in_pieces(column, time, nominal, target, left, independent, _SPAN))
    # A limit or a gap promises at first order what it doesn't keep.
    best = min((each for each in tried if each.column.amplitudes), key=lambda each: each.left, default=None)
    if best is not None:
        effect = best.column.term.effect
        left = best.left / max(best.left + best.gain, 1e-300)
        found[effect.title] = _marked(place_of(effect), effect.title, left, len(effect.parameters), independent)
    return sorted(found.values(), key=lambda each: each.evidence)


def agreed(of_observers: Sequence[Sequence[Signature]]) -> Signature:
    """The likeliest signature of the component that several observers together find likeliest, as the first of them sees it.

    Args:
        of_observers: what :func:`signatures` gives for each.
    """
    best = [
        {each.component: each for each in reversed(found)}  # the likeliest of each component
        for found in of_observers
    ]
    names = {name for each in best for name in each}
    likeliest = min(sorted(names), key=lambda name: sum(each[name].evidence for each in best if name in each))
    return next(each[likeliest] for each in best if likeliest in each)


def _marked(component: str, title: str, left: float, n: int, independent: float) -> Signature:
    """The signature of ``n`` coefficients that leave the share ``left`` of ``independent`` numbers."""
    left = max(left, 1e-6)
    return Signature(component, title, 1.0 - left, math.log(left) + n * math.log(independent) / independent, n)


def _left(columns: Array, target: Array) -> float:
    """Sum of squares of ``target`` that the columns leave."""
    return float(np.sum((target - columns @ amplitudes_of(columns, target)) ** 2))


def _rubbing(model: Model, held: _Motions) -> list[Array]:
    """Friction that doesn't grow with speed [F], as what is left of the measured force: it knows when a contact sticks."""
    values = {p.name: p.value for p in model.parameters()}
    viscous, bias = values.get("viscous.coefficient", 0.0), values.get("bias.force", 0.0)
    return [
        u - model.total_inertia * each.acceleration - viscous * each.velocity - bias
        for u, each in zip(held.effort, held.motion, strict=True)
    ]


def _directions(held: _Motions, model: Model) -> tuple[list[Array], list[Array]]:
    """Direction of the velocity, zero at rest; and where the axis is free to move: a contact that sticks takes up what acts."""
    fast = max(float(np.quantile(np.abs(np.concatenate([each.velocity for each in held.motion])), 0.9)), 1e-12)
    way = [np.tanh(each.velocity / (REST * fast)) for each in held.motion]
    sticks = any(each.effect.level is not None for each in model.terms)
    return way, [np.abs(each) if sticks else np.ones_like(each) for each in way]


def _stepping(held: _Motions, model: Model) -> Iterator[tuple[str, str, list[Array]]]:
    """Component, way, and the force, were it always as large, of what may change from one moment to the next.

    Dirt in a guideway, a supply that dips: only around the edges do they differ, so these are to be where they are. Friction
    with edges at every reversal is any force that comes and goes; what pulls whichever way the axis moves needs far fewer.
    """
    way, free = _directions(held, model)
    yield FRICTION, _LEVEL, way
    yield "load", _FORCE, free
    if not model.plant.led:
        yield "command path", _GAIN, [moves * u for moves, u in zip(free, held.effort, strict=True)]


def _ways(track: Track, held: _Motions, missing: Array, model: Model) -> Iterator[tuple[str, str, Array]]:
    """Component, way, and its columns, shape ``(n, n_columns)`` each."""
    rate = [each.velocity for each in held.motion]
    way, free = _directions(held, model)
    guideway, load = FRICTION, "load"
    steps, steadily = _spans(track, held.time), _slopes(track, held.time)
    yield guideway, _LEVEL, _changing(track, way, steps)
    yield guideway, _LEVEL, _changing(track, _rubbing(model, held), steps)
    # A film thins and thickens, where dirt or a supply comes and goes.
    yield guideway, "friction whose slope changes with time", _changing(track, rate, steps)
    yield guideway, "friction whose slope changes with time", _changing(track, rate, steadily)
    driven = [sign * np.abs(u) for sign, u in zip(way, held.effort, strict=True)]
    yield guideway, "friction that goes with the motor's force", _seen(track, [driven])
    if not model.plant.led:  # what is measured at a contact is behind the drive and the mass
        given = [moves * u for moves, u in zip(free, held.effort, strict=True)]
        yield "command path", _GAIN, _changing(track, given, steps)
        acceleration = [each.acceleration for each in held.motion]
        yield load, "a mass that changes with time", _changing(track, acceleration, steps)
    yield load, "a force that swings at one frequency", _tone(track, held.time, missing, free)
    for lagging in _lags(held.motion):
        pulling = [[moves * force for moves, force in zip(free, each, strict=True)] for each in lagging]
        yield load, "a force that hangs on the position and lags behind it", _seen(track, pulling)
    for wave in _waves(held.motion):
        yield "sensor", "a reading that is off by a wave along the travel", _seen(track, wave)


def _seen(track: Track, signals: Sequence[Sequence[Array]]) -> Array:
    """Columns of forces, as the observer sees them; each of ``signals`` has one array per run."""
    return np.stack([track.seen(list(each)) for each in signals], axis=1)


def _changing(track: Track, signal: Sequence[Array], weights: Array) -> Array:
    """Columns of ``signal``, one value per sample of each run, by the ``weights`` over time of each."""
    return weights * track.seen(list(signal))[:, None]


def _times(track: Track, time: Sequence[Array], stride: int) -> list[Array]:
    """Time of every ``stride``-th row [s], per run."""
    rows = track.joined(time)
    run = np.repeat(np.arange(len(time)), [part.shape[0] for part in track.split(rows)])[::stride]
    return [rows[::stride][run == k] for k in range(len(time))]


def _knots(track: Track, time: Sequence[Array]) -> tuple[Array, int]:
    """Time of each row in spans, those of one run before those of the next, and how many there are.

    Spans of one run aren't those of another, also where the clocks of two recordings show the same.
    """
    number, first = [], 0
    for each in time:
        span = (each - each[0]) / _SPAN
        number.append(first + span)
        first += int(span[-1]) + 2
    return np.concatenate(track.split(track.joined(number))), first


def _spans(track: Track, time: Sequence[Array]) -> Array:
    """One within each span of time and zero outside, shape ``(n, n_spans)``: what changes in steps."""
    at, n = _knots(track, time)
    weights = np.zeros((at.shape[0], n))
    weights[np.arange(at.shape[0]), at.astype(np.int64)] = 1.0
    return weights[:, np.any(weights, axis=0)]


def _slopes(track: Track, time: Sequence[Array]) -> Array:
    """One at each end of a span, falling to zero at the next ones, shape ``(n, n_ends)``: what changes steadily."""
    at, n = _knots(track, time)
    rows, before = np.arange(at.shape[0]), at.astype(np.int64)
    weights = np.zeros((at.shape[0], n))
    weights[rows, before] = 1.0 - (at - before)
    weights[rows, before + 1] = at - before
    return weights[:, np.any(weights, axis=0)]


def _tone(track: Track, time: Sequence[Array], missing: Array, free: Sequence[Array]) -> Array:
    """A sine and a cosine at the frequency at which most force is missing, for each run, where it is ``free`` to move.

    All runs are heard: in the longest the axis may rest, or do something else that lacks more.
    """
    parts = track.split(missing)
    n = 4 * max(part.shape[0] for part in parts)
    power = np.zeros(n // 2 + 1)
    for part in parts:
        own = np.abs(np.fft.rfft(part * np.hanning(part.shape[0]), n)) ** 2
        own[: _FEWEST_SWINGS * n // part.shape[0]] = 0.0  # slower is a drift
        power += own
    frequency = float(np.fft.rfftfreq(n, track.runs[0].sample_time)[int(np.argmax(power))])
    waves = []
    for k in range(len(time)):
        for function in (np.sin, np.cos):
            signal = [np.zeros_like(each) for each in time]
            signal[k] = free[k] * function(2.0 * math.pi * frequency * time[k])
            waves.append(signal)
    return _seen(track, waves)


def _lags(motion: Sequence[Motion]) -> Iterator[list[list[Array]]]:
    """What follows the position with a play: forces in proportion to it, also from some place on only."""
    everywhere = np.concatenate([each.position for each in motion])
    low, travel = float(np.min(everywhere)), max(float(np.ptp(everywhere)), 1e-12)
    for width in travel * np.geomspace(0.01, 0.3, _LAGS):
        follower = [_follower(each.position, float(width)) for each in motion]
        yield [
            follower,
            *([np.maximum(each - (low + share * travel), 0.0) for each in follower] for share in _KNOTS),
            [np.abs(each - each[0]) for each in follower],
        ]


def _follower(position: Array, play: float) -> Array:
    """A point that the position drags along with a play of ``2 play``, shape ``(n,)``."""
    result = np.empty_like(position)
    at = float(position[0])
    for k, q in enumerate(position.tolist()):
        at = max(q - play, min(q + play, at))
        result[k] = at
    return result


def _waves(motion: Sequence[Motion]) -> Iterator[list[list[Array]]]:
    """Acceleration of an error of the reading, phase by phase of a wave, for periods over the travel; and with an overtone.

    A large error bends the wave, which is one of the true position, as the reading shows it.
    """
    travel = max(float(np.ptp(np.concatenate([each.position for each in motion]))), 1e-12)
    for number in np.arange(_FEWEST_WAVES, _MOST_WAVES, _DETUNED):
        wave = 2.0 * math.pi * float(number) / travel
        alone = _accelerations(motion, wave)
        yield alone
        yield alone + _accelerations(motion, 2.0 * wave)


def _accelerations(motion: Sequence[Motion], wave: float) -> list[list[Array]]:
    """Those of an error of the reading that goes as a ``wave`` [1/x] of the position, but for their sizes."""
    return [
        [change * function(wave * each.position) for each, change in zip(motion, changes, strict=True)]
        for function in (np.sin, np.cos)
        for changes in ([each.acceleration for each in motion], [each.velocity**2 for each in motion])
    ]
