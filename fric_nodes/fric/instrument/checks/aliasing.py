"""Aliased: a line in the force that no force made.

A sampled signal without a filter before it shows what lies above half the rate as a line below. A real force of amplitude F
at a frequency f accelerates the axis by F/m; a folded line does not, since the axis moves at another frequency, if at all. So
a narrow line above the band of the motion, whose acceleration is missing, was folded or picked up. The value is its amplitude.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import signal
from scipy.ndimage import median_filter

from ...record import Array
from ..check import Check, Evidence, Finding, each
from ..view import View

__all__ = ["CHECK"]

_LINE = 25.0  # of the spectrum around it
_LOWEST = 0.12  # of the rate, above which a line is looked for
_FAULT = 0.03  # of the effort's rms
_MISSING = 0.3
_AROUND = 25


def _usual(density: Array) -> Array:
    """Running median of a spectrum."""
    return np.asarray(median_filter(density, size=2 * _AROUND + 1, mode="nearest"))


def _judge(view: View, evidence: Evidence) -> Finding:
    length = min(view.n // 4, 2048)
    spread = float(np.std(view.even.effort))
    if length < 64 or spread == 0.0:
        return Finding("aliasing", "unknown", "too short, or no force")
    window = signal.get_window("hann", length)
    frequency, density = signal.welch(view.even.effort, 1.0 / view.h, window=window, detrend="linear")
    usual = _usual(density)
    high = (frequency > _LOWEST / view.h) & (frequency < 0.49 / view.h)
    ratio = np.where(high & (usual > 0.0), density / np.where(usual > 0.0, usual, 1.0), 0.0)
    k = int(np.argmax(ratio))
    width = frequency[1]
    energy = float(np.sum((density - usual)[max(k - 2, 0) : k + 3])) * width
    amplitude = math.sqrt(max(2.0 * energy, 0.0))
    unit = view.record.units.force
    if ratio[k] < _LINE or amplitude < 0.5 * _FAULT * spread:
        return Finding("aliasing", "ok", "no line in the force above the band of the motion", amplitude, unit)
    detail = f"the force has a line of {amplitude:.3g} {unit} at {frequency[k]:.4g} Hz"
    remedy = "record faster, or put a low-pass filter of less than half the rate before the sampling"
    mass = view.balance.value("mass")
    if amplitude < _FAULT * spread or not mass > 4.0 * view.balance.error("mass"):
        return Finding("aliasing", "warning", f"{detail}: aliased, picked up, or a vibration", amplitude, unit, remedy=remedy)
    _, motion = signal.welch(view.even.position, 1.0 / view.h, window=window, detrend="linear")
    floor = float(_usual(motion)[k])
    at = 2.0 * math.pi * frequency[k]
    near = slice(max(k - 2, 0), k + 3)
    moved = mass * at**2 * math.sqrt(2.0 * float(np.sum(motion[near])) * width)
    visible = mass * at**2 * math.sqrt(10.0 * floor * width)
    if moved > _MISSING * amplitude and visible < _MISSING * amplitude:
        return Finding(
            "aliasing", "warning", f"{detail}, and the axis vibrates with it", amplitude, unit, remedy="filter it out"
        )
    if visible >= _MISSING * amplitude:
        said = "too fast to determine from the position whether the axis moves with it: aliased, picked up, or real"
        return Finding("aliasing", "warning", f"{detail}, {said}", amplitude, unit, remedy=remedy)
    said = "with which the axis does not move: aliased from above half the rate, or picked up"
    return Finding("aliasing", "fault", f"{detail}, {said}", amplitude, unit, remedy=remedy)


CHECK = Check("aliasing", "folded lines in the force", "a force at an even rate", each(_judge))
