"""What stands beside fric: the same task done in two ways, measured in turns, as the ratio of their times.

A shared processor changes its speed from second to second. So each turn measures both ways one right after the other and gives
one ratio; the turns of all pairs are spread over the whole run; and which of the two goes first alternates. A ratio is given
by the median of its turns, and by the range that holds the middle 80 % of them.
"""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..figure import Figure

__all__ = ["Pair", "Peer", "measure"]


def _nothing() -> list[Figure]:
    return []


@dataclass(frozen=True, eq=False)
class Pair:
    """One task in two ways.

    Attributes:
        name: what is compared, with what.
        ours: does it with fric once, and gives the time that counts [s].
        theirs: does it the other way.
        goal: of the ratio, such as ``>= 50``: theirs over ours when it is to be large, ours over theirs when it is to be small.
        turns: how often both are measured.
        needs: name of the module of an optional package that the other way takes; empty: none.
        without: why it can't be measured here; empty when it can.
        warm: a turn before those that count, which compiles and fills caches.
        even: repeat ours until it lasts as long as theirs, so that other programs interrupt both alike; needs ``warm``.
        beside: figures to stand beside the ratio when all turns are over, such as errors; the pair's name comes before theirs.
    """

    name: str
    ours: Callable[[], float]
    theirs: Callable[[], float]
    goal: str = ""
    turns: int = 9
    needs: str = ""
    without: str = ""
    warm: bool = True
    even: bool = False
    beside: Callable[[], list[Figure]] = _nothing

    @property
    def missing(self) -> str:
        """Why it isn't measured: what it is without, or a package that isn't installed; empty when it is."""
        if self.without or not self.needs or importlib.util.find_spec(self.needs) is not None:
            return self.without
        return f"{self.needs} is not installed: pip install 'fric[peers]'"


@dataclass(frozen=True, eq=False)
class Peer:
    """What an engineer would otherwise use for one task.

    Attributes:
        id: short name.
        prepare: makes what is compared, with a folder for its files.
    """

    id: str
    prepare: Callable[[Path], Sequence[Pair]]


def measure(pairs: Sequence[Pair], told: Callable[[str], object] = lambda _: None) -> list[Figure]:
    """Figures of all pairs: ratio, both times, and what stands beside them.

    Args:
        pairs: measured in turns, spread over the run.
        told: takes a line about each round of turns.
    """
    able = [pair for pair in pairs if not pair.missing]
    repeats = {id(pair): _warmed(pair) for pair in able}
    spent: dict[int, list[tuple[float, float]]] = {id(pair): [] for pair in able}
    rounds = max((pair.turns for pair in able), default=0)
    for k in range(rounds):
        told(f"round {k + 1} of {rounds}")
        for pair in able:
            # A pair with few turns has them spread evenly over the rounds.
            if (k + 1) * pair.turns // rounds > k * pair.turns // rounds:
                spent[id(pair)].append(_turn(pair, repeats[id(pair)], ours_first=k % 2 == 0))
    return [figure for pair in pairs for figure in _figures(pair, spent.get(id(pair), []))]


def _warmed(pair: Pair) -> int:
    """How often ours is done in each turn, after the turn that doesn't count."""
    if not pair.warm:
        return 1
    pair.ours()
    theirs = pair.theirs()
    return max(1, round(theirs / pair.ours())) if pair.even else 1


def _turn(pair: Pair, repeats: int, ours_first: bool) -> tuple[float, float]:
    theirs = math.nan if ours_first else pair.theirs()
    ours = sum(pair.ours() for _ in range(repeats)) / repeats
    return ours, pair.theirs() if ours_first else theirs


def _figures(pair: Pair, spent: Sequence[tuple[float, float]]) -> list[Figure]:
    if pair.missing:
        return [Figure(pair.name, math.nan, "1", pair.goal, skipped=pair.missing)]
    ours, theirs = np.array(spent).T
    small = pair.goal.startswith("<=")
    ratio = ours / theirs if small else theirs / ours
    return [
        _spread(pair.name, ratio, "1", pair.goal),
        _spread(f"{pair.name}: fric", ours, "s"),
        _spread(f"{pair.name}: the other", theirs, "s"),
        *(replace(each, name=f"{pair.name}: {each.name}") for each in pair.beside()),
    ]


def _spread(name: str, values: np.ndarray[tuple[int, ...], np.dtype[np.float64]], unit: str, goal: str = "") -> Figure:
    low, middle, high = np.percentile(values, (10.0, 50.0, 90.0)).tolist()
    return Figure(name, middle, unit, goal, low, high)
