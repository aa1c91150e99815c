"""How many threads work on one recording.

The compiled loops leave the interpreter to others, so that threads that follow a recording with different models run at once;
the linear algebra between them is small, and threads of its own would only take the time of these.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing import connection, parent_process
from typing import TypeVar

from threadpoolctl import threadpool_limits

from .errors import InputError

__all__ = ["alone", "end_with_parent", "linear_algebra_in_one", "mapped", "n_threads"]

Item = TypeVar("Item")
Result = TypeVar("Result")

_MOST = 8
_NAME = "FRIC_THREADS"
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
    threads = threads or n_threads()
    if threads == 1:
        return [function(item) for item in items]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(function, items))


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
