"""The simulation step beside the same law in C: four of the cases of ``fric bench laws``, with a goal of its own.

Their motions are the same to the last digits, which that benchmark checks; the time of a turn is the shortest of a few runs.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from pathlib import Path

from ..benchmarks.laws import CASES, Case, Run, ours, theirs
from ..compiled_c import compiler
from ..peer import Pair, Peer

__all__ = ["PEER"]

_LAWS = ("COULOMB_VISCOUS", "STRIBECK", "LUGRE", "GMS")
_GOAL = ">= 0.9"
_RUNS = 12
_TURNS = 25


def _shortest(run: Run) -> float:
    return min(run() for _ in range(_RUNS))


def prepare(folder: Path) -> Sequence[Pair]:
    """One pair per law."""
    return [_pair(case, folder) for case in CASES if case.law in _LAWS]


def _pair(case: Case, folder: Path) -> Pair:
    name = f"simulation step against C, {case.name}"
    if compiler() is None:
        return Pair(name, float, float, _GOAL, without="there is no C compiler: install one (cc), or set CC")
    mine, other = ours(case), theirs(case, folder)
    return Pair(name, functools.partial(_shortest, mine), functools.partial(_shortest, other), _GOAL, _TURNS)


PEER = Peer("c-loops", prepare)
