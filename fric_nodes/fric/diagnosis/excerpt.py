"""Long recordings: causes are looked for in an excerpt and confirmed on everything.

Screening and growing fit hundreds of models, whose cost is proportional to the number of samples; what they find needs the
spans in which force is missing and, beside these, quiet ones, which refute an effect that would act there too. The recordings
are cut into cells of a second or so; half of the excerpt are cells spread evenly over the recordings, half those in which the
refitted nominal model lacks most. What was found is then fitted anew to all samples, and the share of the missing force that
it explains there is stated beside the share in the excerpt: where both agree the excerpt did no harm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..model import Model
from ..record import Array, Index
from .fitting import free_names, refit
from .growth import Growth
from .track import Track

__all__ = ["MOST", "Excerpt", "confirmed", "excerpt"]

MOST = 20_000
"""Samples of an excerpt in which causes are looked for, where there are a quarter more."""
_CELL = 1000  # samples
_SETTLED = 12.0  # times the observer's settling that a cell lasts at least
_MOVING = 0.05  # of the fast speed, at which a cell may end, unless it is
_LONGEST = 3  # times as long as others
_FIRST_FIT = 4  # iterations of the fit that tells where force is missing


@dataclass(frozen=True, eq=False)
class Excerpt:
    """Parts of long recordings.

    Attributes:
        tracks: the parts, followed as the whole ones were.
        whole: everything, at the same bandwidths.
        n_kept: samples in the parts.
        n_all: samples in everything.
    """

    tracks: tuple[Track, ...]
    whole: tuple[Track, ...]
    n_kept: int
    n_all: int

    @property
    def text(self) -> str:
        """What was done, in a sentence."""
        return (
            f"causes were looked for in {self.n_kept} of {self.n_all} samples: half of them spread evenly over the recordings, "
            "half where the refitted nominal model lacks most force; what was found was fitted to all of them"
        )


def excerpt(tracks: Sequence[Track], nominal: Model, most: int = MOST) -> Excerpt | None:
    """About ``most`` samples of the recordings that hold what is missing and what is quiet; None where they aren't longer.

    Args:
        tracks: the same recordings, followed at several bandwidths.
        nominal: with values that a fit can start from.
        most: samples.
    """
    n_all = tracks[0].n_samples
    if n_all <= 1.25 * most:
        return None
    step = float(np.median(np.concatenate([run.step for run in tracks[0].runs])))
    length = max(_CELL, math.ceil(_SETTLED * 6.0 / (tracks[0].bandwidth * step)))
    cells = _cells(tracks[0], min(length, most // 4))
    kept = _chosen(_energy(tracks[len(tracks) // 2], nominal, cells, most), max(most // length, 4))
    spans = _joined(cells[kept])
    parts = tuple(track.parts(spans) for track in tracks)
    return Excerpt(parts, tuple(tracks), parts[0].n_samples, n_all)


def _cells(track: Track, length: int) -> Index:
    """Run, first and last interval (exclusive) of each cell of about ``length``, shape ``(n_cells, 3)``.

    They are cut where the axis moves fastest. What a model begins with, a fresh contact, bristles at rest, a gap in its middle,
    is then true within a moment; in the middle of a rest nothing would tell how long it has lasted.
    """
    found = []
    speeds = [np.abs(motion.velocity) for motion in track.motion]
    moving = _MOVING * float(np.quantile(np.concatenate(speeds), 0.98))
    for k, speed in enumerate(speeds):
        cuts = [0]
        for at in np.linspace(0, speed.size, max(speed.size // length, 1) + 1).astype(np.int64)[1:-1].tolist():
            around = slice(at - length // 2, at + length // 2)
            fastest = around.start + int(np.argmax(speed[around]))
            if speed[fastest] > moving or at - cuts[-1] > _LONGEST * length:
                cuts.append(fastest)
        found += [(k, first, last) for first, last in pairwise([*cuts, speed.size])]
    return np.array(found, dtype=np.int64)


def _energy(track: Track, nominal: Model, cells: Index, most: int) -> Array:
    """Mean square of the force that ``nominal``, fitted to evenly spread cells, lacks in each cell [F^2]."""
    even = np.unique(np.linspace(0, len(cells) - 1, max(most // int(np.max(cells[:, 2] - cells[:, 1])), 4)).astype(np.int64))
    fitted = track.parts(_spans(cells[even])).fit(nominal, free_names(nominal), _FIRST_FIT).model
    lacking = track.padded(track.residual(fitted))
    return np.array([float(np.mean(lacking[k][first:last] ** 2)) for k, first, last in cells.tolist()])


def _chosen(energy: Array, n_kept: int) -> Index:
    """Numbers of the cells: half spread evenly, half those with most energy, ascending."""
    n = energy.shape[0]
    even = np.unique(np.linspace(0, n - 1, max(n_kept // 2, 2)).round().astype(np.int64))
    most = [k for k in np.argsort(energy)[::-1].tolist() if k not in set(even.tolist())]
    return np.sort(np.concatenate([even, np.array(most[: max(n_kept - even.size, 0)], dtype=np.int64)]))


def _joined(cells: Index) -> list[tuple[int, int, int]]:
    """The cells, neighbours made one."""
    found: list[tuple[int, int, int]] = []
    for run, first, last in _spans(cells):
        if found and found[-1][0] == run and found[-1][2] == first:
            found[-1] = (run, found[-1][1], last)
        else:
            found.append((run, first, last))
    return found


def _spans(cells: Index) -> list[tuple[int, int, int]]:
    return [(run, first, last) for run, first, last in cells.tolist()]


def _share(left: float) -> str:
    return f"{100.0 * left:.3g} %" if left > 0.0 else "no more than noise does"


def confirmed(found: Excerpt, growth: Growth) -> tuple[Growth, str]:
    """What was grown on the excerpt, fitted to all samples, and what that says about the excerpt.

    The steps keep their figures, which are those of the excerpt.
    """
    track = next(each for each in found.whole if each.bandwidth == growth.track.bandwidth)
    here = growth.end.excess / max(growth.begin.excess, 1e-300)
    begin = refit(track, growth.begin.fit.model, max_iterations=4)
    end = refit(track, growth.end.fit.model, max_iterations=4) if growth.steps else begin
    left = end.excess / max(begin.excess, 1e-300)
    text = found.text
    if growth.steps:
        text += f"; of what is missing it leaves {_share(left)} there, {_share(here)} in the excerpt"
    plain = None if growth.unhelped is None else confirmed(found, growth.unhelped)[0]
    return replace(growth, track=track, begin=begin, end=end, unhelped=plain), text
