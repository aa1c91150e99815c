"""Hilbert transform: amplitude and frequency at every instant of a free oscillation, with asymmetric friction.

The analytic signal z = y + i H[y] of the position less its centre, y = x - C, has the amplitude |z| and the phase arg z. The
centre, which an asymmetric oscillation has and which drifts with its amplitude, is the mean over one cycle around each
instant; with it taken off, the positive and the negative half share one envelope. (A centre found from |z| itself, whose
modulation at the oscillation's own frequency it must take away, is as good on many cycles and ill-conditioned on the few that
dry friction leaves.) The range begins and ends at reversals and is mirrored there, so that the transform sees a periodic
signal without jumps. The readings of :mod:`.oscillation.envelope` are then corrected by :mod:`.oscillation.matching`. The
backbone (frequency over amplitude) shows backlash: :mod:`.oscillation.backlash`.

Source: Feldman 1994 (FREEVIB); asymmetric friction named as continuing work by de Marchi 1998.
"""

from __future__ import annotations

import numpy as np
from scipy import signal

from ...record import Array, Mask
from ..oscillation.conclusion import ALL, free_oscillation_method
from ..oscillation.envelope import Envelope, cycle_mean, mirrored, phase_of
from ..oscillation.recording import Oscillation
from ..oscillation.result import FreeOscillation
from ..oscillation.transformed import identify, inner_part

__all__ = ["METHOD", "hilbert", "hilbert_envelope"]

_MARGIN = 0.75  # half cycles at either end


def hilbert_envelope(time: Array, position: Array, half_period: float) -> Envelope:
    """Envelope of ``position`` [x], shape ``(n,)``, evenly sampled from one reversal to another."""
    step = float(time[1] - time[0])
    centre = cycle_mean(position, round(2.0 * half_period / step))
    z = np.asarray(signal.hilbert(mirrored(position - centre))[: position.shape[0]])
    inner = inner_part(time, half_period, _MARGIN)
    return Envelope(time, np.abs(z), phase_of(z, time, half_period), centre, inner)


def hilbert(found: Oscillation, asked: Mask = ALL, rng: np.random.Generator | None = None) -> FreeOscillation:
    """The natural parameters of ``found`` from its Hilbert transform.

    Args:
        found: the oscillation.
        asked: which natural parameters to fit, shape ``(5,)``; the others are zero.
        rng: of the noise that standard errors are found with; None: always the same.
    """
    return identify(found, hilbert_envelope, asked, np.random.default_rng(0) if rng is None else rng)


METHOD = free_oscillation_method("hilbert", "Hilbert transform", "Feldman 1994; de Marchi 1998", hilbert)
