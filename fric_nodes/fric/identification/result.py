"""What every identification method takes and gives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..method_settings import Options, declarations, own_settings, parsed
from ..model import Model
from ..record import Array, Record

if TYPE_CHECKING:
    from ..instrument import Finding
    from .foreseen import Foreseen

__all__ = ["Identification", "IdentificationError", "Method", "Options", "Score"]


class IdentificationError(InputError):
    """Recordings from which the model's parameters can't be determined."""


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
        validation: score on recordings that no fit has used, or None.
        foreseen: what the recordings can determine, as found before the fit, or None.
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
        """Remarks of the method on recordings that the fit has not used, besides the model's score."""
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
            ``position`` from one sample to the next; empty where a fit uses something else.
        needs_force: False where no force need act, as in a free oscillation; otherwise one that never changes is refused.
        uses: names of the common settings that it honours; another one that is given is refused.
        settings: type of its options: the common ones, or a dataclass derived from them with settings of its own.
    """

    id: str
    title: str
    needs: str
    source: str
    fit: Callable[[Model, Sequence[Record], Options], Identification] = field(repr=False)
    predicts: str = ""
    needs_force: bool = True
    uses: tuple[str, ...] = ()
    settings: type[Options] = Options

    def __post_init__(self) -> None:
        unknown = [name for name in self.uses if name not in declarations(self.settings)]
        if unknown:
            raise TypeError(f"method '{self.id}' uses settings that are not declared: {', '.join(unknown)}")

    @property
    def honoured(self) -> tuple[str, ...]:
        """Names of all settings that it honours, its own ones too."""
        return (*self.uses, *own_settings(self.settings))

    def options(self, common: Options, own: Mapping[str, str]) -> Options:
        """The options with the method's own settings, from their texts by name.

        Raises:
            InputError: the method has no such setting, or the text can't be used.
        """
        known = own_settings(self.settings)
        for name in own:
            if name not in known:
                remedy = f"choose from {', '.join(known)}" if known else "leave it out"
                raise InputError(f"setting '{name}'", f"is not one of the method {self.id}", remedy)
        return self.settings(**vars(common), **{name: parsed(name, text, self.settings) for name, text in own.items()})
