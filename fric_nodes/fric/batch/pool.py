"""Who does the work: this process alone, or workers of Dask distributed, here or wherever a scheduler has them.

A few recordings are under way for each worker, and the rest waits here, so that the scheduler is as small for 10^6 recordings
as for ten. When a worker dies (out of memory, a crash in compiled code), what it had is set aside, and tried once more when all
else is done, one at a time: whose worker dies then has killed it itself.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any

from ..errors import InputError
from ..threads import alone
from .job import Entry, Job, lost, work

__all__ = ["ALONE", "Workers", "client_of", "worked"]

_UNDER_WAY = 2  # recordings for each thread of a worker: one in work and one that waits for it (numerical)
_KEPT = 1 << 25  # [byte]: arrays up to this size lie in memory that a worker keeps for its next (numerical: glibc's maximum)
_START = 120.0  # [s] for workers to come up (physical: importing and unpacking compiled code on a slow disk)


@dataclass(frozen=True)
class Workers:
    """Who does the work.

    Attributes:
        number: of processes; 0: this process, one recording after the other.
        memory: of each, such as ``2GB``; one that needs more is stopped, and its recording reported.
        scheduler: address of a Dask scheduler in place of processes here; empty: none.
    """

    number: int = 1
    memory: str = "2GB"
    scheduler: str = ""


ALONE = Workers(0)
"""This process alone."""


def worked(paths: Iterable[str], job: Job, workers: Workers) -> Iterator[tuple[str, Entry]]:
    """Path of each recording and what came of it, in the order in which they are done.

    Raises:
        InputError: no workers can be had, or they are lost.
    """
    if workers.number == 0 and not workers.scheduler:
        yield from ((path, work(path, job)) for path in paths)
        return
    with client_of(workers) as client:
        yield from _by_dask(client, paths, job)


def _by_dask(client: Any, paths: Iterable[str], job: Job) -> Iterator[tuple[str, Entry]]:
    from distributed import KilledWorker

    aside: list[str] = []
    slots = _UNDER_WAY * max(sum(client.nthreads().values()), 1)
    for path, future in _streamed(client, iter(paths), job, slots):
        if future.status == "error" and isinstance(future.exception(), KilledWorker):
            aside.append(path)
        else:
            yield path, _result(path, future, job)
    for path, future in _streamed(client, iter(aside), job, 1):
        yield path, _result(path, future, job)


def _streamed(client: Any, paths: Iterator[str], job: Job, slots: int) -> Iterator[tuple[str, Any]]:
    """Path and future of each recording as they are done, with ``slots`` of them under way."""
    from distributed import as_completed

    names: dict[str, str] = {}
    running = as_completed(loop=client.loop)

    def submit() -> None:
        path = next(paths, None)
        if path is not None:
            future = client.submit(_remote_work, path, job, pure=False)
            names[future.key] = path
            running.add(future)

    for _ in range(slots):
        submit()
    for future in running:
        submit()
        yield names.pop(future.key), future


def _result(path: str, future: Any, job: Job) -> Entry:
    from distributed import KilledWorker

    if future.status == "finished":
        entry: Entry = future.result()
        return entry
    if future.status != "error":
        raise InputError("fric batch", "has lost its scheduler", "start again: it goes on where it was")
    error = future.exception()
    if isinstance(error, KilledWorker):
        return lost(path, job, "its worker died twice, of memory or of a crash; give workers more with --memory, or cut it")
    return lost(path, job, f"its worker failed ({type(error).__name__}: {error}); start again")


@cache
def _settle() -> None:
    """Once in a worker: it has one core."""
    alone()


def _remote_work(path: str, job: Job) -> Entry:
    _settle()
    return work(path, job)


@contextmanager
def client_of(workers: Workers) -> Iterator[Any]:
    """A client of Dask with ``workers`` behind it, which end with it.

    Raises:
        InputError: none can be had.
    """
    try:
        import dask.utils
        from distributed import Client, LocalCluster
    except ImportError:
        remedy = "pip install 'fric[batch]', or work in this process with --workers 0"
        raise InputError("fric batch", "needs the package distributed for its workers", remedy) from None
    try:
        dask.utils.parse_bytes(workers.memory)
    except ValueError:
        raise InputError("--memory", f"is '{workers.memory}', which is no size", "give one such as 2GB or 800MB") from None
    settings = {
        # What was on a worker that died comes back at once: it is tried again by itself.
        "distributed.scheduler.allowed-failures": 0,
        # A worker has one recording at a time, and nothing to spill: a pause would never end.
        "distributed.worker.memory.target": False,
        "distributed.worker.memory.spill": False,
        "distributed.worker.memory.pause": False,
        "distributed.worker.memory.terminate": 0.95,
        # Dask makes workers return freed memory at once. Each array of a recording would then be new pages to fill with zeros:
        # half of the time of a worker.
        "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": 8 * _KEPT,
        "distributed.nanny.pre-spawn-environ.MALLOC_MMAP_THRESHOLD_": _KEPT,
        # A profile of each second would be kept for an hour, which is more memory than all the work takes.
        "distributed.worker.profile.enabled": False,
        "distributed.admin.tick.limit": "60s",
    }
    with dask.config.set(settings), ExitStack() as stack:
        try:
            if workers.scheduler:
                client = stack.enter_context(Client(workers.scheduler, timeout=_START, set_as_default=False))
            else:
                cluster = stack.enter_context(
                    LocalCluster(
                        n_workers=workers.number,
                        threads_per_worker=1,
                        processes=True,
                        memory_limit=workers.memory,
                        host="127.0.0.1",  # this machine alone
                        dashboard_address="127.0.0.1:0",  # any port: several runs at once must not meet
                        silence_logs=logging.CRITICAL,
                    )
                )
                client = stack.enter_context(Client(cluster, set_as_default=False))
            client.wait_for_workers(1, timeout=_START)
        except (OSError, TimeoutError, ValueError, RuntimeError) as error:
            where = workers.scheduler or "--workers"
            raise InputError(where, f"gives no workers ({error})", "check the address, --workers and --memory") from None
        yield client
