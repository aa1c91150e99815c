"""How many threads work on one recording.

The compiled loops leave the interpreter to others, so that threads that follow a recording with different models run at once;
the linear algebra between them is small, and threads of its own would only take the time of these.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits

__all__ = ["alone", "linear_algebra_in_one", "n_threads"]

_MOST = 8
_NAME = "FRIC_THREADS"
_OF_LIBRARIES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


def n_threads() -> int:
    """As many as there are cores, at most eight, or what the environment variable FRIC_THREADS says."""
    asked = os.environ.get(_NAME, "")
    return max(int(asked), 1) if asked.isdigit() else min(os.cpu_count() or 1, _MOST)


def alone() -> None:
    """Make this process use one thread for everything: it is one of several that each have a core."""
    for name in (_NAME, *_OF_LIBRARIES):
        os.environ[name] = "1"  # for libraries that are loaded later
    threadpool_limits(1)  # for those that are there


@contextmanager
def linear_algebra_in_one() -> Iterator[None]:
    """While it lasts, linear algebra uses the calling thread alone."""
    with threadpool_limits(1, user_api="blas"):
        yield
