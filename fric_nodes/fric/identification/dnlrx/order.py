"""The order (M, n_delta, n) of a DNLRX, by what it predicts of samples that were not fitted.

The recording is cut into blocks; every third is held out. Thresholds and linear parameters of each order are found on the
others and judged on these: the deformations run through all samples, only the rows are divided. Of all orders whose error
isn't above the smallest by more than one standard error (of the difference, over the held-out blocks), the one with the fewest
parameters is taken (Breiman et al. 1984). First M is varied, then n and n_delta with the thresholds that were found for M.

Beside it stands the Bayesian information criterion, BIC = N ln(RSS/N) + p ln N, p = all parameters with the thresholds. Its N
takes residuals for independent: here it is the number of rows times (1 - rho)/(1 + rho), rho their first autocorrelation. It
isn't what decides, since residuals of a structure that is but close to the truth aren't noise.

An n_delta above 0 makes the predicted force step where springs begin to slide, see :mod:`fric.friction.dnlrx`. It is
tried and shown, and taken only when asked for. (The paper chose by an algorithm of Rizos and Fassois that it doesn't give.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...record import Array, Index
from .cost import Cost
from .linear import design, least_squares, rows_of
from .samples import Prepared
from .search import search

__all__ = ["Order", "Trial", "choose_order", "decimation_for"]

Order = tuple[int, int, int]

_SPRINGS = (1, 2, 3, 4, 5, 7, 10)
_POSITION_ORDERS = (2, 3, 4, 6)
_USUAL = 3
_BLOCKS = 24
_ROWS_PER_PARAMETER = 30
_TINY = 1e-300


@dataclass(frozen=True, eq=False)
class Trial:
    """One order.

    Attributes:
        order: ``(M, n_delta, n)``.
        fitted_noe: over the rows that were fitted [%].
        held_out_noe: over the rows held out [%].
        bic: Bayesian information criterion of the fit; only differences count.
        block_errors: mean squared error in each held-out block [F^2], shape ``(n_blocks,)``.
    """

    order: Order
    fitted_noe: float
    held_out_noe: float
    bic: float
    block_errors: Array

    @property
    def n_parameters(self) -> int:
        """Linear ones and thresholds."""
        return n_parameters(self.order)


def n_parameters(order: Order) -> int:
    """Linear parameters and thresholds of a DNLRX of this order."""
    n_springs, n_delta, n = order
    return n + 2 + (n_delta + 2) * n_springs


def decimation_for(prepared: Prepared, order: Order, wanted: int) -> int:
    """``wanted``, or less where so few rows would be left that they no longer determine the parameters."""
    return max(min(wanted, prepared.n_samples // (_ROWS_PER_PARAMETER * n_parameters(order))), 1)


def _divided(rows: Sequence[Index], n_total: int) -> tuple[list[Index], list[Index]]:
    """Rows to fit, and rows to judge by: every third of the blocks."""
    length = max(n_total // _BLOCKS, 1)
    held = [(at // length) % 3 == 1 for at in rows]
    return [at[~h] for at, h in zip(rows, held, strict=True)], [at[h] for at, h in zip(rows, held, strict=True)]


def _tried(prepared: Prepared, order: Order, every: int, thresholds: Array | None, seed: int) -> tuple[Trial, Array]:
    """``order`` on the fitted blocks, judged on the others; ``thresholds`` None: searched for."""
    parts = prepared.parts
    longest = max(part.position.shape[0] for part in parts)
    fitted, held = _divided(rows_of(parts, order, every), longest)
    if thresholds is None:
        thresholds = search(Cost(parts, order, fitted), prepared.lowest, prepared.highest, seed).thresholds
    columns, force = design(parts, thresholds, order, fitted)
    coefficients, _ = least_squares(columns, force)
    residual = force - columns @ coefficients
    columns, judged = design(parts, thresholds, order, held)
    error = (judged - columns @ coefficients) ** 2
    length = max(longest // _BLOCKS, 1)
    block = np.concatenate([at // length + 1000 * number for number, at in enumerate(held)])
    blocks = np.array([np.mean(error[block == each]) for each in np.unique(block)])
    rho = float(residual[1:] @ residual[:-1]) / max(float(residual @ residual), _TINY)
    n_effective = residual.shape[0] * (1.0 - max(rho, 0.0)) / (1.0 + max(rho, 0.0))
    bic = n_effective * np.log(max(float(np.mean(residual**2)), _TINY)) + n_parameters(order) * np.log(max(n_effective, 2.0))
    trial = Trial(
        order,
        100.0 * float(np.mean(residual**2) / np.var(force)),
        100.0 * float(np.mean(error) / np.var(judged)),
        float(bic),
        blocks,
    )
    return trial, thresholds


def _simplest(trials: Sequence[Trial]) -> Trial:
    """The one with the fewest parameters among those that are as good as the best but for one standard error."""
    best = min(trials, key=lambda trial: float(np.mean(trial.block_errors)))

    def as_good(trial: Trial) -> bool:
        more = trial.block_errors - best.block_errors
        if more.shape[0] < 2:
            return False
        return float(np.mean(more)) <= float(np.std(more, ddof=1) / np.sqrt(more.shape[0]))

    return min([best, *(trial for trial in trials if as_good(trial))], key=lambda trial: trial.n_parameters)


def choose_order(
    prepared: Prepared, decimation: int, seed: int = 0, most_springs: int = _SPRINGS[-1]
) -> tuple[Order, tuple[Trial, ...]]:
    """The order to use, and all that were tried."""
    found = {}
    trials = []
    for n_springs in (m for m in _SPRINGS if m <= most_springs):
        order = (n_springs, 0, _USUAL)
        trial, found[n_springs] = _tried(prepared, order, decimation_for(prepared, order, decimation), None, seed)
        trials.append(trial)
    n_springs = _simplest(trials).order[0]
    thresholds = found[n_springs]
    candidates = [trial for trial in trials if trial.order[0] == n_springs]
    for n in _POSITION_ORDERS:
        if n != _USUAL:
            order = (n_springs, 0, n)
            trial, _ = _tried(prepared, order, decimation_for(prepared, order, decimation), thresholds, seed)
            candidates.append(trial)
            trials.append(trial)
    chosen = _simplest(candidates).order
    for n_delta in (1, 3):
        order = (n_springs, n_delta, chosen[2])
        trials.append(_tried(prepared, order, decimation_for(prepared, order, decimation), thresholds, seed)[0])
    return chosen, tuple(trials)
