"""Recordings at constant speeds, one each: what a nominal model leaves out of their mean forces.

Within such a run only what the axis does besides shows (a ripple of the screw, the controller), and an observer of the motion
sees that and nothing else. What the friction does over speed shows between the runs. So each run gives a mean force with its
error, and what can be missing is a term of the friction curve. Here the recordings are recognised and their means taken; the
verdict comes from :mod:`fric.diagnosis.by_means`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..identification.methods.static_map import settled_means
from ..identification.result import Options
from ..identification.static_maps.curve import STRIBECK_LAWS
from ..identification.static_maps.load import MeanForce
from ..model import Model
from ..record import Record
from .curve_terms import FLAGS, points_of

__all__ = ["Ladder", "ladder_of"]

_FEWEST_SPEEDS = 4
_ONE_WAY = 0.05  # of the way, beyond its ends
_SETTLED = 0.75  # of the recordings, at least


@dataclass(frozen=True, eq=False)
class Ladder:
    """Means to learn from and means held back, and why runs have none."""

    train: list[MeanForce]
    validation: list[MeanForce]
    notes: tuple[str, ...]


def ladder_of(train: Sequence[Record], validation: Sequence[Record], nominal: Model) -> Ladder | None:
    """The means of the recordings, where each is one speed and nothing else tells more; else None."""
    have = {held.effect.id for held in nominal.terms}
    if not all(held.effect.usual or held.effect.law in ("", *STRIBECK_LAWS) for held in nominal.terms):
        return None
    if nominal.plant.id not in ("rigid", "contact") or not {"coulomb", "bias"} <= have <= {"coulomb", "bias", *FLAGS}:
        return None
    if not all(_one_way(record) for record in (*train, *validation)):
        return None
    means, notes = settled_means(train, Options())
    held, others = settled_means(validation, Options())
    several = any(len({mean.source for mean in each}) < len(each) for each in (means, held))
    if several or not held or len(means) + len(held) < _SETTLED * (len(train) + len(validation)):
        return None
    points = points_of(means) if means else None
    if points is None or points.n_speeds < _FEWEST_SPEEDS or np.all(points.velocity > 0.0) or np.all(points.velocity < 0.0):
        return None
    return Ladder(means, held, tuple(dict.fromkeys([*notes, *others])))


def _one_way(record: Record) -> bool:
    """Whether it hardly ever is elsewhere than between its first and its last place; an encoder may flicker."""
    where = record.position[record.mask]
    return bool(where.size) and float(np.ptp(where)) <= (1.0 + _ONE_WAY) * abs(float(where[-1] - where[0]))
