"""Twins: recordings that a model itself would have left on the same motion, with the same noise and the same encoder.

A twin is what a recording looks like when nothing is missing. The model is led along the measured motion by a stiff spring and
damper, whose force acts beside the recorded one, behind the command path; then the recorded force gets white noise as strong
as it has, and the position its steps and its noise. What an observer finds missing in a twin is the floor that a mismatch has
to stand out from, and what a candidate gains on a twin it gains by chance.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ..identification.innovations import Run
from ..model import Model
from ..record import Array
from ..signals.resolution import noise_of, step_of
from .motion import SMOOTH, smooth
from .track import Track, Twin

__all__ = ["twins"]

_ESCAPED = 10.0  # spans of the recorded motion, beyond which it does not matter how far a twin has run
_LED = 4.0  # times the observer's bandwidth: of the spring that leads it; with a softer one a model sticks and slips
# Spring and damper act once per sample: what they may be at most, times m/h^2 and m/h of the body that the sensor sees. That
# is a part of the whole where there is play: the whole's spring would make it swing between the stops, wider each time.
_STIFFEST, _MOST_DAMPING = 0.15, 0.6
_SPEEDS, _FEWEST = 8, 250  # statistical: ranges of speed at most, and samples of each


def _led(track: Track, model: Model, k: int) -> tuple[Array, Array, Array]:
    """Position at the end of each interval, force that leads, and command over it, of ``model`` led along the run's motion."""
    run = track.runs[k]
    step = run.sample_time
    if model.plant.led:
        motion = track.led_motion[k]
        force = track.borne(model, k, motion, smooth(run.effort, step, SMOOTH * track.bandwidth))
        return motion.position + 0.5 * step * motion.velocity, np.zeros_like(force), force
    position = np.concatenate([[run.start[0]], run.position])
    wanted = smooth(position, step, SMOOTH * track.bandwidth)
    rate = np.gradient(wanted, step)
    lead = min(_LED * track.bandwidth, 0.3 / step)
    plant_values = np.array(model.plant_values)
    moved = min(track.mass, model.plant.motor_inertia(*plant_values))
    stiffness = min(track.mass * lead**2, _STIFFEST * moved / step**2)
    damping = min(2.0 * track.mass * lead, _MOST_DAMPING * moved / step)
    state = np.append(model.plant.start(plant_values, float(wanted[0]), float(rate[0])), track.begin(k))
    given = smooth(run.effort, step, SMOOTH * track.bandwidth)
    there, extra = np.empty_like(given), np.empty_like(given)
    model.linked_loops.lead(
        model.linked, given,
        wanted[:-1].copy(), rate[:-1].copy(), run.step, track.n_substeps(model, run), run.load, run.temperature,
        stiffness, damping, state, *track.inner_states(model, k, float(rate[0])), there, extra,
    )  # fmt: skip
    return there, extra, given


def twins(track: Track, model: Model, n_twins: int, seed: int = 1) -> list[Twin]:
    """``n_twins`` recordings that ``model`` would have left, each with noise of its own."""
    led = [_led(track, model, k) for k in range(len(track.runs))]
    random = np.random.default_rng(seed)
    own = [_sensor_noise(run, motion.velocity) for run, motion in zip(track.runs, track.motion, strict=True)]
    return [_noisy(track.runs, led, own, random) for _ in range(n_twins)]


def _sensor_noise(run: Run, velocity: Array) -> Array:
    """Standard deviation of the sensor's own noise at each sample [x], which the steps of the encoder don't explain, ``(n,)``.

    A position that is read a little early or late is wrong in proportion to the speed, and so is one within the lines of an
    encoder. So it is told for ranges of speed that hold equally many samples.
    """
    n, step = run.position.shape[0], step_of(run.position)
    speed = np.abs(velocity)
    time = np.cumsum(run.step)
    edges = np.quantile(speed, np.linspace(0.0, 1.0, 1 + max(min(_SPEEDS, n // _FEWEST), 1)))
    noise = np.array(
        [noise_of(run.position, (speed >= low) & (speed <= high), time) for low, high in itertools.pairwise(edges)]
    )
    variance = np.interp(speed, 0.5 * (edges[1:] + edges[:-1]), noise**2)
    return np.asarray(np.sqrt(np.maximum(variance - step**2 / 12.0, 0.0)))


def _noisy(
    runs: Sequence[Run], led: Sequence[tuple[Array, Array, Array]], owns: Sequence[Array], random: np.random.Generator
) -> Twin:
    efforts, positions = [], []
    for run, (there, _, given), own in zip(runs, led, owns, strict=True):
        efforts.append(given + run.force_noise(random) + run.between * random.standard_normal(given.shape[0]))
        step = step_of(run.position)
        # A model that escapes, however it is led, has a twin that runs away: far enough to be told, not beyond all numbers.
        low, high = float(np.min(run.position)), float(np.max(run.position))
        reach = _ESCAPED * (high - low)
        moved = np.clip(np.nan_to_num(there, nan=high + reach), low - reach, high + reach)
        moved = moved + own * random.standard_normal(there.shape[0])
        positions.append(np.round(moved / step) * step if step > 0.0 else moved)
    return Twin(tuple(efforts), tuple(positions), tuple(extra for _, extra, _ in led))
