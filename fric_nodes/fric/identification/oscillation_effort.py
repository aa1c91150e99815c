"""The force at the stamps of its samples.

A feedback is found by holding the force against position and velocity of the same instant. A force that acted from one stamp to
the next is centred half a sample off, and at a stamp it is the mean of both intervals; taken as it stands, a stiffness P would
look like a damping of P h/2.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..record import Record

__all__ = ["at_stamps"]


def at_stamps(record: Record) -> Record:
    """``record`` with the force at the stamps of its samples."""
    if record.hold == "linear":
        return record
    effort = record.effort
    preceding = record.hold == "preceding"
    other = np.append(effort[1:], effort[-1]) if preceding else np.insert(effort[:-1], 0, effort[0])
    return replace(record, effort=0.5 * (effort + other), effort_hold="linear")
