"""A model in closed loop: what a controller makes of it under the reference of a recording.

The position is read every ``period``, rounded to the encoder's step; the answer acts ``delay`` later and is held until the next
one does. Between these instants, and at the samples of the recording, the model is simulated as it is everywhere else. The loop
starts in the recorded state: position and velocity by :mod:`fric.signals.initial_state`, and the controller as if
it had given the recorded force until then, so that its integral begins with what friction and gravity ask of it.

A free run under the recorded force adds up every error of the force. A controller takes most of them away, as on the machine:
how far the closed loop is from the recorded one says how well the model foretells the behaviour of this servo, or of one with
other gains.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..identification.equations import surroundings
from ..model import Model
from ..record import Array, Record
from ..signals.initial_state import initial_state
from ..simulation import Simulator
from .controller import Law, Setpoint
from .controller_file import ControllerSettings

__all__ = ["ClosedLoop", "ClosedLoopError", "closed_loop"]

_NS = 1e9  # instants are counted in nanoseconds, so that those meant to be the same are
_FAR = 1e9  # [x]: nothing that is controlled is there
_ESCAPED = 1e3  # times the range of reference and recorded position: a loop that has left it is none


class ClosedLoopError(InputError):
    """A closed loop that can't be simulated."""


@dataclass(frozen=True)
class ClosedLoop:
    """A simulated closed loop, and how far it is from the recorded one.

    Attributes:
        record: position, velocity, force and reference at the times of the recording; the force as the recording holds it.
        position_rmse: of simulated less recorded position [x].
        relative_force_error_percent: 100 |u_simulated - u_recorded| / |u_recorded|.
        tracking_rms: of position less reference, simulated [x].
        recorded_tracking_rms: the same as recorded [x].
        saturated: number of readings whose answer was limited.
    """

    record: Record
    position_rmse: float
    relative_force_error_percent: float
    tracking_rms: float
    recorded_tracking_rms: float
    saturated: int


class _Reference:
    """Position, velocity and acceleration wanted, at any time."""

    def __init__(self, time: Array, position: Array) -> None:
        velocity = np.gradient(position, time)
        self._time = time
        self._signals = position, velocity, np.gradient(velocity, time)

    def at(self, times: Array) -> Array:
        """Shape ``(n, 3)``."""
        return np.stack([np.interp(times, self._time, signal) for signal in self._signals], axis=1)


def _law(
    settings: ControllerSettings, first: Array, state: tuple[float, float], force: float
) -> tuple[Callable[[float, Array, float], float], Law]:
    """The controller in the middle of its work: its output from time, reference and reading; and what counts its limits."""
    h = settings.period
    forward = None if settings.feedforward is None else settings.feedforward.build(h, 0.5 * h + settings.delay)

    def ahead(time: float, wanted: Array) -> float:
        return 0.0 if forward is None else forward.step(time, *wanted.tolist())

    rest = force - ahead(-h, first - h * np.array([first[1], first[2], 0.0]))
    law = settings.kind.build(settings.gains, settings.force_limit)
    law.begin(Setpoint(*first.tolist()), state, rest, h)
    return lambda t, r, y: law.answer(Setpoint(*r.tolist()), y, h, ahead(t, r)), law


def closed_loop(model: Model, settings: ControllerSettings, record: Record) -> ClosedLoop:
    """Simulate ``model`` under the controller and the reference of ``record``, from its first state.

    Args:
        model: what is controlled.
        settings: of the controller.
        record: with a reference; evenly sampled.

    Raises:
        ClosedLoopError: there is no reference, units differ, or the loop is unstable.
    """
    if record.reference is None:
        raise ClosedLoopError(record.source, "holds no reference", "record the topic 'reference' too, or map it in the import")
    if settings.units != model.units or record.units != model.units:
        given = "; ".join(f"{u.position} and {u.force}" for u in (settings.units, model.units, record.units))
        problem = f"units of controller, model and recording differ ({given})"
        raise ClosedLoopError(record.source, problem, "give all three in the same units")
    position, velocity, command, saturated = _run(model, settings, record, _Reference(record.time, record.reference))
    preceding = record.hold == "preceding"
    effort = np.concatenate([command[:1], command[:-1]]) if preceding else command
    scale = _ESCAPED * max(float(np.ptp(record.reference)), float(np.ptp(record.position)))
    if not np.all(np.abs(position - record.position) <= scale):
        raise ClosedLoopError(record.source, "the loop is unstable with this model and controller", "lower its gains or delay")
    simulated = replace(
        record,
        position=position,
        velocity=velocity,
        effort=effort,
        valid=None,
        effort_hold="preceding" if preceding else "following",
        notes=(f"simulated in closed loop under the reference of {record.source}",),
    )
    use = record.mask
    norm = _rms(record.effort[use])
    return ClosedLoop(
        simulated,
        position_rmse=_rms((position - record.position)[use]),
        relative_force_error_percent=100.0 * _rms((effort - record.effort)[use]) / norm if norm > 0.0 else math.inf,
        tracking_rms=_rms((position - record.reference)[use]),
        recorded_tracking_rms=_rms((record.position - record.reference)[use]),
        saturated=saturated,
    )


def _run(model: Model, settings: ControllerSettings, record: Record, reference: _Reference) -> tuple[Array, Array, Array, int]:
    """Position, velocity and acting command at each sample, ``(n_samples,)`` each, and how often the command was limited."""
    begin = initial_state(record.time, record.position)
    force = initial_state(record.time, record.effort).position
    first = reference.at(np.zeros(1))[0]
    answer, counter = _law(settings, first, begin[:2], force)
    samples = np.rint(_NS * record.time).astype(np.int64)
    n_readings = int(record.duration / settings.period) + 1
    readings = np.rint(_NS * settings.period * np.arange(n_readings)).astype(np.int64)
    wanted = reference.at(readings / _NS)
    acting = readings + round(_NS * settings.delay)
    instants = np.unique(np.concatenate([samples, readings, acting[acting <= samples[-1]]]))
    instants = instants[instants <= samples[-1]]
    load, temperature = surroundings(record)
    simulator = Simulator(model, begin.position, begin.velocity)
    found = np.empty((3, record.n_samples))
    command, commands = force, np.empty(n_readings)
    at = read = acted = 0
    for k, now in enumerate(instants.tolist()):
        if read < n_readings and readings[read] == now:
            seen = simulator.position
            if settings.resolution > 0.0:
                seen = settings.resolution * round(seen / settings.resolution)
            commands[read] = answer(now / _NS, wanted[read], seen)
            read += 1
        if acted < read and acting[acted] == now:
            command = float(commands[acted])
            acted += 1
        if samples[at] == now:
            found[:, at] = simulator.position, simulator.velocity, command
            at += 1
        if k + 1 < instants.shape[0]:
            if not abs(simulator.position) < _FAR:
                found[:, at:] = math.nan
                break
            here = min(at, record.n_samples - 1)
            around = (each[here : here + 1] if each.shape[0] > 1 else each for each in (load, temperature))
            simulator.run(np.array([command]), (instants[k + 1] - now) / _NS, None, *around)
    return found[0], found[1], found[2], counter.saturated


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
