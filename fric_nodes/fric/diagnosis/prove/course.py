"""What a run of an axis is led by, and what happened in it: the words that all who lead an axis share, and no equation."""

from __future__ import annotations

from dataclasses import dataclass

from ...record import Array

__all__ = ["Course", "Run", "Unreachable"]


class Unreachable(Exception):
    """This axis can't show the effect with the strength wanted; another one is drawn."""


@dataclass(frozen=True, eq=False)
class Course:
    """What one run is led by; arrays of shape ``(n_samples,)``.

    Attributes:
        reference: position wanted [m].
        feedforward: force added to the controller's [N].
        load: relative normal load [1].
        warmer: temperature less nominal [K].
        windows: spans in which a disturbance acts [s], shape ``(n, 2)``.
        noise: added to the position before the encoder rounds it [m].
    """

    reference: Array
    feedforward: Array
    load: Array
    warmer: Array
    windows: Array
    noise: Array


@dataclass(frozen=True, eq=False)
class Run:
    """What happened; arrays of shape ``(n_samples,)``.

    Attributes:
        command: of the controller, held from its sample to the next [N].
        measured: what the encoder says [m].
        seen: the encoder without noise and rounding [m].
        speed: rate of ``seen`` [m/s].
        direction: mean sign of the seen velocity until the next sample; between -1 and 1.
    """

    command: Array
    measured: Array
    seen: Array
    speed: Array
    direction: Array
