"""Parameters with values of their own in each recording: what that leaves, at first order and fitted in full.

With r the force that a fitted model lacks, J its derivative by the parameters and 1_k the rows of recording k, the column of a
parameter's own value in that recording is J_j 1_k. Least squares on these and the columns of all others is solved once for
each block of the recordings with that block left out (:mod:`.screen`); each block is part of one recording. All of it follows
from sums of products of r and J over each block.

The gain of the force signal is among the parameters. It is that of one recording over another: all gains together are the unit
of the force, and the model's parameters do the same.

Standard errors are those of the jackknife over the blocks, recording by recording: what a model lacks besides hangs together
within a block. Sources: Efron and Stein 1981; MacKinnon, Nielsen and Webb 2023 on few clusters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.stats import f as f_ratio
from scipy.stats import t as student

from ..identification.gauss_newton import minimise
from ..model import Model
from ..record import Array, Mask
from ..threads import n_threads
from .candidates import scales_of
from .fitting import State, bounds_of
from .indifference import dearer
from .least_squares import limits_of
from .screen import blocks_of, restraint
from .start import FIRST_FIT
from .track import Track, Twin

__all__ = ["GAIN", "Differing", "Own"]

GAIN = "gain of the force"
"""Name by which the gain of the force signal is told; it is no parameter of a model."""


@dataclass(frozen=True, eq=False)
class Differing:
    """By what the value of a parameter differs in one recording.

    Attributes:
        parameter: its name.
        number: of the recording.
        values: in each recording, shape ``(n_records,)``.
        stds: their standard errors, shape ``(n_records,)``.
        others: mean of the values in the others, each weighted by how well it is known.
        difference: of the recording from these.
        std: standard error of that.
        reach: half of its interval of 95 %, by Student's t for as many blocks as a recording has.
        others_agree: whether the values in the others are one but for their errors.
    """

    parameter: str
    number: int
    values: Array
    stds: Array
    others: float
    difference: float
    std: float
    reach: float
    others_agree: bool

    @property
    def is_sure(self) -> bool:
        """Whether the interval leaves out nothing at all."""
        return abs(self.difference) > self.reach


@dataclass(frozen=True, eq=False)
class Own:
    """A model of which some parameters have values of their own in each recording.

    Attributes:
        track: the recordings.
        model: with the values that all recordings share.
        names: of the parameters that are fitted, the gain of the force last.
        scale: unit of each, shape ``(n_names,)``.
        own: names of those with own values, in the order in which they came.
        values: in each recording, shape ``(n_records, n_names)``.
        residual: the force that is missing [F], shape ``(n,)``.
        jacobian: derivative of the residual per ``scale``, shape ``(n, n_names)``.
        usable: False for parameters that a bound holds, shape ``(n_names,)``.
        held: by what square a value is held back [F^2].
        minded: by which what is left counts more (:mod:`.indifference`).
    """

    track: Track
    model: Model
    names: tuple[str, ...]
    scale: Array
    own: tuple[str, ...]
    values: Array
    residual: Array
    jacobian: Array
    usable: Mask
    held: float
    minded: float

    @classmethod
    def of(cls, track: Track, state: State) -> Own:
        """The fitted model of ``state``, all of whose values are shared."""
        fit = state.fit
        values = np.array([*(fit.model.value(name) for name in fit.names), 1.0])
        found = cls(
            track,
            fit.model,
            (*fit.names, GAIN),
            np.append(fit.scale, 1.0),
            (),
            np.tile(values, (len(set(track.record)), 1)),
            fit.residual,
            np.empty((0, 0)),
            np.append(fit.solution.free, True),
            restraint(track, fit),
            dearer(track, fit.model),
        )
        return replace(found, jacobian=np.column_stack([fit.jacobian, found._by_gain()]))

    @cached_property
    def records(self) -> list[int]:
        """Numbers of the recordings."""
        return sorted(set(self.track.record))

    @cached_property
    def _apart(self) -> list[Track]:
        """Each recording by itself."""
        found = []
        for number in self.records:
            at = slice(self.track.record.index(number), len(self.track.record) - self.track.record[::-1].index(number))
            found.append(
                replace(
                    self.track,
                    runs=self.track.runs[at],
                    time=self.track.time[at],
                    record=self.track.record[at],
                    noise=self.track.noise[at],
                    lead=self.track.lead[at],
                    past=self.track.past[at],
                )
            )
        return found

    @cached_property
    def _rows(self) -> list[slice]:
        """Rows of the residual of each recording."""
        n = self.residual.shape[0]
        first = [int(start) for start in self.track.starts]
        begins = [first[self.track.record.index(number)] for number in self.records]
        return [slice(begin, end) for begin, end in zip(begins, [*begins[1:], n], strict=True)]

    @cached_property
    def _blocks(self) -> list[tuple[int, slice]]:
        """Recording, from 0, and rows of each block."""
        found = []
        for k, rows in enumerate(self._rows):
            bounds = [rows.start + int(at) for at in blocks_of(self.track, rows.stop - rows.start)]
            found += [(k, slice(begin, end)) for begin, end in zip(bounds, [*bounds[1:], rows.stop], strict=True)]
        return found

    @cached_property
    def _products(self) -> Array:
        """Sums of products of residual and derivatives over each block, shape ``(n_blocks, 1 + n_names, 1 + n_names)``."""
        columns = np.column_stack([self.residual, self.jacobian])
        return np.array([columns[rows].T @ columns[rows] for _, rows in self._blocks])

    def _shared(self, own: Sequence[str]) -> list[int]:
        """Numbers of the parameters that all recordings share."""
        return [k for k, name in enumerate(self.names) if self.usable[k] and name not in own and name != GAIN]

    def _changes(self, own: Sequence[str]) -> tuple[Array, Array]:
        """With each block left out, what the values come to more, in units of their scale, and what is left in that block.

        Shapes ``(n_blocks, n_shared + n_own * n_records)`` and ``(n_blocks,)``; own values are ordered by parameter.
        """
        shared, apart = self._shared(own), [self.names.index(name) for name in own]
        n, n_records = len(shared) + len(apart) * len(self.records), len(self.records)
        base = np.array([*shared, *apart], dtype=np.int64) + 1
        places = [
            np.array([*range(len(shared)), *(len(shared) + i * n_records + k for i in range(len(apart)))], dtype=np.int64)
            for k in range(n_records)
        ]
        normal, load = np.zeros((len(self._blocks), n, n)), np.zeros((len(self._blocks), n))
        for b, (k, _) in enumerate(self._blocks):
            normal[b][np.ix_(places[k], places[k])] = self._products[b][np.ix_(base, base)]
            load[b, places[k]] = self._products[b][base, 0]
        whole, size = np.sum(normal, axis=0), np.sqrt(np.maximum(np.diag(np.sum(normal, axis=0)), 1e-300))
        kept = (whole - normal) / np.outer(size, size) + np.diag(np.finfo(np.float64).eps + self.held / size**2)
        change = -np.linalg.solve(kept, ((np.sum(load, axis=0) - load) / size)[..., None])[..., 0] / size
        own_part = np.einsum("bi,bij,bj->b", change, normal, change) + 2.0 * np.sum(change * load, axis=1)
        return change, self._products[:, 0, 0] + own_part

    def left(self, own: Sequence[str] | None = None) -> float:
        """Sum of squares on blocks left out [F^2], with own values of those that have them, or of the parameters ``own``."""
        unseen = float(np.sum(self._changes(self.own if own is None else own)[1]))
        return self.minded * unseen

    def promised(self) -> dict[str, float]:
        """What stays at first order with own values of one more parameter, by its name [F^2]."""
        names = [name for name, usable in zip(self.names, self.usable, strict=True) if usable and name not in self.own]
        return {name: self.left((*self.own, name)) for name in names}

    def fitted(self, own: tuple[str, ...]) -> Own:
        """The same with own values of the parameters ``own`` and of no others, all values fitted in full."""
        shared, apart = self._shared(own), [self.names.index(each) for each in own]
        n_records = len(self.records)
        lower, upper = self._bounds()

        def at(point: Array) -> Array:
            values = np.tile(np.append(np.mean(self.values, axis=0)[:-1], 1.0), (n_records, 1))
            values[:, shared] = point[: len(shared)] * self.scale[shared]
            values[:, apart] = point[len(shared) :].reshape(len(apart), n_records).T * self.scale[apart]
            return values

        def joined(of_each: Array) -> Array:
            return np.concatenate([of_each[shared], np.repeat(of_each[apart], n_records)])

        now = self.values / self.scale
        start = np.concatenate([np.mean(now, axis=0)[shared], now[:, apart].T.ravel()])
        limits = joined(lower), joined(upper)
        # Where first order leads nowhere, it is begun from where it is.
        starts = [np.clip(each, *limits) for each in (start, start + np.mean(self._changes(own)[0], axis=0))]
        start = min(starts, key=lambda point: float(np.sum(self._lacking(at(point)) ** 2)))
        answer = minimise(
            lambda point: self._lacking(at(point)),
            start,
            *limits,
            difference=5e-3,  # as for any model (:meth:`.track.Track.fit`)
            point_tolerance=1e-4,
            cost_tolerance=1e-5,
            max_iterations=FIRST_FIT,
            secant=True,
            threads=n_threads(),
        )
        there = replace(self, own=own, values=at(answer.point), residual=answer.residual)
        jacobian = np.column_stack([there._derivative(k) for k in range(len(self.names))])
        return replace(there, jacobian=jacobian)

    def _bounds(self) -> tuple[Array, Array]:
        """Least and largest value of each parameter, in units of its scale."""
        bounds = bounds_of(self.model, scales_of(self.track))
        lower, upper = limits_of(self.model, self.names[:-1], self.scale[:-1], bounds)
        return np.append(lower, 0.1), np.append(upper, 10.0)  # of the gain: another unit is told by the instrument

    def _lacking(self, values: Array) -> Array:
        """The force that the model lacks with ``values``, shape ``(n_records, n_names)``, in units of the recorded one [F]."""
        parts = []
        for track, of_record in zip(self._apart, values, strict=True):
            model = self.model.with_values(self._placed(of_record))
            gain = float(of_record[-1])
            parts.append(track.residual(model, _scaled(track, gain)) / gain)
        return np.concatenate(parts)

    def _placed(self, values: Array) -> Array:
        every = self.model.values
        for name, value in zip(self.names[:-1], values, strict=False):
            every[self.model.names.index(name)] = value
        return every

    def _derivative(self, number: int) -> Array:
        """Of the residual by a parameter in all recordings at once, per its scale."""
        moved = self.values.copy()
        step = 5e-3 * max(abs(float(np.mean(moved[:, number]))) / self.scale[number], 1.0)
        moved[:, number] += step * self.scale[number]
        return np.asarray((self._lacking(moved) - self.residual) / step)

    def _by_gain(self) -> Array:
        return self._derivative(len(self.names) - 1)

    @property
    def n_additional(self) -> int:
        """Values more than a model has that all recordings share."""
        return len(self.own) * (len(self.records) - 1)

    def differing(self, name: str) -> Differing:
        """By what the parameter ``name`` differs in the recording without which its values are most alike."""
        at, n_records = self.names.index(name), len(self.records)
        first = len(self._shared(self.own)) + self.own.index(name) * n_records
        moved = self._changes(self.own)[0][:, first : first + n_records] * self.scale[at]
        values = self.values[:, at]
        if name == GAIN:  # the force agrees when it is multiplied by these; only their ratios are known
            values, moved = -np.log(values), -moved / values
        stds = np.sqrt([self._variance(moved @ each) for each in np.eye(n_records)])
        certainty = 1.0 / np.maximum(stds, 1e-300) ** 2
        weights = np.tile(certainty, (n_records, 1)) * (1.0 - np.eye(n_records))
        weights /= np.sum(weights, axis=1, keepdims=True)
        unlike = [float(np.sum(row * (values - row @ values) ** 2 * certainty)) for row in weights]
        odd = int(np.argmin(unlike))
        contrast = np.eye(n_records)[odd] - weights[odd]
        std = float(np.sqrt(self._variance(moved @ contrast)))
        blocks = min(sum(record == k for record, _ in self._blocks) for k in range(n_records))
        reach = std * float(student.ppf(0.975, blocks - 1))
        others = float(weights[odd] @ values)
        # F test of their scatter about their mean
        agree = n_records < 3 or unlike[odd] / (n_records - 2) < float(f_ratio.ppf(0.95, n_records - 2, blocks - 1))
        if name == GAIN:
            values = np.exp(values - others)
            stds, std, reach, others = stds * values, std * values[odd], reach * values[odd], 1.0
        difference = float(values[odd]) - others
        return Differing(name, self.records[odd], values, stds, others, difference, float(std), float(reach), bool(agree))

    def _variance(self, moved: Array) -> float:
        """Of what is ``moved`` so far where each block is left out, shape ``(n_blocks,)``."""
        of_block = np.array([record for record, _ in self._blocks])
        found = 0.0
        for k in range(len(self.records)):
            of_record = moved[of_block == k]
            n = of_record.shape[0]
            found += (n - 1) / n * float(np.sum((of_record - np.mean(of_record)) ** 2))
        return found


def _scaled(track: Track, gain: float) -> Twin | None:
    """The recordings themselves, with the force times ``gain``."""
    if gain == 1.0:
        return None
    same = track.with_effort(0.0)
    return replace(same, efforts=tuple(gain * effort for effort in same.efforts))
