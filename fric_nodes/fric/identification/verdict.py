"""What a recording could not determine: messages before and after a fit.

Before: parameters whose columns are the same but for a factor (a bias and an asymmetric Coulomb level while sliding) can't
be told apart; the later one is held and named, with the experiment that would separate them. After: parameters with large
standard errors, strong correlations, or values at a bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..model import Model
from ..record import Array, Mask
from .free_parameters import FreeParameters

__all__ = ["Twin", "collinear", "warnings_of"]

_SAME = 0.02  # part of a column that the others leave over: less, and the split between them is made by noise
_UNSURE = 0.2  # relative standard error
_CORRELATED = 0.98


@dataclass(frozen=True)
class Twin:
    """A parameter that can't be told from others in this recording, and the sentence that says so."""

    name: str
    message: str


def collinear(model: Model, columns: Array, free: FreeParameters, use: Mask) -> list[Twin]:
    """The linear parameters whose column the ones before it already span.

    Args:
        model: for the sentence.
        columns: regressors of the free parameters, shape ``(n_rows, n_free)``; zero where not linear.
        free: the free parameters.
        use: rows of the fit.
    """
    basis: list[Array] = []
    spans: list[str] = []
    twins = []
    # What a model can do without (a parameter with a default) gives way to what it can't.
    optional = [parameter.declaration.default is not None for parameter in model.parameters()]
    # The shape of these columns is still to be found: what they look like at its start value decides nothing.
    open_terms = {name.split(".")[0] for name in free.only(False).names if "." in name}
    for number in sorted(range(len(free.names)), key=lambda k: optional[int(free.index[k])]):
        name = free.names[number]
        if not free.linear[number] or name.split(".")[0] in open_terms:
            continue
        column = columns[use, number]
        size = float(np.linalg.norm(column))
        rest = column.copy()
        shares = []
        for direction in basis:
            share = float(direction @ rest)
            shares.append(abs(share) / size if size > 0 else 0.0)
            rest = rest - share * direction
        left = float(np.linalg.norm(rest))
        if size > 0 and left > _SAME * size:
            basis.append(rest / left)
            spans.append(name)
            continue
        others = [spans[k] for k in np.argsort(shares)[::-1][:2] if shares[k] > 0.3]
        twins.append(Twin(name, _twin_message(model, name, others, model.value(name))))
    return twins


def _twin_message(model: Model, name: str, others: list[str], value: float) -> str:
    if not others:
        return f"{name} leaves no trace in this recording and is held at {value:g}: excite what it depends on"
    message = f"{name} can't be told from {' and '.join(others)} in this recording and is held at {value:g}"
    effect = name.split(".", maxsplit=1)[0].split("#", maxsplit=1)[0]
    related = {other.split(".")[0].split("#")[0] for other in others}
    for held in model.terms:
        for other, experiment in held.effect.looks_like.items():
            if held.effect.id in {effect} and other in related:
                return f"{message}; to separate them, {experiment}"
    return f"{message}; to separate them, record motion in both directions and at several accelerations"


def warnings_of(model: Model, free: FreeParameters, covariance: Array) -> tuple[list[str], str]:
    """Warnings about the fitted values, and the status sentence that says what to do next."""
    warnings = []
    variance = np.diag(covariance)
    known = variance >= 0.0  # False for NaN: what isn't known is not small
    errors = np.sqrt(np.where(known, variance, np.inf))
    values = model.values[free.index]
    declared = list(model.parameters())
    bound = free.at_bound(model)
    unsure = []
    for number, name in enumerate(free.names):
        unit = declared[int(free.index[number])].declaration.unit(model.units)
        value, error = float(values[number]), float(errors[number])
        if bound[number]:
            unsure.append(name)
            warnings.append(f"{name} lies on its bound ({value:.3g} {unit}): this recording does not determine it")
        elif not known[number]:
            unsure.append(name)
            warnings.append(f"{name} is not determined: {value:.3g} {unit}, with no standard error")
        elif error > _UNSURE * abs(value):
            unsure.append(name)
            warnings.append(f"{name} is hardly determined: {value:.3g} +- {error:.2g} {unit}")
    scale = np.where(errors > 0, errors, np.inf)
    correlation = np.where(np.isfinite(covariance), covariance, 0.0) / np.outer(scale, scale)
    for i in range(len(free.names)):
        for j in range(i):
            if abs(correlation[i, j]) > _CORRELATED:
                pair = f"{free.names[j]} and {free.names[i]}"
                warnings.append(f"{pair} are coupled (correlation {correlation[i, j]:+.3f}): only a combination is known")
    if unsure:
        return warnings, f"converged; not to be relied on: {', '.join(unsure)}. Excite them more, or leave their terms out"
    return (
        warnings,
        "converged; every fitted parameter is determined to better than 20 %. Check it on a recording of its own (--validate)",
    )
