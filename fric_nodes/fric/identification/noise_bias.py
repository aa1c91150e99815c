"""What errors of the position do to a fit of the force, found by making them once more, and taken off.

With errors of the same kind added to the recorded position, the fit moves from theta to theta'. To first order in their
variance the errors that are in the recording have moved it as far already, so that 2 theta - theta' is free of them
(simulation and extrapolation, Cook and Stefanski 1994, with one step). Each draw is added and subtracted, so that what is odd
in it cancels. How large the errors are is known to a share only; the same share of what is taken off is added to the
uncertainty.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..model import Model
from ..record import Array, Index, Mask
from ..signals.instrument_noise import errors_like
from .equations import Equations
from .free_parameters import FreeParameters
from .row_rate import UNSURE
from .scoring import driving_force, force_along

__all__ = ["noise_bias", "timing_covariance", "unsure_by"]

_DRAWS = 2
_DIFFERENCE = 1e-4


def noise_bias(model: Model, found: Equations, free: FreeParameters, weight: Array, inside: Mask) -> Array:
    """By how much errors of the position have moved the free parameters of ``model``, shape ``(n_free,)``.

    Args:
        model: with its values.
        found: the equations that it was fitted to.
        free: what was fitted.
        weight: of each squared residual, shape ``(n_rows,)``.
        inside: free parameters that lie within their bounds.
    """
    random = np.random.default_rng(2)
    moved = np.zeros((2 * _DRAWS, free.index.shape[0]))
    for k in range(_DRAWS):
        errors = [errors_like(s.raw_position, s.position, random, s.level) for s in found.stretches]
        for j, sign in enumerate((1.0, -1.0)):
            noisy = tuple(s.along(s.raw_position + sign * e) for s, e in zip(found.stretches, errors, strict=True))
            moved[2 * k + j, inside] = _step(model, replace(found, stretches=noisy), free.index[inside], weight)
    return np.asarray(np.mean(moved, axis=0) - _first(model, found, free, weight, inside))


def _first(model: Model, found: Equations, free: FreeParameters, weight: Array, inside: Mask) -> Array:
    """The same step without errors: nothing where ``model`` is the minimum."""
    step = np.zeros(free.index.shape[0])
    step[inside] = _step(model, found, free.index[inside], weight)
    return step


def _step(model: Model, found: Equations, index: Index, weight: Array) -> Array:
    """One Gauss-Newton step of the parameters ``index`` on the rows of ``found``."""
    values = model.values
    target = driving_force(model, found)

    def residual(at: Array) -> Array:
        trial = model.with_values(at)
        return target - found.rows(lambda stretch: force_along(trial, stretch))

    now = residual(values)
    columns = []
    for k in index.tolist():
        step = _DIFFERENCE * max(abs(values[k]), 1e-6)
        ahead = values.copy()
        ahead[k] += step
        columns.append((now - residual(ahead)) / step)
    root = np.sqrt(weight)
    jacobian = np.array(columns).T * root[:, None]
    size = np.linalg.norm(jacobian, axis=0)
    size[size == 0.0] = 1.0
    return np.asarray(np.linalg.lstsq(jacobian / size, root * now, rcond=1e-10)[0] / size)


def unsure_by(bias: Array) -> Array:
    """Covariance that taking ``bias`` off adds, shape ``(n_free, n_free)``."""
    return np.asarray(UNSURE**2 * np.outer(bias, bias))


def timing_covariance(found: Equations, jacobian: Array, weight: Array, inside: Mask, has_delay: bool) -> Array:
    """Covariance that not knowing when the force acts adds, shape ``(n_free, n_free)``.

    A force that acts later by tau is less by tau times its rate, to first order; each recording has a tau of its own.

    Args:
        found: the equations.
        jacobian: derivative of measured minus predicted force, shape ``(n_rows, n_free)``.
        weight: of each squared residual, shape ``(n_rows,)``.
        inside: free parameters that lie within their bounds.
        has_delay: True where the model's command path takes the time in as a value of its own.
    """
    errors = np.array([stretch.timing_error for stretch in found.stretches])
    covariance = np.zeros((jacobian.shape[1], jacobian.shape[1]))
    if has_delay or not np.any(errors):
        return covariance
    rate = found.rows(lambda s: s.timing_error * np.gradient(s.smooth(s.force), s.sample_time))
    root = np.sqrt(weight)
    scaled = root[:, None] * jacobian[:, inside]
    size = np.linalg.norm(scaled, axis=0)
    size[size == 0.0] = 1.0
    moved = np.linalg.lstsq(scaled / size, root * rate, rcond=1e-10)[0] / size
    covariance[np.ix_(inside, inside)] = np.outer(moved, moved)
    return covariance
