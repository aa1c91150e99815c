"""Online identification: recursive least squares on the same equations as offline, with forgetting only where there is news.

Samples are gathered into blocks, each block goes through the same zero-phase filters, regressors and decimation as a whole
recording (:mod:`fric.identification.equations`), and every row updates the estimate. Offline and online values
therefore differ by their weighting in time and by nothing else; the price is a latency of one block and two filter edges.

Forgetting is directional (Cao and Schwartz 2000): with information matrix R and regressor phi

    R <- R - n (1 - lambda) R phi phi' R / (phi' R phi) + phi phi',

so that old information fades only along directions in which new information comes in. A row takes one of n directions, so
it forgets n-fold there, and the whole fades by lambda per row on average. A parameter that the motion does not excite keeps
its value and its standard error, however long the axis rests or repeats itself: no wind-up, no drift.

The covariance is the sandwich R^-1 S R^-1, with S the forgetting sum of score products over blocks of time: correlated
residuals, which every real axis has, widen the intervals as they should. While there are too few blocks for that, the
white-noise formula widened by the residuals' first autocorrelation stands in.

A step change of friction shows as residuals of which other values of the parameters would explain nine times as much as
they usually would, in two blocks running. All but a moment's worth of the information from before the first of them then
goes, values return to what they were, and that block is learnt again from the row on that the old values can't explain.
(Packages for change points, such as ruptures, look for them in a whole series after its end.)
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from ...model import Model
from ...record import Array, Mask, Record, RecordError
from ...signals.stamps import evened
from ..equations import Equations, equations
from ..free_parameters import FreeParameters
from ..methods.inverse_dynamics import regressors
from ..rests import SLOW, can_stand_for
from ..result import IdentificationError, Options
from ..scoring import driving_force
from .blocks import Block, Known
from .estimate import Estimate, State, model_with, status_of

__all__ = ["OnlineIdentifier"]

_BLOCK_TIME = 0.5  # [s]
_MIN_BLOCKS_PER_PARAMETER = 3
_MOST_FORGOTTEN = 0.9  # of the information along one row, by that row
_GROWN = 1.02  # growth of the rest limit from which the blocks kept are judged anew
_BLOCKS_KEPT = 240
_CHANGED = 9.0  # what other values would explain of a block's residuals, beside what they usually would
_USUAL = 0.1  # share of a block in what is usual
_TOLD = 1e-3  # of a regressor's length, beside the others
_OLD = 0.05  # of a block: what old information counts after a change
_UNEXPLAINED = 5.0  # residuals of the old values, beside their usual root mean square, from which a row is of the new ones
_SPREAD = 2  # rows over which the low-pass filter spreads a step
_ROWS_PER_PARAMETER = 20  # behind what is called usual


class OnlineIdentifier:
    """Recursive estimator of the parameters in which a model's force is linear.

    Args:
        structure: the terms to estimate; its values are the start, its nonlinear parameters stay as they are.
        forgetting_time: how long information counts, in time of informative motion [s]; infinite: for ever.
        options: filter settings, as offline.
    """

    averages_force = True
    hold = "linear"
    title = "recursive least squares"

    def __init__(self, structure: Model, forgetting_time: float = 60.0, options: Options | None = None) -> None:
        self.options = Options() if options is None else options
        self.forgetting_time = forgetting_time
        self.state = State.RUNNING
        self._restart(structure)

    def _restart(self, structure: Model) -> None:
        slipping = [held for held in structure.terms if held.effect.slip is None]
        self._whole = structure
        self.structure = structure.with_terms(slipping)
        self._free = FreeParameters.of(self.structure, self.options).only(True)
        n = len(self._free.names)
        self._values = self.structure.values[self._free.index]
        self._forget(n)
        self._blocks: deque[Block] = deque(maxlen=_BLOCKS_KEPT)
        self._rest, self._only_clear = 0.0, True
        self.samples_rejected = 0
        self._clear_buffer()

    def _forget(self, n: int) -> None:
        """No information about the ``n`` parameters, whose values stay as they are."""
        self._information = np.zeros((n, n))
        self._scores = np.zeros((n, n))
        self._n_blocks = 0.0
        self._energy = self._lagged_energy = self._weight = 0.0
        self._last_residual = 0.0
        self._suspect: tuple[Block, Known] | None = None
        self._explained = 0.0
        self.samples_used = 0

    def _clear_buffer(self) -> None:
        self._time: list[float] = []
        self._position: list[float] = []
        self._effort: list[float] = []

    def reset(self, structure: Model | None = None) -> None:
        """Forget everything; with ``structure``, estimate other terms from now on."""
        self._restart(self._whole if structure is None else structure)

    def freeze(self, frozen: bool) -> None:
        """Hold the estimate as it is, or go on."""
        self.state = State.FROZEN if frozen else State.RUNNING
        self._clear_buffer()

    def update(self, time: float, position: float, effort: float) -> bool:
        """Take one sample; True when the estimate has changed.

        Args:
            time: [s], increasing.
            position: [x].
            effort: [F].
        """
        if self.state is not State.RUNNING:
            return False
        if not (math.isfinite(time) and math.isfinite(position) and math.isfinite(effort)):
            self.samples_rejected += 1
            return False
        if self._time and time <= self._time[-1]:
            self.samples_rejected += 1
            if time < self._time[0]:
                # The clock was set back (a machine or a recording started again): what is in the buffer belongs to the past.
                self._clear_buffer()
            return False
        self._time.append(time)
        self._position.append(position)
        self._effort.append(effort)
        if time - self._time[0] < self._block_span():
            return False
        return self._take_block()

    def _block_span(self) -> float:
        """Time that a block and its two filter edges take [s]."""
        n = len(self._time)
        step = (self._time[-1] - self._time[0]) / (n - 1) if n > 1 else 0.0
        cutoff = self.options.cutoff or min(0.1 / step, 100.0) if step > 0 else 100.0
        return max(_BLOCK_TIME, 30 * 10 * step) + 10.0 / cutoff

    def _take_block(self) -> bool:
        """Turn the buffer into equations, learn from them, and keep its end as the next block's first edge."""
        time = np.array(self._time)
        step = np.diff(time)
        if float(np.max(step)) > max(10.0 * float(np.median(step)), 0.05):
            after = int(np.argmax(step)) + 1
            for samples in (self._time, self._position, self._effort):
                del samples[:after]
            self.samples_rejected += after
            return False
        try:
            record = evened(
                Record(
                    time - time[0],
                    np.array(self._position),
                    np.array(self._effort),
                    effort_hold="linear",
                    source="joint states",
                )
            )
            found = equations([record], self.options)
        except (RecordError, IdentificationError):
            self._clear_buffer()
            return False
        sample_time = record.sample_time
        learnt = self._learn(found, sample_time)
        row_time = float(found.time[1] - found.time[0])
        edge = round(float(found.time[0]) / sample_time)
        done = round(found.time.shape[0] * row_time / sample_time)
        keep_from = min(done, len(self._time) - edge)
        for samples in (self._time, self._position, self._effort):
            del samples[:keep_from]
        return learnt

    def _learn(self, found: Equations, sample_time: float) -> bool:
        """Learn from a block; and again from those before it, when it shows that what they held was rest."""
        columns = regressors(self.structure, found)
        held = np.where([p.declaration.linear for p in self.structure.parameters()], self.structure.values, 0.0)
        held[self._free.index] = 0.0
        row_time = float(found.time[1] - found.time[0])
        force = driving_force(self.structure, found)
        every = np.ones_like(found.sliding)
        target = force - columns @ held
        block = Block(columns[:, self._free.index], target, found.velocity, found.rests, row_time, sample_time, every, every)
        self._blocks.append(block)
        rest = self._rest_limit()
        anew = rest > _GROWN * self._rest
        if anew:
            self._rest = rest
        for judged in self._blocks if anew else (block,):
            judged.judge(self._rest)
        if anew or self._enough_is_clear() != self._only_clear:
            self._only_clear = self._enough_is_clear()
            self._forget(len(self._free.names))
            learnt = [self._learn_block(earlier) for earlier in self._blocks]
        else:
            learnt = [self._learn_block(block)]
        if not np.any(block.sliding):
            # A long rest must not push out what tells how slow rest is.
            self._blocks.pop()
        return any(learnt)

    def _rest_limit(self) -> float:
        """Speed below which the joint may be at rest [x/s]: slow beside the fastest motion of the blocks kept."""
        if self.options.rest_velocity is not None:
            return self.options.rest_velocity
        return SLOW * float(np.quantile(np.abs(np.concatenate([block.velocity for block in self._blocks])), 0.98))

    def _enough_is_clear(self) -> bool:
        """Whether rows that no rest reaches into can stand for all in which the joint slides."""
        clear, sliding = (np.concatenate(masks) for masks in zip(*((b.clear, b.sliding) for b in self._blocks), strict=True))
        return can_stand_for(clear, sliding, np.concatenate([block.velocity for block in self._blocks]))

    def _learn_block(self, block: Block) -> bool:
        """Learn from the rows of ``block`` in which the joint slides."""
        rows = block.used(self._only_clear)
        suspicious = self._suspicious(block.rows[rows], block.target[rows])
        if suspicious and self._suspect is not None:
            self._begin_anew(*self._suspect)
            self._suspect = None
        elif suspicious is not None:
            self._suspect = (block, self._known_so_far()) if suspicious else None
        return self._learn_rows(block, rows)

    def _learn_rows(self, block: Block, rows: Mask) -> bool:
        """Learn from these ``rows`` of ``block``."""
        forgetting = math.exp(-block.row_time / self.forgetting_time) if math.isfinite(self.forgetting_time) else 1.0
        score = np.zeros(block.rows.shape[1])
        n_learnt = 0
        for phi, force in zip(block.rows[rows], block.target[rows], strict=True):
            if float(phi @ phi) > 0.0:
                score += phi * self._update(phi, float(force), forgetting)
                n_learnt += 1
        self.samples_used += n_learnt * round(block.row_time / block.sample_time)
        if n_learnt:
            fade = forgetting**n_learnt
            self._scores = fade * self._scores + np.outer(score, score)
            self._n_blocks = fade * self._n_blocks + 1.0
        return n_learnt > 0

    def _suspicious(self, rows: Array, target: Array) -> bool | None:
        """Whether the residuals of these rows, before they are learnt from, say that the axis has changed; None: too few."""
        n = self._values.shape[0]
        if rows.shape[0] < n or self._weight < _ROWS_PER_PARAMETER * n or self._energy <= 0.0:
            return None
        residual = target - rows @ self._values
        basis, triangle = np.linalg.qr(rows / np.maximum(np.linalg.norm(rows, axis=0), 1e-300))
        told = np.abs(np.diag(triangle)) > _TOLD
        explained = float(np.mean((basis.T @ residual)[told] ** 2)) if np.any(told) else 0.0
        usual = max(self._explained, self._energy / (self._weight - n))
        self._explained += _USUAL * (min(explained, _CHANGED * usual) - self._explained)
        return bool(explained > _CHANGED * usual)

    def _known_so_far(self) -> Known:
        return Known(
            self._values,
            self._information.copy(),
            self._scores,
            self._n_blocks,
            self._energy,
            self._lagged_energy,
            self._weight,
            self._last_residual,
            self._explained,
            self.samples_used,
        )

    def _begin_anew(self, block: Block, before: Known) -> None:
        """Let go what was known ``before``, and learn again from ``block``, the first after a change of the axis."""
        rows = block.used(self._only_clear)
        residual = block.target - block.rows @ before.values
        changed = np.nonzero(rows & (np.abs(residual) > _UNEXPLAINED * math.sqrt(before.energy / before.weight)))[0]
        if changed.size:
            # The low-pass filter spreads the change over its neighbours.
            rows = rows & (np.arange(rows.size) > changed[0] + _SPREAD)
        left = _OLD * float(np.sum(block.used(self._only_clear))) / before.weight
        self._values = before.values
        self._information = left * before.information
        self._scores = left * before.scores
        self._n_blocks = left * before.n_blocks
        self._energy = left * before.energy
        self._lagged_energy = left * before.lagged_energy
        self._weight = left * before.weight
        self._last_residual, self._explained = before.last_residual, before.explained
        self.samples_used = before.samples_used
        self._learn_rows(block, rows)

    def _update(self, phi: Array, force: float, forgetting: float) -> float:
        """One row into the estimate; the residual before it [F]."""
        residual = force - float(phi @ self._values)
        image = self._information @ phi
        along = float(phi @ image)
        if along > 0.0:
            share = min(phi.shape[0] * (1.0 - forgetting), _MOST_FORGOTTEN)
            self._information -= share / along * np.outer(image, image)
        self._information += np.outer(phi, phi)
        # Scaled, since the columns differ by orders of magnitude; the pseudo-inverse leaves directions without information
        # alone.
        scale = np.sqrt(np.maximum(np.diag(self._information), 1e-300))
        gain = np.linalg.pinv(self._information / np.outer(scale, scale), rcond=1e-9, hermitian=True) @ (phi / scale) / scale
        self._values = self._values + gain * residual
        after = force - float(phi @ self._values)
        self._energy = forgetting * self._energy + after * after
        self._lagged_energy = forgetting * self._lagged_energy + after * self._last_residual
        self._weight = forgetting * self._weight + 1.0
        self._last_residual = after
        return after

    def covariance(self) -> Array:
        """Covariance of the estimate, shape ``(n_parameters, n_parameters)``; NaN while nothing is known."""
        n = self._values.shape[0]
        if self._weight <= n:
            return np.full((n, n), np.nan)
        scale = np.sqrt(np.maximum(np.diag(self._information), 1e-300))
        bread = np.linalg.pinv(self._information / np.outer(scale, scale), rcond=1e-9, hermitian=True) / np.outer(scale, scale)
        variance = self._energy / (self._weight - n)
        rho = min(max(self._lagged_energy / self._energy, 0.0), 0.98) if self._energy > 0 else 0.0
        white = bread * variance * (1.0 + rho) / (1.0 - rho)
        if self._n_blocks <= _MIN_BLOCKS_PER_PARAMETER * n:
            return np.asarray(white, dtype=np.float64)
        correction = self._n_blocks / (self._n_blocks - n)
        return np.asarray(correction * bread @ self._scores @ bread, dtype=np.float64)

    def _known(self) -> Mask:
        """True for each parameter along whose axis there is information."""
        scale = np.sqrt(np.diag(self._information))
        known = scale > 0
        n = int(np.sum(known))
        if n == 0:
            return known
        part = self._information[np.ix_(known, known)] / np.outer(scale[known], scale[known])
        eigenvalues, vectors = np.linalg.eigh(part)
        blind = vectors[:, eigenvalues < 1e-6 * eigenvalues[-1]]
        known[known] = np.sum(blind**2, axis=1) < 1e-6
        return np.asarray(known, dtype=np.bool_)

    def estimate(self) -> Estimate:
        """The estimate as it stands."""
        covariance = self.covariance()
        known = self._known()
        errors = np.where(known, np.sqrt(np.maximum(np.diag(covariance), 0.0)), np.nan)
        values = np.clip(self._values, self._free.lower, self._free.upper)
        with np.errstate(invalid="ignore"):
            excited = known & (errors < 0.2 * np.abs(values))
        status = status_of(self.state, self.samples_used, self._free.names, np.asarray(excited, dtype=np.bool_))
        rms = math.sqrt(self._energy / self._weight) if self._weight > 0 else math.nan
        return Estimate(
            self._free.names,
            values,
            np.asarray(errors, dtype=np.float64),
            covariance,
            np.asarray(excited, dtype=np.bool_),
            rms,
            self.samples_used,
            self.samples_rejected,
            self.state,
            status,
        )

    def model(self) -> Model:
        """The structure with the values estimated so far and their standard errors; slip dynamics as they were given."""
        return model_with(self._whole, self.estimate())
