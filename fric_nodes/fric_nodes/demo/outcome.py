"""What the demonstration measures, from its bags alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from fric.bagio import read_record, read_series
from fric.record import Array, Record, RecordError

__all__ = ["Run", "read_run"]

_SETTLING = 0.5  # [s] at the start, before the loop is closed and the reference moves


@dataclass(frozen=True, eq=False)
class Run:
    """One run of the axis along a reference.

    Attributes:
        bag: where it was recorded.
        record: what was recorded.
        error: reference minus position [x], shape ``(n_samples,)``.
        rms: root mean square of the error [x].
        peak: largest error [x].
        missed: samples that came more than 1.5 periods after the one before.
    """

    bag: Path
    record: Record
    error: Array
    rms: float
    peak: float
    missed: int


def read_run(bag: Path, period: float) -> Run:
    """The run recorded in ``bag``, whose samples should come every ``period`` [s].

    Raises:
        RecordError: the bag holds no reference to compare the motion with.
    """
    record = read_record(bag, repair=True)
    if record.reference is None:
        raise RecordError(bag, "holds no reference", "record /reference as well")
    given, states = (read_series(bag, topic).stamp_ns for topic in ("/reference", "/joint_states"))
    if given is None or states is None:
        raise RecordError(bag, "holds stamps of zero only", "record a graph whose clock runs")
    # Where the recording holds no reference there is nothing to compare with.
    last = 1e-9 * float(min(given[-1], states[-1]) - states[0])
    record = record.between(_SETTLING, last)
    assert record.reference is not None
    error = record.reference - record.position
    return Run(
        bag=bag,
        record=record,
        error=error,
        rms=float(np.sqrt(np.mean(error**2))),
        peak=float(np.max(np.abs(error))),
        missed=int(np.sum(np.diff(record.time) > 1.5 * period)),
    )
