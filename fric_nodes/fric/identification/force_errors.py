"""The force that acted on an axis beside the recorded one and the model's: measured without inverse dynamics.

A model that follows a recording sample by sample (:mod:`fric.identification.innovations`) is corrected after each one:
its velocity by beta e/h. A constant force error d needs the same change of velocity in every interval, so that

    d_k = c beta e_k / h^2,   c = force over the rate of change of velocity that it brings,

which is m for a rigid axis; for any plant c is found by simulating what a small force does to the seen motion, and what small
jumps of the seen velocity do. There are no filters in it that would smear a reversal, as there are in the equations of inverse
dynamics, and where the noise of the position is small the errors of single intervals come back. What they do to a free run is
slow; they are given as means over bins, whose correlation is that of the slow part and not of the noise of single samples.

Left out are rest, where no force error shows, and the neighbourhood of reversals, where an instant's error of the model's
reversal looks like a large force.
Source: the correction as an estimate of a disturbance is that of a disturbance observer (Ohnishi 1987); drawing recordings anew
from the innovations of a state-space model, Stoffer and Wall 1991.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..model import Model
from ..record import Array, Index, Mask
from ..signals.initial_state import initial_state
from ..signals.resolution import noise_of
from ..simulation import Predictor, Simulator, intervals, substeps
from .bootstrap import drawn_series
from .equations import Equations
from .free_parameters import FreeParameters
from .innovations import SETTLING, Run, gains, innovations
from .stretch import Stretch

__all__ = ["ForceErrors", "force_errors"]

_INDICES = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)  # tracking indices to choose from
_BIN = 10  # samples
_SHORTEST_BIN = 0.01  # [s]
_DIFFERENCE = 1e-3  # relative step of derivatives: wide enough to reach over the kinks of sticking
_PROBE = 50  # samples
_FEWEST = 20  # bins, below which all of motion counts
_QUIET = 5  # lags in a row without correlation, after which there is taken to be none
_LONGEST_MEMORY = 1.0  # [s]
_CLEAR = 3  # samples on either side of a reversal, besides those that the correction takes to settle


@dataclass(frozen=True, eq=False)
class ForceErrors:
    """Mean force errors of the bins in which the axis slid, one after the other.

    Attributes:
        error: [F], shape ``(n_bins,)``.
        bin_time: [s].
        starts: first bin of each stretch.
        length: of a block of bins that is well over their correlation.
    """

    error: Array
    bin_time: float
    starts: Index
    length: int

    def drawn(self, n: int, sample_time: float, random: np.random.Generator) -> Array:
        """A force error for each of ``n`` intervals [F], put together from blocks of bins longer than their correlation."""
        number = (np.arange(n) * (sample_time / self.bin_time)).astype(np.int64)
        series = drawn_series(self.error, int(number[-1]) + 1, self.length, self.starts, random)
        return np.asarray(series[number], dtype=np.float64)


def force_errors(model: Model, free: FreeParameters, found: Equations) -> ForceErrors:
    """What ``model`` misses along the recordings, less what other values of its free parameters would explain.

    Values that suit a long free run best leave a force error from sample to sample that is theirs, and none of the axis.

    Args:
        model: with its values.
        free: the parameters that were fitted.
        found: the recordings.
    """
    bin_time = max(_BIN * max(stretch.sample_time for stretch in found.stretches), _SHORTEST_BIN)
    followers = [_follower(model, stretch) for stretch in found.stretches]
    for clear in (True, False):
        good = [_sliding(part.stretch, found.rest_velocity, part.settling if clear else 0) for part in followers]
        lengths = [bin_time / part.stretch.sample_time for part in followers]
        bins = [_Bins(*each) for each in zip(good, lengths, strict=True)]
        if sum(each.n for each in bins) >= _FEWEST + len(free.names):
            break
    else:
        # Next to nothing slides: what there is, is better than nothing.
        bin_time = max(stretch.sample_time for stretch in found.stretches)
        bins = [_Bins(np.ones_like(each), 1.0) for each in good]

    def binned(trial: Model) -> Array:
        return np.concatenate([each.means(part.errors(trial)) for each, part in zip(bins, followers, strict=True)])

    error = _unexplained(binned, model, free)
    starts = np.cumsum([0, *(each.n for each in bins)])[:-1]
    memory = max(_memory(model, part.stretch, part.n_substeps) for part in followers)
    # What a free run adds up over its memory must be in a block, however faint it is from one bin to another.
    least = min(math.ceil(memory / bin_time), error.shape[0] // _FEWEST)
    return ForceErrors(error, bin_time, starts, max(_block_length(error), least))


def _block_length(error: Array) -> int:
    """Of the moving-block bootstrap, from the correlation that is there (Politis and White 2004; Patton, Politis, White 2009).

    With R(k) the autocovariances, m the lag after which five in a row are within noise, and L the flat-top window over 2 m, the
    length is (2 G^2/D)^(1/3) n^(1/3), G = sum L |k| R(k), D = 4/3 (sum L R(k))^2. Where errors are white, blocks are short:
    longer ones than needed are fewer of a kind, and their spread comes out too small.
    """
    n, energy = error.shape[0], float(error @ error)
    if n < _FEWEST or energy == 0.0:
        return 1
    most = math.ceil(math.sqrt(n)) + _QUIET
    r = np.array([float(error[k:] @ error[: n - k]) for k in range(min(most + _QUIET, n - 1))]) / energy
    loud = np.abs(r[1:]) > 2.0 * math.sqrt(math.log10(n) / n)
    quiet = np.flatnonzero([not np.any(loud[k : k + _QUIET]) for k in range(loud.shape[0] - _QUIET + 1)])
    m = int(quiet[0]) if quiet.size else most
    lag = np.arange(1, min(2 * max(m, 1), r.shape[0] - 1) + 1)
    window = np.minimum(1.0, 2.0 * (1.0 - lag / max(2 * m, 2)))
    slope = 2.0 * float(np.sum(window * lag * r[lag]))
    level = 1.0 + 2.0 * float(np.sum(window * r[lag]))
    wanted = float(np.cbrt(1.5 * slope**2 / max(level, 0.1) ** 2 * n))
    return int(min(max(math.ceil(wanted), 1), max(n // 4, 1)))


def _unexplained(errors: Callable[[Model], Array], model: Model, free: FreeParameters) -> Array:
    """Errors less their mean and what the free parameters explain, rescaled for the degrees of freedom that this takes."""
    here = errors(model)
    columns = [np.ones_like(here)]
    for k in free.index:
        values = model.values
        values[k] += _DIFFERENCE * (abs(float(values[k])) or 1.0)
        columns.append(errors(model.with_values(values)) - here)
    basis = np.array(columns).T
    size = np.linalg.norm(basis, axis=0)
    basis = basis[:, size > 0.0] / size[size > 0.0]
    answer, _, rank, _ = np.linalg.lstsq(basis, here, rcond=1e-6)
    n = here.shape[0]
    return np.asarray((here - basis @ answer) * np.sqrt(n / max(n - int(rank), 1)), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class _Follower:
    """A stretch followed by a model with a given tracking index."""

    stretch: Stretch
    run: Run
    index: float
    n_substeps: int
    force_per_innovation: float

    def errors(self, model: Model) -> Array:
        """Force error of each interval [F], shape ``(n,)``."""
        found = innovations(model, [self.run], self.index, self.n_substeps)
        return np.concatenate([np.zeros(SETTLING), self.force_per_innovation * found])

    @property
    def settling(self) -> int:
        """Samples that the correction takes to forget an error."""
        alpha, _ = gains(self.index)
        return _CLEAR + math.ceil(2.0 / (1.0 - math.sqrt(1.0 - alpha)))


def _follower(model: Model, stretch: Stretch) -> _Follower:
    """With the tracking index that has the smallest innovations."""
    n, h = stretch.raw_position.shape[0] - 1, stretch.sample_time
    load, temperature = (signal[:-1] if signal.shape[0] > 1 else signal for signal in (stretch.load, stretch.temperature))
    run = Run(
        step=np.full(n, h),
        effort=np.ascontiguousarray(intervals(stretch.effort, stretch.hold)),
        position=np.ascontiguousarray(stretch.raw_position[1:]),
        start=initial_state(stretch.time, stretch.raw_position, error=stretch.position_error)[:2],
        load=load,
        temperature=temperature,
        noise=noise_of(stretch.raw_position),
        effort_noise=noise_of(stretch.effort),
        hold=stretch.hold,
        late=None,
        between=np.zeros(n),
    )
    n_substeps = substeps(model, h)
    index = min(_INDICES, key=lambda trial: float(np.sum(innovations(model, [run], trial, n_substeps) ** 2)))
    force = _force_per_rate(model, stretch, n_substeps) * gains(index)[1] / h**2
    return _Follower(stretch, run, index, n_substeps, force)


def _gliding(model: Model, stretch: Stretch) -> tuple[Simulator, float]:
    """The model in motion at a typical speed of ``stretch``, and the force that keeps it there [F]."""
    h = stretch.sample_time
    speed = float(np.quantile(np.abs(stretch.velocity), 0.75))
    position = float(np.median(stretch.position))
    led = Predictor(model)
    time: Array = h * np.arange(_PROBE, dtype=np.float64)
    needed, _ = led.run(time, np.full(_PROBE, position), np.full(_PROBE, speed), np.zeros(_PROBE), h)
    moving = Simulator(model, position, speed)
    moving.friction_state[:] = led.friction_state
    return moving, float(needed[-1])


def _force_per_rate(model: Model, stretch: Stretch, n_substeps: int) -> float:
    """Force that changes the seen velocity as jumps of it, evenly spread, do; per rate of these jumps [F s^2/x]."""

    def end(force: float, kick: float) -> float:
        moving, needed = _gliding(model, stretch)
        for _ in range(_PROBE):
            moving.run(np.array([needed + force]), stretch.sample_time, n_substeps)
            moving.states[model.plant.encoder[1]] += kick
        return moving.velocity

    push = 0.02 * float(np.std(stretch.effort)) or 1.0
    jump = 0.02 * float(np.quantile(np.abs(stretch.velocity), 0.75)) / _PROBE
    base = end(0.0, 0.0)
    per_force, per_jump = (end(push, 0.0) - base) / push, (end(0.0, jump) - base) / jump
    return stretch.sample_time * per_jump / per_force if per_force != 0.0 else float("nan")


def _memory(model: Model, stretch: Stretch, n_substeps: int) -> float:
    """Time over which a jump of the velocity stays [s]: its way over its size, mass over damping for a rigid axis."""
    h = stretch.sample_time
    n = max(math.ceil(_LONGEST_MEMORY / h), 1)

    def velocities(share: float) -> Array:
        moving, needed = _gliding(model, stretch)
        moving.states[model.plant.encoder[1]] *= 1.0 + share
        states, _ = moving.run(np.full(n, needed), h, n_substeps)
        return np.asarray(states[:, model.plant.encoder[1]])

    jump = 0.02 * float(np.quantile(np.abs(stretch.velocity), 0.75))
    found = h * float(np.sum(velocities(0.02) - velocities(0.0))) / jump if jump > 0.0 else 0.0
    return min(max(found, 0.0), _LONGEST_MEMORY) if math.isfinite(found) else _LONGEST_MEMORY


def _sliding(stretch: Stretch, rest_velocity: float, away: int) -> Mask:
    """True for each interval in which the axis slides, and has slid and will slide in that direction for a while."""
    direction = np.sign(stretch.velocity) * (np.abs(stretch.velocity) > rest_velocity)
    edges = np.flatnonzero(np.diff(direction)) + 1
    sliding = np.zeros(direction.shape[0], dtype=np.bool_)
    for first, last in pairwise([0, *edges.tolist(), direction.shape[0]]):
        if direction[first] != 0.0:
            sliding[first + away : max(last - away, first + away)] = True
    sliding[:SETTLING] = False
    return sliding[:-1]


class _Bins:
    """The bins of ``length`` samples of which at least half are good."""

    def __init__(self, good: Mask, length: float) -> None:
        self._number = (np.arange(good.shape[0]) / length).astype(np.int64)
        self._good = good
        count = np.bincount(self._number, good)
        self._enough = (count > 0.0) & (count >= 0.5 * np.bincount(self._number))
        self._count = count[self._enough]

    @property
    def n(self) -> int:
        """How many there are."""
        return int(self._count.shape[0])

    def means(self, values: Array) -> Array:
        """Means of the good values, shape ``(n,)``."""
        total = np.bincount(self._number, np.where(self._good, values, 0.0))
        return np.asarray(total[self._enough] / self._count, dtype=np.float64)
