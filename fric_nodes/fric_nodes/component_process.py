"""A process that finds out which component of a machine changed.

That takes seconds of processor time, and before it is first asked a compilation. No sample waits for a process of its own.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool

from fric.diagnosis.suspects import Suspects, prepare_suspects, suspects
from fric.model import Model
from fric.model_file import model_from_text, model_to_text
from fric.record import Record
from fric.threads import end_with_parent

__all__ = ["ComponentProcess", "EndedError"]

_THE_NODES = (signal.SIGINT, signal.SIGTERM)
"""Signals that the node answers, and that reach all processes of a terminal."""


class EndedError(RuntimeError):
    """The process was ended by something else, for instance for want of memory."""


def _calm() -> None:
    """Leave the signals to the node, and the processor to the machine."""
    for number in _THE_NODES:
        signal.signal(number, signal.SIG_IGN)
    os.nice(5)
    end_with_parent()


def _prepare(text: str) -> None:
    prepare_suspects(model_from_text(text))


def _suspects(text: str, record: Record, bandwidth: float, floor: float) -> Suspects:
    return suspects(model_from_text(text), record, bandwidth, floor)


class ComponentProcess:
    """Names the component that changed against ``model``; one question at a time."""

    def __init__(self, model: Model) -> None:
        self._text = model_to_text(model)
        self._pool: ProcessPoolExecutor | None = ProcessPoolExecutor(
            1, mp_context=multiprocessing.get_context("spawn"), initializer=_calm
        )
        # The process inherits that they are blocked: a Ctrl-C while it still imports would end it with a traceback.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, _THE_NODES)
        try:
            self._ready = self._pool.submit(_prepare, self._text)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        self._pending: tuple[Future[Suspects], int] | None = None

    def prepared(self) -> bool:
        """True when an answer takes no compilation first."""
        return self._pool is not None and self._ready.done()

    @property
    def free(self) -> bool:
        """True when it can be asked now."""
        return self.prepared() and self._pending is None

    def ask(self, record: Record, bandwidth: float, floor: float, stamp: int) -> None:
        """Have ``record`` looked at; ``stamp`` [ns] comes back with the answer.

        Raises:
            EndedError: the process is no longer there.
        """
        pool = self._pool
        if pool is None:
            return
        try:
            self._pending = pool.submit(_suspects, self._text, record, bandwidth, floor), stamp
        except BrokenProcessPool:
            self._pool = None
            raise EndedError("process that names components ended") from None
        except RuntimeError:
            if self._pool is not None:  # or else it was shut down meanwhile, with the node
                raise

    def answer(self) -> tuple[Suspects, int] | None:
        """The answer and its stamp [ns], once, when it has come.

        Raises:
            Exception: whatever kept the component from being named.
        """
        if self._pending is None or not self._pending[0].done():
            return None
        (future, stamp), self._pending = self._pending, None
        if future.cancelled():
            return None  # with the process that was to do it, as the node ends
        return future.result(), stamp

    def close(self) -> None:
        """End the process."""
        pool, self._pool = self._pool, None
        if pool is not None:
            for process in list((pool._processes or {}).values()):
                process.kill()
            pool.shutdown(wait=True, cancel_futures=True)
