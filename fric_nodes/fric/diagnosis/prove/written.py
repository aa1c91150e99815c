"""What a case's recordings hold: what was run, as a log holds it, clean or as real machines write it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from ...record import Array, Record
from .dirt import drawn_dirt
from .experiment import Bench, Recording
from .physics import Physics

__all__ = ["dirty", "logged", "recorded"]

_EVERY = (2, 8)  # samples of the controller that a slow log holds one of
_SLOWEST_LOG = 0.02  # [s]


def recorded(
    bench: Bench, physics: Physics, recording: Recording, signals: frozenset[str], conditions: Mapping[str, float], name: str
) -> Record:
    """The recording ``name`` of this physics."""
    found = bench.run(physics, recording)
    n = found.command.shape[0]
    extra: dict[str, Array] = {}
    if "normal_load" in signals:
        extra["normal_load"] = conditions["normal_load"] * recording.course.load
    if "temperature" in signals:
        extra["temperature"] = np.round(conditions["temperature"] + recording.course.warmer, 2)
    return Record(
        time=np.round(np.arange(n) * bench.setting.sample_time, 9),
        position=found.measured,
        effort=found.command + bench.noise(recording),
        extra=extra,
        nominal=dict(conditions),
        source=name,
        effort_hold="following",
    )


def dirty(records: list[Record], bench: Bench, key: dict[str, Any], random: np.random.Generator) -> list[Record]:
    """``records`` as a real machine writes them; what stands between is put into ``key``."""
    dirt = drawn_dirt(bench.setting.friction, bench.setting.travel, bench.resolution, random)
    key["dirt"] = asdict(dirt)
    seeds = random.integers(1, 2**31, len(records)).tolist()
    return [dirt.on(each, seed) for each, seed in zip(records, seeds, strict=True)]


def logged(records: list[Record], bench: Bench, key: dict[str, Any], random: np.random.Generator) -> list[Record]:
    """One of so many samples of ``records``, by a log that doesn't know how the force is held."""
    most = min(_EVERY[1], int(_SLOWEST_LOG / bench.setting.sample_time))
    every = int(random.integers(_EVERY[0], most + 1))
    key["every"] = every
    return [_one_of(each, every) for each in records]


def _one_of(record: Record, every: int) -> Record:
    extra = {name: signal[::every] for name, signal in record.extra.items()}
    return replace(
        record,
        time=record.time[::every],
        position=record.position[::every],
        effort=record.effort[::every],
        extra=extra,
        effort_hold="linear",
    )
