"""Two-stage identification of a DNLRX (Amthor et al. 2008, section 3.1): from recordings to filters, thresholds and offset.

    [d Phi] = arg min_d { min_Phi J(Phi, d) }                                                  (18)

Thresholds d outside (:mod:`.search`), everything linear inside (:mod:`.cost`), over every hundredth sample; with
the thresholds found, the linear parameters are then solved for over all samples.

What the paper leaves open: its lambda is not "specified in Eq. 15", where it is but the lower limit of the sum; it is the first
sample with all its past, max(n, n_delta) after t_sl. "Only carried out at every hundredth data pair" can't mean that the
displacement is decimated: deformations need every turning point. Here the sum of Eq. 15 is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...friction.dnlrx import DnlrxError, DnlrxModel, DnlrxSimulator, poles
from ...record import Array, Record
from ..result import IdentificationError, Options
from .cost import Cost
from .linear import affordable, covariance, names_of, rows_of, solve
from .order import Order, Trial, choose_order, decimation_for, n_parameters
from .samples import Prepared, prepare
from .search import Found, search

__all__ = ["DECIMATION", "DnlrxFit", "fit_dnlrx", "fit_prepared", "name"]

DECIMATION = 100
_POOR = 5.0  # [%] NOE from which a DNLRX doesn't explain the recording
_SPRINGY = 0.05  # of the force's range that may come from the displacement itself
_NEAR = 0.05  # of a natural logarithm: a threshold this close to a bound lies on it
_ROWS_PER_PARAMETER = 4


@dataclass(frozen=True, eq=False)
class DnlrxFit:
    """Result of the two-stage identification.

    Attributes:
        model: the DNLRX.
        names: of the linear parameters in the order of Eq. 17 and then the thresholds.
        covariance: of them, residual correlation taken into account; zero for what wasn't determined.
        undetermined: names of linear parameters that could not be told from others; they are zero.
        noe: over every sample that was fitted [%].
        found: how the search went.
        decimation: every how many samples entered it.
        trials: the orders that were tried; empty when the order was given.
        prepared: what was fitted.
        status: what was reached, and what to do next.
        warnings: what a user should know before trusting it.
    """

    model: DnlrxModel
    names: tuple[str, ...]
    covariance: Array
    undetermined: tuple[str, ...]
    noe: float
    found: Found
    decimation: int
    trials: tuple[Trial, ...]
    prepared: Prepared
    status: str
    warnings: tuple[str, ...]

    def validate(self, records: Sequence[Record]) -> float:
        """NOE on other recordings [%], filtered alike; each counts from its own t_sl on.

        Raises:
            IdentificationError: they can't be used, or have another sample time.
        """
        prepared = prepare(records, Options(cutoff=self.prepared.cutoff))
        if abs(prepared.sample_time / self.model.sample_time - 1.0) > 1e-3:
            raise IdentificationError(
                records[0].source,
                f"sampled every {prepared.sample_time:.4g} s, and the DNLRX holds for {self.model.sample_time:.4g} s",
                "record at the rate of the identification",
            )
        return prepared.noe(self.model)


def fit_dnlrx(
    records: Sequence[Record],
    order: Order | None = None,
    options: Options | None = None,
    seed: int = 0,
) -> DnlrxFit:
    """Identify a DNLRX from ``records``.

    Args:
        records: each with a long stroke early on, all of one sample time.
        order: ``(M, n_delta, n)``; None: chosen on held-out samples, without the second filter.
        options: ``cutoff`` [Hz] of the low-pass and ``decimation`` count; None: 50 Hz, 100.
        seed: of the search.

    Raises:
        IdentificationError: the recordings can't determine it.
    """
    options = Options() if options is None else options
    return fit_prepared(prepare(records, options), order, options, seed)


def fit_prepared(prepared: Prepared, order: Order | None = None, options: Options | None = None, seed: int = 0) -> DnlrxFit:
    """As :func:`fit_dnlrx`, from samples that are prepared already."""
    wanted = DECIMATION if options is None or options.decimation is None else options.decimation
    trials: tuple[Trial, ...] = ()
    if order is None:
        order, trials = choose_order(prepared, wanted, seed)
    elif min(order) < 0:
        raise IdentificationError("DNLRX", f"order {name(order)} has a negative number", "give (M, n_delta, n)")
    if prepared.n_samples < _ROWS_PER_PARAMETER * n_parameters(order):
        raise IdentificationError(
            "DNLRX",
            f"{prepared.n_samples} samples for the {n_parameters(order)} parameters of {name(order)}",
            "record for longer, or choose a smaller order",
        )
    every = decimation_for(prepared, order, wanted)
    found = _searched(prepared, order, every, seed)
    linear = solve(prepared, found.thresholds, order, affordable(prepared.parts, order))
    noe = prepared.noe(linear.model)
    warnings, status = _judged(prepared, linear.model, linear.undetermined, noe)
    return DnlrxFit(
        model=linear.model,
        names=names_of(order),
        covariance=covariance(prepared, linear),
        undetermined=linear.undetermined,
        noe=noe,
        found=found,
        decimation=every,
        trials=trials,
        prepared=prepared,
        status=status,
        warnings=tuple(warnings),
    )


def _searched(prepared: Prepared, order: Order, every: int, seed: int) -> Found:
    """Thresholds over every ``every``-th sample; a second filter makes the cost so rough that they are first found without."""
    n_springs, n_delta, n = order
    known = _searched(prepared, (n_springs, 0, n), every, seed).thresholds if n_delta and n_springs else None
    cost = Cost(prepared.parts, order, rows_of(prepared.parts, order, every))
    return search(cost, prepared.lowest, prepared.highest, seed, known)


def name(order: Order) -> str:
    """As the paper writes it: ``(10,0,3)``."""
    return f"({','.join(str(number) for number in order)})"


def _judged(prepared: Prepared, model: DnlrxModel, undetermined: tuple[str, ...], noe: float) -> tuple[list[str], str]:
    """Warnings, and the status that says what to do next."""
    warnings = []
    next_steps = []
    thresholds = model.thresholds
    if thresholds.size and np.log(prepared.highest / thresholds[-1]) < _NEAR:
        warnings.append(f"the largest threshold lies on its bound, half of the shortest long stroke ({prepared.highest:.3g})")
        next_steps.append("record longer strokes, until the force no longer rises with their length")
    if thresholds.size and np.log(thresholds[0] / prepared.lowest) < _NEAR:
        warnings.append(f"the smallest threshold lies on its bound, the noise of the position ({prepared.lowest:.2g})")
        next_steps.append("use fewer springs, or a position signal with less noise")
    if thresholds.size > 1 and float(np.min(np.diff(np.log(thresholds)))) < 0.02:
        warnings.append("two thresholds are nearly the same: only the sum of their springs is known")
        next_steps.append("use fewer springs")
    reach = float(np.sum(model.position_filter)) * 2.0 * prepared.highest
    if reach > _SPRINGY * max(float(np.ptp(part.force)) for part in prepared.parts):
        warnings.append(
            f"the force rises with the displacement by {reach:.3g} over {2.0 * prepared.highest:.3g}: a spring to the frame, "
            "or friction that doesn't slide within these strokes"
        )
        next_steps.append("record longer strokes, until the force no longer rises with their length")
    if undetermined:
        warnings.append(f"{', '.join(undetermined)} can't be told from the rest and are zero")
        next_steps.append("use a smaller order, or record faster and more varied motion")
    if model.order[1] > 0:
        warnings.append("with n_delta > 0 the predicted force steps where springs begin to slide: no good as a feedforward")
    try:
        DnlrxSimulator(model)
        unstable = max(float(part.max(initial=0.0)) for part in poles(model)) > 1.0 + 1e-6
    except DnlrxError:
        unstable = True
    if unstable:
        warnings.append("it predicts force from motion; simulating motion from force with it isn't stable")
    if noe > _POOR:
        next_steps.insert(
            0, "look whether force and position belong together (delay, sign), and whether friction decreases with speed"
        )
        return warnings, f"converged, but {noe:.3g} % of the force's variance is left: {'; '.join(dict.fromkeys(next_steps))}"
    if next_steps:
        return warnings, f"converged; {'; '.join(dict.fromkeys(next_steps))}"
    return warnings, "converged; every threshold lies between noise and travel. Check it on a recording of its own (--validate)"
