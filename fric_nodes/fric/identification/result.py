"""What every identification method takes and gives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..model import Model
from ..record import Array, Record

if TYPE_CHECKING:
    from ..instrument import Finding
    from .foreseen import Foreseen

__all__ = ["Identification", "IdentificationError", "Method", "Options", "Score"]


class IdentificationError(InputError):
    """Recordings from which the model's parameters can't be determined."""


@dataclass(frozen=True)
class Options:
    """Settings of a fit; None lets the method choose from the data.

    Attributes:
        cutoff: of the zero-phase low-pass filter on the position [Hz].
        decimation: keep every n-th sample of the filtered equations.
        rest_velocity: a joint that stays slower than this rests, and tells nothing about sliding friction meanwhile [x/s].
        held: names of parameters to hold at their value.
        freed: names of shape parameters to fit as well.
        robust: weigh down outliers (Huber) instead of plain least squares.
        horizon: length of the free runs of an output-error fit [s]; None: the whole recording in one run.
        gains: P [F/x] and D [F s/x] of the feedback under which each recording was made, for oscillations; empty: not given.
        bounds: limits of parameters, ``(name, lower, upper)``, inside those that they are declared with.
        starts: number of starts of a search; the best end of all is taken.
        start_states: where the runs of an output-error fit start: as ``measured``; ``tied`` to that by its standard error;
            ``free``. Empty: for a whole recording tied where that error matters, else as measured; free for shorter runs.
        continuity: weight of the jumps from the end of one of these runs to the start of the next; 0: they may jump.
    """

    cutoff: float | None = None
    decimation: int | None = None
    rest_velocity: float | None = None
    held: tuple[str, ...] = ()
    freed: tuple[str, ...] = ()
    robust: bool = False
    horizon: float | None = None
    gains: tuple[tuple[float, float], ...] = ()
    bounds: tuple[tuple[str, float, float], ...] = ()
    starts: int = 1
    start_states: str = ""
    continuity: float = 0.0


@dataclass(frozen=True)
class Score:
    """How well a model explains recordings.

    Attributes:
        noe: normalised output error of the force, 100 sum (u - u_hat)^2 / sum (u - mean u)^2 [%] (Amthor 2008, Eq. 19).
        relative_force_error_percent: 100 ||u - u_hat|| / ||u|| [%].
        force_rmse: root mean square of u - u_hat [F].
        position_rmse: root mean square error of the position in a free run from the measured force [x].
        n_samples: number of force equations behind these figures.
    """

    noe: float
    relative_force_error_percent: float
    force_rmse: float
    position_rmse: float
    n_samples: int


@dataclass(frozen=True, eq=False)
class Identification:
    """Result of a fit.

    Attributes:
        model: the structure with the values found and their standard errors.
        fitted: names of the parameters that were fitted, in the order of ``covariance``.
        covariance: shape ``(n_fitted, n_fitted)``, residual correlation taken into account; NaN for a parameter on its bound.
        method: id of the method.
        status: what was reached, and what to do next.
        warnings: what a user should know before trusting the values.
        notes: what was dropped or left out of the recordings, and why.
        train: score on the recordings that were fitted.
        validation: score on recordings that no fit has seen, or None.
        foreseen: what was known before the fit about what the recordings can tell, or None.
        checks: what was found about the recordings themselves.
    """

    model: Model
    fitted: tuple[str, ...]
    covariance: Array
    method: str
    status: str
    train: Score
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    validation: Score | None = None
    foreseen: Foreseen | None = None
    checks: tuple[Finding, ...] = ()

    @property
    def correlation(self) -> Array:
        """Correlation matrix of the fitted parameters, shape ``(n_fitted, n_fitted)``."""
        deviation = np.sqrt(np.diag(self.covariance))
        scale = np.where(deviation > 0, deviation, 1.0)
        return np.asarray(self.covariance / np.outer(scale, scale), dtype=np.float64)

    @property
    def attachments(self) -> Mapping[str, str]:
        """What a method has found besides the model: texts of files to write beside it, by name."""
        return {}

    def remarks_on(self, validation: Sequence[Record]) -> tuple[str, ...]:
        """What the method has to say about recordings that the fit has not seen, besides the model's score."""
        return ()


@dataclass(frozen=True, eq=False)
class Method:
    """One identification method.

    Attributes:
        id: name on the command line.
        title: name in a sentence.
        needs: which experiment it needs.
        source: paper.
        fit: structure (a model whose values are the start), recordings and options to a result.
        predicts: what it compares with the recording sample by sample, for statements before a fit: ``force`` along the motion,
            ``position`` from one sample to the next; empty where a fit sees something else.
        needs_force: False where no force need act, as in a free oscillation; otherwise one that never changes is refused.
    """

    id: str
    title: str
    needs: str
    source: str
    fit: Callable[[Model, Sequence[Record], Options], Identification] = field(repr=False)
    predicts: str = ""
    needs_force: bool = True
