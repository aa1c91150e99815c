"""What every online estimator gives: the estimate so far, and what it is doing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

import numpy as np

from ...model import Model
from ...record import Array, Mask

__all__ = ["Estimate", "Estimator", "State", "model_with", "status_of"]


class State(IntEnum):
    """What the identifier is doing; numbers as in ``fric_interfaces/FrictionEstimate``."""

    IDLE = 0
    RUNNING = 1
    FROZEN = 2


@dataclass(frozen=True, eq=False)
class Estimate:
    """The estimate so far; arrays of shape ``(n_parameters,)``.

    Attributes:
        names: of the parameters estimated.
        values: in SI.
        standard_errors: NaN while nothing is known.
        covariance: shape ``(n_parameters, n_parameters)``.
        excited: True where the data determine the parameter to better than 20 %.
        residual_rms: of the force equation [F].
        samples_used: samples that went into the estimate.
        samples_rejected: samples that were refused (not finite, stamps not increasing).
        state: what the identifier is doing.
        status: the same in words, with what to do next.
    """

    names: tuple[str, ...]
    values: Array
    standard_errors: Array
    covariance: Array
    excited: Mask
    residual_rms: float
    samples_used: int
    samples_rejected: int
    state: State
    status: str


class Estimator(Protocol):
    """What an online estimator does.

    Attributes:
        state: what it is doing.
        samples_used: samples that went into the estimate.
        samples_rejected: samples that were refused.
        averages_force: True when :meth:`update` wants the force at the sample's own instant; False: as it was sent.
        hold: how a force as it was sent relates to the intervals beside its sample.
        title: of the method, in a sentence.
    """

    state: State
    samples_used: int
    samples_rejected: int
    averages_force: bool
    hold: str
    title: str

    def update(self, time: float, position: float, effort: float) -> bool:
        """Take one sample; True when the estimate has changed.

        Args:
            time: [s], increasing.
            position: [x].
            effort: [F].
        """

    def estimate(self) -> Estimate:
        """The estimate as it stands."""

    def model(self) -> Model:
        """The structure with the values estimated so far and their standard errors."""

    def freeze(self, frozen: bool) -> None:
        """Hold the estimate as it is, or go on."""

    def reset(self, structure: Model | None = None) -> None:
        """Forget everything; with ``structure``, estimate other terms from now on."""


def model_with(whole: Model, found: Estimate) -> Model:
    """``whole`` with the values and standard errors of an estimate; what isn't estimated stays as it is."""
    by_name = dict(zip(found.names, found.values.tolist(), strict=True))
    pairs = zip(found.names, found.standard_errors.tolist(), strict=True)
    errors = {name: error for name, error in pairs if np.isfinite(error)}
    return whole.with_values(np.array([by_name.get(p.name, p.value) for p in whole.parameters()]), errors)


def status_of(state: State, samples_used: int, names: Sequence[str], excited: Mask) -> str:
    """The state in words: which parameters aren't determined, and what to do about it."""
    if state is State.FROZEN:
        return "frozen: unfreeze to continue the estimation"
    if not samples_used:
        return "waiting for motion"
    if np.all(excited):
        return "every parameter is determined"
    missing = [name for name, good in zip(names, excited, strict=True) if not good]
    return f"not determined yet: {', '.join(missing)}; move at more speeds and accelerations, in both directions"
