"""What is missing by sparse regression: the missing force as a sum of few of the columns of a library.

Discrepancy modelling by SINDy (Kaheman, Kaiser, Strom, Kutz, Brunton 2019, arXiv:1909.08574) regresses what a model lacks on a
library of functions and drops those with small coefficients again and again (sequentially thresholded least squares, here
PySINDy's). The lasso does it by a price on the coefficients (here scikit-learn's; what stays is fitted once more without it).
Both get the library that the diagnosis screens: every effect that it knows with the most promising of its values, followed by
the same observer, in which the parameters of the refit are free as well. How sparse it is to be is decided on blocks left out:
the sparsest whose error is within a standard error of the least one.

Both are entries of an examination (:func:`fric.diagnosis.prove.examination.hold`), so that they answer to the same cases.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..diagnosis.along import Along
from ..diagnosis.candidates import candidates, place_of, scales_of
from ..diagnosis.confidence import UNEXPLAINED
from ..diagnosis.fitting import State, best_track
from ..diagnosis.screen import Promise, columns_of
from ..diagnosis.start import started
from ..diagnosis.track import Track
from ..model import Model
from ..record import Array, Record

__all__ = ["ENTRIES", "Found", "by_lasso", "by_sindy", "chosen"]

_BLOCKS = 5
_STRENGTHS = np.geomspace(0.02, 1.0, 14)
"""How large a standardised coefficient has to be, the missing force having the size 1."""
_OWN = 0.02  # of a column's size: what the refit leaves of one that isn't the refit by another name
_RIDGE = 1e-3  # keeps columns that are alike regular
_ROWS = 6000  # of a low-passed force no more are needed

Path = Callable[[Array, Array], Array]
"""Coefficients for each of the strengths, shape ``(n_strengths, n_columns)``, of columns ``(n, n_columns)`` and a target."""


@dataclass(frozen=True)
class Found:
    """What a regression found, as an examination takes it.

    Attributes:
        shares: of the missing energy that each effect explains, by its id, the largest first.
        left: share of the missing energy that stays.
        places: component of each effect.
        prediction: nothing.
    """

    shares: dict[str, float]
    left: float
    places: dict[str, str]
    prediction: tuple[Any, ...] = field(default=())

    def report(self) -> dict[str, Any]:
        """``report.json``, as far as a regression can say it."""
        findings = [
            {"effect": name, "confidence": min(share, 1.0), "where": {"component": self.places[name]}}
            for name, share in self.shares.items()
        ]
        if findings and self.left > UNEXPLAINED:
            where = findings[0]["where"]
            findings.insert(0, {"effect": "unknown", "confidence": min(self.left, 1.0), "where": where})
        return {"mismatch": bool(findings), "findings": findings}


def by_sindy(train: Sequence[Record], validation: Sequence[Record], nominal: Model) -> Found:
    """By sequentially thresholded least squares; arguments as of :func:`fric.diagnosis.diagnose.diagnose`."""
    return _regressed(train, nominal, _thresholded)


def by_lasso(train: Sequence[Record], validation: Sequence[Record], nominal: Model) -> Found:
    """By the lasso; arguments as of :func:`fric.diagnosis.diagnose.diagnose`."""
    return _regressed(train, nominal, _lasso)


def _regressed(train: Sequence[Record], nominal: Model, path: Path) -> Found:
    tracks, start = started(nominal, train)
    track, state = best_track(tracks, start)
    names, columns = _library(track, state)
    step = max(state.fit.residual.shape[0] // _ROWS, 1)
    target, jacobian, columns = -state.fit.residual[::step], state.fit.jacobian[::step], columns[::step]
    size = np.linalg.norm(jacobian, axis=0)
    basis, _ = np.linalg.qr(jacobian[:, size > 0.0] / size[size > 0.0])
    whole = np.linalg.norm(columns, axis=0)
    columns, target = columns - basis @ (basis.T @ columns), target - basis @ (basis.T @ target)
    own = np.linalg.norm(columns, axis=0)
    kept = np.isfinite(own) & (own > _OWN * whole)
    columns = columns[:, kept] / own[kept] * np.sqrt(target.shape[0])
    target = target / max(float(np.std(target)), 1e-300)
    coefficients = chosen(path, columns, target)
    shares: dict[str, float] = {}
    effects = [name for name, keep in zip(names, kept, strict=True) if keep]
    for name in dict.fromkeys(effects):
        of_it = [k for k, each in enumerate(effects) if each == name and coefficients[k] != 0.0]
        if of_it:
            shares[name] = float(np.mean((columns[:, of_it] @ coefficients[of_it]) ** 2))
    left = float(np.mean((target - columns @ coefficients) ** 2))
    places = {each.effect.id: place_of(each.effect) for each in candidates(nominal, scales_of(track))}
    return Found(dict(sorted(shares.items(), key=lambda each: -each[1])), left, places)


def _library(track: Track, state: State) -> tuple[list[str], Array]:
    """The effect of each column, and the columns, shape ``(n, n_columns)``: what each term adds to the force."""
    quick = Promise(Along(track), state.fit)
    kept = [quick.narrowed(each) for each in candidates(state.fit.model, scales_of(track))]
    columns = columns_of(track, state.fit, [trial for trials in kept for trial in trials])
    names = [column.term.effect.id for column in columns for _ in column.parts]
    return names, np.stack([part for column in columns for part in column.parts], axis=1)


def chosen(path: Path, columns: Array, target: Array) -> Array:
    """Coefficients of the sparsest regression whose error on blocks left out is within a standard error of the least one.

    Args:
        path: the kind of regression.
        columns: standardised, shape ``(n, n_columns)``.
        target: of variance 1, shape ``(n,)``.
    """
    rows = np.arange(target.shape[0]) * _BLOCKS // target.shape[0]
    errors = np.empty((_BLOCKS, _STRENGTHS.shape[0]))
    for block in range(_BLOCKS):
        out = rows == block
        fitted = path(columns[~out], target[~out])
        errors[block] = [float(np.mean((target[out] - columns[out] @ each) ** 2)) for each in fitted]
    mean = np.mean(errors, axis=0)
    least = int(np.argmin(mean))
    unsure = float(np.std(errors[:, least], ddof=1)) / np.sqrt(_BLOCKS)
    strongest = int(np.flatnonzero(mean <= mean[least] + unsure)[-1])
    return np.asarray(path(columns, target)[strongest], dtype=np.float64)


def _thresholded(columns: Array, target: Array) -> Array:
    from pysindy.optimizers import STLSQ

    found = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that a threshold drops every column is an answer
        for threshold in _STRENGTHS:
            optimiser = STLSQ(threshold=float(threshold), alpha=_RIDGE * target.shape[0])
            found.append(np.ravel(optimiser.fit(columns, target[:, None]).coef_))
    return np.array(found)


def _lasso(columns: Array, target: Array) -> Array:
    from sklearn.linear_model import lasso_path

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # columns that are alike converge slowly, and it matters little which of them stays
        _, coefficients, _ = lasso_path(columns, target, alphas=_STRENGTHS[::-1])
    return np.array([_again(columns, target, each) for each in coefficients.T[::-1]])


def _again(columns: Array, target: Array, coefficients: Array) -> Array:
    """The columns whose ``coefficients`` aren't zero, fitted without a price."""
    found, used = np.zeros(columns.shape[1]), coefficients != 0.0
    if np.any(used):
        a = columns[:, used]
        found[used] = np.linalg.solve(a.T @ a + _RIDGE * target.shape[0] * np.eye(a.shape[1]), a.T @ target)
    return found


ENTRIES = {
    "PySINDy's thresholded least squares": f"{__name__}:{by_sindy.__name__}",
    "lasso": f"{__name__}:{by_lasso.__name__}",
}
"""Of an examination, by what they are."""
