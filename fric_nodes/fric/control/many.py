"""Compensators of many joints in one call: LuGre and DNLRX along the references of all, each operation over all joints at once.

Equations as of :mod:`fric.control.feedbacks.friction_observer`, without injection but with mass and viscous friction, and as of
:mod:`fric.control.feedforwards.dnlrx`. One joint alone is served faster by those.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import InputError
from ..friction.dnlrx import DnlrxModel
from ..record import Array
from .feedbacks.friction_observer import Bristles

__all__ = ["ManyDnlrx", "ManyError", "ManyLugre"]

_STILL = 1e-12  # numerical: of the bristles' rate times the period, below which the exponential is 1


class ManyError(InputError):
    """Joints that can't be served together, or a reference that isn't finite."""


def _finite(*values: Array) -> None:
    for each in values:
        if not np.isfinite(each).all():
            raise ManyError("reference", "a value is not finite", "leave the sample out")


class ManyLugre:
    """LuGre friction, inertia and viscous friction of ``n`` joints.

    Args:
        bristles: one law for each joint.
        mass: [F s^2/x], shape ``(n,)``.
        viscous: [F s/x], shape ``(n,)``.
        period: between two references [s].

    Raises:
        ManyError: shapes differ.
    """

    def __init__(self, bristles: Sequence[Bristles], mass: Array, viscous: Array, period: float) -> None:
        n = len(bristles)
        if mass.shape != (n,) or viscous.shape != (n,):
            raise ManyError(
                "joints", f"{n} friction laws, {mass.shape} masses, {viscous.shape} viscous", "give one for each joint"
            )
        self._mass, self._viscous, self._period = mass, viscous, period
        names = ("coulomb", "static", "stribeck", "stiffness", "damping")
        self._coulomb, self._static, self._stribeck, self._stiffness, self._damping = (
            np.array([getattr(one, name) for one in bristles], dtype=np.float64) for name in names
        )
        self._most = np.maximum(self._static, self._coulomb) / self._stiffness
        self.deflection = np.zeros(n)

    def step(self, velocity: Array, acceleration: Array) -> Array:
        """Forces [F] for the references of all joints; every array has shape ``(n,)``.

        Raises:
            ManyError: a value isn't finite; the state is left as it was.
        """
        _finite(velocity, acceleration)
        level = self._coulomb + (self._static - self._coulomb) * np.exp(-((velocity / self._stribeck) ** 2))
        end = np.copysign(level / self._stiffness, velocity)
        rate = self._stiffness * np.abs(velocity) / level * self._period
        before = self.deflection
        after = np.where(rate > _STILL, end + (before - end) * np.exp(-rate), before)
        self.deflection = np.clip(after, -self._most, self._most)
        friction = 0.5 * self._stiffness * (before + self.deflection)
        friction += self._damping * (self.deflection - before) / self._period
        return np.asarray(friction + self._viscous * velocity + self._mass * acceleration)


class ManyDnlrx:
    """DNLRX of ``n`` joints, all of one order and sample time.

    Args:
        models: one for each joint.
        position: where they rest before the first sample [x], shape ``(n,)``.

    Raises:
        ManyError: orders or sample times differ.
    """

    def __init__(self, models: Sequence[DnlrxModel], position: Array) -> None:
        if len({(one.order, one.sample_time) for one in models}) != 1 or position.shape != (len(models),):
            raise ManyError("joints", "DNLRX of several orders or sample times", "serve those of one order together")
        n_springs, n_delta, n = models[0].order
        self._thresholds = np.stack([one.thresholds for one in models])
        self._g = np.stack([one.position_filter for one in models])
        self._theta = np.stack([one.deformation_filter for one in models])
        self._offset = np.array([one.offset for one in models])
        self._positions = np.repeat(position[:, None], max(n, 1) + 1, axis=1)
        self._deformations = np.zeros((len(models), n_delta + 1, n_springs))

    def step(self, position: Array) -> Array:
        """Forces [F] at the next references ``position`` [x], both of shape ``(n,)``.

        Raises:
            ManyError: a value isn't finite; the state is left as it was.
        """
        _finite(position)
        x, delta = self._positions, self._deformations
        moved = np.clip(delta[:, 0] + (position - x[:, 0])[:, None], -self._thresholds, self._thresholds)
        x[:, 1:] = x[:, :-1].copy()
        x[:, 0] = position
        if delta.shape[1] > 1:
            delta[:, 1:] = delta[:, :-1].copy()
        delta[:, 0] = moved
        force = np.einsum("nj,nj->n", self._g, x[:, : self._g.shape[1]]) + np.einsum("njm,njm->n", self._theta, delta)
        return np.asarray(force + self._offset)
