"""How many threads work on one recording.

The compiled loops leave the interpreter to others, so that threads that follow a recording with different models run at once;
the linear algebra between them is small, and threads of its own would only take the time of these.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import lru_cache
from multiprocessing import connection, parent_process
from typing import TypeVar

from threadpoolctl import threadpool_limits

from .errors import InputError

__all__ = ["alone", "end_with_parent", "keep_linear_algebra_in_one", "linear_algebra_in_one", "mapped", "n_threads"]

Item = TypeVar("Item")
Result = TypeVar("Result")

_MOST = 8
_NAME = "FRIC_THREADS"
_of_thread = threading.local()
_OF_LIBRARIES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


def n_threads() -> int:
    """As many as there are cores, at most eight, or what the environment variable FRIC_THREADS says.

    Raises:
        InputError: that is no number above 0.
    """
    asked = os.environ.get(_NAME, "")
    if not asked:
        return min(os.cpu_count() or 1, _MOST)
    if not asked.isdecimal() or int(asked) < 1:
        raise InputError(_NAME, f"{asked!r} is no number of threads", "set it to 1 or more, or not at all")
    return int(asked)


def mapped(function: Callable[[Item], Result], items: Iterable[Item], threads: int | None = None) -> list[Result]:
    """``function`` of each of the ``items``, in their order, by ``threads`` threads, by default :func:`n_threads`.

    What one of them raises is raised here.
    """
    work, threads = list(items), threads or n_threads()
    # What runs in the pool would wait for ever for threads of the same pool.
    if threads == 1 or len(work) < 2 or getattr(_of_thread, "works", False):
        return [function(item) for item in work]
    return list(_pool(threads).map(function, work))


def _works() -> None:
    """Mark the calling thread as one of a pool."""
    _of_thread.works = True


@lru_cache(maxsize=4)
def _pool(threads: int) -> ThreadPoolExecutor:
    """Kept: a diagnosis asks for it some thousand times, and threads take longer to start than to follow a short recording."""
    return ThreadPoolExecutor(threads, thread_name_prefix="fric", initializer=_works)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)  # threads don't come along


def alone() -> None:
    """Make this process use one thread for everything: it is one of several that each have a core."""
    for name in (_NAME, *_OF_LIBRARIES):
        os.environ[name] = "1"  # for libraries that are loaded later
    threadpool_limits(1)  # for those that are there
    end_with_parent()


def end_with_parent() -> None:
    """Make this process end when the one that started it does, however that was.

    A process of a pool waits for work for ever, also from a parent that was killed.
    """
    parent = parent_process()
    if parent is None:
        return

    def wait() -> None:
        connection.wait([parent.sentinel])
        os._exit(1)  # nobody is left who could want a result

    threading.Thread(target=wait, name="end with parent", daemon=True).start()


@contextmanager
def linear_algebra_in_one() -> Iterator[None]:
    """While it lasts, linear algebra uses the calling thread alone."""
    with threadpool_limits(1, user_api="blas"):
        yield


def keep_linear_algebra_in_one() -> None:
    """Make linear algebra use one thread in this process and in those that it starts, unless the environment says how many.

    The matrices here are small. With other work on the machine, the threads that share one wait for each other far longer than
    they compute.
    """
    if any(name in os.environ for name in _OF_LIBRARIES):
        return
    for name in _OF_LIBRARIES:
        os.environ[name] = "1"  # for libraries that are loaded later
    if "numpy" in sys.modules:
        threadpool_limits(1, user_api="blas")  # for those that are there
