"""Iterative learning for a motion that is repeated: a force over time, learnt from the errors of the passes before.

Equation, with the force f_j(k) and the error e_j(k) of pass j at sample k, the learning filter L and the zero-phase low-pass Q:

    f_(j+1) = Q (f_j + L e_j).

With the closed loop from feedforward force to position G_f(z) = P/(1 + P C), errors obey E_(j+1) = Q (1 - L G_f) E_j, apart
from what isn't repeated, and fall from pass to pass where

    rho = max over frequencies |Q(z) (1 - L(z) G_f(z))| < 1,

which :func:`convergence` computes. L is not causal: the whole pass is known when the next is prepared. A share of the inverse
of the nominal closed loop, L e = gamma (m e'' + c e' + C e), needs no inversion, since 1/G_f = 1/P + C.

At work the force is read from a file (time since the beginning of the pass, force) and repeated with its length as the period.
Friction makes the loop nonlinear, and the bound then holds for small changes only: stop when the error no longer falls.
Source: Bristow, Tharayil, Alleyne 2006, IEEE Control Systems 26(3), Eqs. 5 to 12 and theorem 5.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...parameter import Parameter
from ...record import Array
from ..feedforward_kind import FeedforwardKind, FeedforwardKindError, Force, Setting, Text
from .static_table import read_table

__all__ = ["FEEDFORWARD", "IterativeLearning", "convergence", "learnt"]


class IterativeLearning:
    """A learnt force, repeated.

    Args:
        times: since the beginning of a pass, evenly spaced [s].
        forces: at them [F].
        preview: how much later than its stamp a force acts [s].
    """

    def __init__(self, times: Sequence[float], forces: Sequence[float], preview: float = 0.0) -> None:
        t, f = np.asarray(times, dtype=np.float64), np.asarray(forces, dtype=np.float64)
        if t.shape != f.shape or t.shape[0] < 2 or not np.all(np.isfinite(f)) or not np.all(np.diff(t) > 0.0):
            raise FeedforwardKindError("learnt force", "has no two increasing times with finite forces", "learn it anew")
        steps = np.diff(t)
        if float(np.ptp(steps)) > 1e-3 * float(np.mean(steps)):  # numerical: of stamps written with few digits
            raise FeedforwardKindError("learnt force", "times aren't evenly spaced", "learn it at the controller's period")
        self._step = float(np.mean(steps))
        self._forces: list[float] = f.tolist()
        self._preview = preview
        self.friction = 0.0
        self.reset()

    def reset(self) -> None:
        """Start a pass at the next sample."""
        self._start: float | None = None

    def step(self, time: float, position: float, velocity: float, acceleration: float) -> float:
        """See :meth:`fric.control.feedforward_kind.Force.step`."""
        if not math.isfinite(time):
            raise FeedforwardKindError("reference", "a time is not finite", "leave the sample out")
        if self._start is None:
            self._start = time
        at = (time - self._start + self._preview) / self._step % len(self._forces)
        k = int(at)
        share = at - k
        forces = self._forces
        return (1.0 - share) * forces[k % len(forces)] + share * forces[(k + 1) % len(forces)]


def learnt(force: Array, error: Array, correction: Array, period: float, cutoff: float) -> Array:
    """The force of the next pass [F], shape ``(n,)``.

    Args:
        force: of this pass [F], shape ``(n,)``.
        error: reference less position [x], shape ``(n,)``.
        correction: L e [F], shape ``(n,)``.
        period: [s].
        cutoff: of Q [Hz].

    Raises:
        FeedforwardKindError: lengths differ, something isn't finite, or the cutoff isn't below half the sampling rate.
    """
    if not force.shape == error.shape == correction.shape or not np.all(np.isfinite(force + error + correction)):
        raise FeedforwardKindError("iterative learning", "signals of different length, or not finite", "give one whole pass")
    if not 0.0 < cutoff < 0.5 / period:
        problem = f"cutoff {cutoff:g} Hz is not between 0 and half the sampling rate"
        raise FeedforwardKindError("iterative learning", problem, "give a lower one")
    from scipy.signal import butter, sosfiltfilt  # a node that only gives the force need not wait for it

    sections = butter(2, cutoff, fs=1.0 / period, output="sos")
    # A pass repeats: it is filtered between its neighbours.
    n = force.shape[0]
    whole = sosfiltfilt(sections, np.tile(force + correction, 3))
    return np.asarray(whole[n : 2 * n])


def convergence(plant: NDArray[np.complex128], controller: NDArray[np.complex128], learning: NDArray[np.complex128],
                omega: Array, cutoff: float) -> float:  # fmt: skip
    """Rho, the factor by which errors fall at least from pass to pass; 1 or more: they may grow.

    Args:
        plant: P at the frequencies, shape ``(n,)``.
        controller: C at them, shape ``(n,)``.
        learning: L at them [F/x], shape ``(n,)``.
        omega: frequencies [rad/s], shape ``(n,)``.
        cutoff: of Q, a Butterworth filter of second order there and back [Hz].
    """
    low_pass = 1.0 / (1.0 + (omega / (2.0 * math.pi * cutoff)) ** 4)
    return float(np.max(np.abs(low_pass * (1.0 - learning * plant / (1.0 + plant * controller)))))


def _build(setting: Setting) -> Force:
    times, forces = read_table(setting.texts["file"], 1_000_000)
    return IterativeLearning(times, forces, setting.preview - 0.5 * setting.period + setting.values["advance"])


FEEDFORWARD = FeedforwardKind(
    id="iterative_learning",
    title="force learnt from pass to pass",
    build=_build,
    parameters=(Parameter("advance", "T_a", "s", "time by which the force is given earlier", default=0.0),),
    texts=(Text("file", "a text file with a time [s] and a force [F] in each line", is_file=True),),
    source="Bristow, Tharayil, Alleyne 2006",
)
