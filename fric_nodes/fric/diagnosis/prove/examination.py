"""The whole examination: plan, draw, seal, diagnose in other processes, open the key, score.

An examination that was stopped goes on where it was: cases whose key is sealed aren't drawn again, and cases that were
finished for this seal aren't diagnosed again.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

from ...errors import InputError
from ...files import write_text
from ...threads import alone
from ..deadline import refuse_no_time
from .candidate import DIAGNOSE, entered, examine, own_fit
from .cases import Order, plan
from .generators import GENERATORS
from .scoring import Outcome, Score, outcome_of, scored
from .sealing import case_folder, open_key, published, seal, set_up

__all__ = ["Examination", "hold", "in_processes"]

Progress = Callable[[str], None]
Result = TypeVar("Result")
_REPORTS = 20  # lines of progress per stage at most


class Examination:
    """What :func:`hold` gives: the outcomes, the score, the seal and the times [s]."""

    def __init__(self, outcomes: Sequence[Outcome], score: Score, hash_of_key: str, seconds: float) -> None:
        self.outcomes = tuple(outcomes)
        self.score = score
        self.hash_of_key = hash_of_key
        self.seconds = seconds


def hold(
    n_cases: int,
    seed: int,
    out: Path,
    *,
    variant: str = "standard",
    jobs: int | None = None,
    entry: str = DIAGNOSE,
    at_most: float | None = None,
    progress: Progress = lambda text: None,
) -> Examination:
    """Hold an examination in the folder ``out``.

    Args:
        n_cases: how many cases.
        seed: of all of them.
        out: folder; one that holds an examination of the same kind is gone on with.
        variant: see :data:`fric.diagnosis.prove.cases.VARIANTS`.
        jobs: worker processes; as many as there are cores when None.
        entry: the diagnosis, as ``module:function``.
        at_most: time after which a diagnosis looks for no further effects [s]; None: each ends by itself.
        progress: told what is going on.

    Raises:
        InputError: the folder holds something else, or the wishes can't be met.
    """
    refuse_no_time(at_most)
    began = time.perf_counter()
    orders = plan(n_cases, seed, variant)
    workers = _workers(jobs)
    entered(entry)  # before anything is drawn
    if variant in GENERATORS:
        GENERATORS[variant].ready()
    _claim(out, orders)
    hash_of_key = published(out)
    if hash_of_key is None:
        progress(f"drawing {n_cases} cases")
        with _pool(workers) as pool:
            keys = _all(pool, set_up, [(str(out), order) for order in orders], progress, "drawn")
        hash_of_key = seal(out, keys)
    progress(f"sealed: sha256 {hash_of_key}")
    waiting = [order for order in orders if not _finished(case_folder(out, order.number), hash_of_key, at_most)]
    if len(waiting) < n_cases:
        progress(f"{n_cases - len(waiting)} cases were diagnosed before")
    # Processes that have drawn a case know what is in it: these are others.
    with _pool(workers) as pool:
        tasks = [(str(case_folder(out, order.number)), hash_of_key, entry, at_most) for order in waiting]
        _all(pool, examine, tasks, progress, "diagnosed")
        keys = open_key(out)
        named = [key for key in keys if key["kind"] in ("moderate", "weak", "pair")]
        structures = [(str(case_folder(out, key["number"])), key["true_structure"], entry) for key in named]
        found = _all(pool, own_fit, structures, progress, "true structures fitted")
    own = {key["number"]: noe for key, noe in zip(named, found, strict=True)}
    outcomes = [outcome_of(key, case_folder(out, key["number"]), own.get(key["number"])) for key in keys]
    return Examination(outcomes, scored(outcomes, variant), hash_of_key, time.perf_counter() - began)


def _claim(out: Path, orders: Sequence[Order]) -> None:
    """Write down what is planned, or check that the folder holds the same plan.

    Raises:
        InputError: it holds another one.
    """
    text = json.dumps([asdict(order) for order in orders])
    at = out / "plan.json"
    if at.exists():
        if at.read_text() != text:
            raise InputError(out, "holds another examination", "choose another folder, or the same cases, seed and variant")
        return
    if out.exists() and any(out.iterdir()):
        raise InputError(out, "isn't empty", "choose another folder")
    write_text(at, text)


def _finished(folder: Path, hash_of_key: str, at_most: float | None) -> bool:
    at = folder / "done.json"
    done = json.loads(at.read_text()) if at.exists() else {}
    return done.get("seal") == hash_of_key and done.get("at_most") == at_most


def _pool(workers: int) -> ProcessPoolExecutor:
    """Fresh processes, of one thread each, that share nothing with this one; none is started before there is work."""
    return ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), initializer=alone)


def _workers(jobs: int | None) -> int:
    workers = jobs or os.cpu_count() or 1
    if workers < 1:
        raise InputError("--jobs", f"{workers} is too few", "ask for at least one")
    return workers


def in_processes(
    work: Callable[..., Result], tasks: Sequence[tuple[Any, ...]], progress: Progress, what: str, jobs: int | None = None
) -> list[Result]:
    """``work`` for every task, in the tasks' order, in fresh processes; ``jobs`` of them, one per core when None.

    Raises:
        InputError: less than one.
    """
    with _pool(_workers(jobs)) as pool:
        return _all(pool, work, tasks, progress, what)


def _all(
    pool: ProcessPoolExecutor, work: Callable[..., Result], tasks: Sequence[tuple[Any, ...]], progress: Progress, what: str
) -> list[Result]:
    """``work`` for every task, in the tasks' order."""
    began = time.perf_counter()
    results: dict[int, Result] = {}
    waiting = {pool.submit(work, *task): number for number, task in enumerate(tasks)}
    try:
        for done in as_completed(waiting):
            results[waiting[done]] = done.result()
            if len(results) % max(len(tasks) // _REPORTS, 1) == 0 or len(results) == len(tasks):
                progress(f"{what}: {len(results)} of {len(tasks)}, {time.perf_counter() - began:.0f} s")
    except BaseException:
        _cancel(waiting)
        raise
    return [results[number] for number in range(len(tasks))]


def _cancel(futures: Iterable[Any]) -> None:
    for each in futures:
        each.cancel()
