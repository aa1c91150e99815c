"""What filters and sampling do to an estimate of bristles, found on a simulated recording of the same motion, and taken off.

Friction with states of its own depends on the path, quick parts and all: sliding breaks loose, and bristles ring, within a few
samples. What the filter on the position and the time between samples take away of it isn't noise; it moves the estimate the
same way in every recording. It moves that of a simulated recording as well. The model found is led along the measured motion
by the force that it needs there and a soft feedback; its exact position is sampled, given noise and rounded as the measured one
is, and turned into equations as the recording was. Their residual r at the model's own values would be zero but for the
filters, and the estimate is off by the solution of J d = r, J being the Jacobian of the fit. Once the noise is added, once
subtracted, so that what is random about it cancels, and what it does on average, a path made longer, is left.

It is the one-step form of indirect inference (Gourieroux, Monfort, Renault 1993), whose auxiliary estimate is the fit itself.
"""

from __future__ import annotations

import math

import numpy as np

from ..model import Model
from ..record import Array, Record
from ..signals.resolution import noise_of, step_of
from ..simulation import Predictor, Simulator, substeps
from .equations import Equations, equations
from .result import Options
from .scoring import force_along, force_over_intervals
from .stretch import Stretch

__all__ = ["residual_of_filters"]

_BANDWIDTH = 2.0  # of the feedback [Hz]: it holds the path and has no part in what is quick
_HELD = 0.01  # [s] that one value of the feedback is held at most


def residual_of_filters(model: Model, found: Equations) -> Array:
    """What the equations of a simulated motion of ``model`` leave at its own values [F], shape ``(n_rows,)``."""
    random = np.random.default_rng(1)
    step = found.stretches[0].sample_time
    decimation = max(round(float(found.time[1] - found.time[0]) / step), 1)
    options = Options(cutoff=found.cutoff, decimation=decimation, rest_velocity=found.rest_velocity)
    motions = [_motion(model, stretch) for stretch in found.stretches]
    noises: list[Array] = [random.standard_normal(stretch.raw_position.shape) for stretch in found.stretches]
    parts = []
    for sign in (1.0, -1.0):
        records = [
            _record(stretch, _seen(position, sign * noise, stretch.raw_position), effort)
            for stretch, (position, effort), noise in zip(found.stretches, motions, noises, strict=True)
        ]
        simulated = equations(records, options)
        parts.append(simulated.force - simulated.rows(lambda stretch: force_along(model, stretch)))
    return 0.5 * (parts[0] + parts[1])


def _seen(position: Array, noise: Array, like: Array) -> Array:
    """``position`` as measured by the instrument of the signal ``like``; ``noise`` of unit size is the course of its noise."""
    step = step_of(like)
    white = math.sqrt(max(noise_of(like) ** 2 - step**2 / 12.0, 0.0))
    seen = position + white * noise
    if step == 0.0:
        return seen
    # Where between two counts the motion begins is chance, too.
    offset = like[0] + 0.25 * math.copysign(step, noise[0])
    return np.asarray(offset + step * np.round((seen - offset) / step), dtype=np.float64)


def _record(stretch: Stretch, position: Array, effort: Array) -> Record:
    n = position.shape[0]
    extra: dict[str, Array] = {
        name: np.asarray(np.broadcast_to(given, (n,)), dtype=np.float64)
        for name, given in (("normal_load", stretch.load), ("temperature", stretch.temperature))
    }
    nominal = {"normal_load": 1.0, "temperature": 0.0}
    time: Array = stretch.sample_time * np.arange(n, dtype=np.float64)
    return Record(time, position, effort, extra=extra, nominal=nominal, effort_hold="following")


def _motion(model: Model, stretch: Stretch) -> tuple[Array, Array]:
    """Exact positions at the samples and the force over the interval after each, of ``model`` along ``stretch``."""
    h = stretch.sample_time
    needed = force_over_intervals(model, stretch)
    omega = 2.0 * math.pi * _BANDWIDTH
    inertia = _inertia(model, stretch)
    p, d = inertia * omega**2, 1.4 * inertia * omega
    n_substeps = substeps(model, h)
    simulator = Simulator(model, float(stretch.position[0]), float(stretch.velocity[0]))
    position, effort = stretch.position.copy(), np.zeros(stretch.position.shape[0])
    held = max(int(_HELD / h), 1)
    for first in range(0, needed.shape[0], held):
        off, off_rate = stretch.position[first] - simulator.position, stretch.velocity[first] - simulator.velocity
        part = slice(first, min(first + held, needed.shape[0]))
        load, temperature = (each[part] if each.shape[0] > 1 else each for each in (stretch.load, stretch.temperature))
        effort[part] = needed[part] + p * off + d * off_rate
        states, _ = simulator.run(effort[part], h, n_substeps, load, temperature)
        position[first + 1 : part.stop + 1] = states[:, model.plant.encoder[0]]
    effort[-1] = effort[-2]
    return position, effort


def _inertia(model: Model, stretch: Stretch) -> float:
    """Force per acceleration [F s^2/x]."""
    still = model.with_terms(())
    q, zero = np.array([float(np.median(stretch.position))]), np.zeros(1)
    needed = [float(Predictor(still).run(zero, q, zero, np.array([rate]), stretch.sample_time)[0][0]) for rate in (0.0, 1.0)]
    return needed[1] - needed[0]
