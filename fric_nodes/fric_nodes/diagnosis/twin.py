"""Twins: recordings that a model itself would have left on the same motion, with the same noise and the same encoder.

A twin is what a recording looks like when nothing is missing. The model is led along the measured motion by a stiff spring and
damper, whose force joins the recorded one; then the force gets white noise as strong as the recording's, and the position its
steps and its noise. What an observer finds missing in a twin is the floor that a mismatch has to stand out from, and what a
candidate gains on a twin it gains by chance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfiltfilt

from ..identification.innovations import Run, noise_of
from ..model import Model
from ..record import Array
from .track import Track, resolution
from .universe import universe_of

__all__ = ["Twin", "twins"]

_SMOOTH = 4.0  # times the observer's bandwidth: of the motion that a twin is led along
_LED = 1.5  # times the observer's bandwidth: of the spring that leads it


@dataclass(frozen=True, eq=False)
class Twin:
    """Forces and positions of a twin, per run of the track, as the recording has them."""

    efforts: tuple[Array, ...]
    positions: tuple[Array, ...]


def smooth(signal: Array, step: float, cutoff: float) -> Array:
    """``signal`` without what is faster than ``cutoff`` [rad/s], without phase."""
    edge = cutoff * step / math.pi
    if edge >= 0.9:
        return signal
    result: Array = sosfiltfilt(butter(2, edge, output="sos"), signal)
    return result


def _led(track: Track, model: Model, k: int) -> tuple[Array, Array]:
    """Position at the end of each interval, and command over it, of ``model`` led along the run's motion."""
    universe, run = universe_of(model), track.runs[k]
    step = float(np.median(run.step))
    position = np.concatenate([[run.start[0]], run.position])
    wanted = smooth(position, step, _SMOOTH * track.bandwidth)
    rate = np.gradient(wanted, step)
    lead = min(_LED * track.bandwidth, 0.15 / step)
    plant_values = np.array(model.plant_values)
    state = np.append(universe.plant.start(plant_values, float(wanted[0]), float(rate[0])), track.begin(k))
    there, given = np.empty(run.effort.shape[0]), np.empty(run.effort.shape[0])
    universe.loops.lead(
        universe.values(model), smooth(run.effort, step, _SMOOTH * track.bandwidth),
        wanted[:-1].copy(), rate[:-1].copy(), run.step, track.n_substeps(model, run), run.load, run.temperature,
        track.mass * lead**2, 2.0 * track.mass * lead, state, *universe.inner_states(model), there, given,
    )  # fmt: skip
    return there, given


def twins(track: Track, model: Model, n_twins: int, seed: int = 1) -> list[Twin]:
    """``n_twins`` recordings that ``model`` would have left, each with noise of its own."""
    led = [_led(track, model, k) for k in range(len(track.runs))]
    random = np.random.default_rng(seed)
    return [_noisy(track.runs, led, random) for _ in range(n_twins)]


def _noisy(runs: Sequence[Run], led: Sequence[tuple[Array, Array]], random: np.random.Generator) -> Twin:
    efforts, positions = [], []
    for run, (there, given) in zip(runs, led, strict=True):
        efforts.append(given + noise_of(run.effort) * random.standard_normal(given.shape[0]))
        step = resolution(run.position)
        # What the steps of the encoder don't explain of the noise is the sensor's own.
        own = math.sqrt(max(noise_of(run.position) ** 2 - step**2 / 12.0, 0.0))
        moved = there + own * random.standard_normal(there.shape[0])
        positions.append(np.round(moved / step) * step if step > 0.0 else moved)
    return Twin(tuple(efforts), tuple(positions))
