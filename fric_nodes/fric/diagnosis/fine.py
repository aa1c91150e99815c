"""Fine periods: what comes back hundreds of times over the travel, from the spectrum of what is missing over the position.

Magnets and teeth of a motor, the balls of a screw and the pitch of a rack lie far closer than any grid of periods that could be
tried one by one. Along the measured motion a ripple is a line in the spectrum over position, as narrow as one cycle over the
travel.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import median_filter
from scipy.signal import find_peaks

from ..engine.kernel import loop
from ..record import Array

__all__ = ["fine_periods"]

_STEP = 0.25  # cycles over the travel
_AROUND = 40.0  # cycles, of which the median is the level that a line has to stand out from
_STANDS_OUT = 40.0  # times that level: of a thousand lines of noise the highest reaches seven to ten
_LINES = 3
_MOST = 800.0  # cycles


def fine_periods(position: Array, missing: Array, fewest: float, most: float) -> list[float]:
    """Periods [x] of what stands out of the spectrum of ``missing`` over ``position``, the strongest first.

    Args:
        position: [x], shape ``(n,)``.
        missing: at these positions, in any unit, shape ``(n,)``.
        fewest: cycles over the travel from which on they are looked for.
        most: cycles up to which.
    """
    travel = float(np.ptp(position))
    # Coarser periods, too, tell the level: it is known where hardly more than the fewest cycles are seen.
    cycles = np.arange(1.0, min(most, _MOST), _STEP)
    if cycles.size == 0 or travel == 0.0 or float(np.ptp(missing)) == 0.0 or most <= fewest:
        return []
    phase = -2j * math.pi * (position - float(np.mean(position))) / travel
    turning, turn = (missing - np.mean(missing)) * np.exp(phase * cycles[0]), np.exp(phase * _STEP)
    power = np.empty(cycles.size)
    _add_up(turning.real.copy(), turning.imag.copy(), turn.real.copy(), turn.imag.copy(), power)
    level = median_filter(power, int(_AROUND / _STEP) | 1, mode="nearest") / math.log(2.0)
    stands_out = (cycles >= fewest) & (power > _STANDS_OUT * level)
    peaks, _ = find_peaks(np.where(stands_out, power, 0.0), distance=round(1.0 / _STEP))
    strongest = sorted((int(peak) for peak in peaks), key=lambda peak: -power[peak])[:_LINES]
    return [float(travel / (cycles[peak] + _STEP * _summit(power[peak - 1 : peak + 2]))) for peak in strongest]


@loop
def _add_up(real: Array, imag: Array, turn_real: Array, turn_imag: Array, power: Array) -> None:
    """Into each of ``power`` the squared sum of ``real + i imag``, shape ``(n,)``; they are turned by ``turn`` after each."""
    n = real.shape[0]
    for k in range(power.shape[0]):
        # A sum has to wait for the one before: four of them don't wait for each other.
        r_0, r_1, r_2, r_3, i_0, i_1, i_2, i_3 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(0, n - n % 4, 4):
            r_0, r_1, r_2, r_3 = r_0 + real[j], r_1 + real[j + 1], r_2 + real[j + 2], r_3 + real[j + 3]
            i_0, i_1, i_2, i_3 = i_0 + imag[j], i_1 + imag[j + 1], i_2 + imag[j + 2], i_3 + imag[j + 3]
        for j in range(n - n % 4, n):
            r_0, i_0 = r_0 + real[j], i_0 + imag[j]
        power[k] = (r_0 + r_1 + r_2 + r_3) ** 2 + (i_0 + i_1 + i_2 + i_3) ** 2
        for j in range(n):
            before = real[j]
            real[j] = before * turn_real[j] - imag[j] * turn_imag[j]
            imag[j] = before * turn_imag[j] + imag[j] * turn_real[j]


def _summit(three: Array) -> float:
    """Where the parabola through three values at -1, 0 and 1 is highest."""
    bend = float(three[0] - 2.0 * three[1] + three[2])
    return 0.5 * float(three[0] - three[2]) / bend if bend < 0.0 else 0.0
