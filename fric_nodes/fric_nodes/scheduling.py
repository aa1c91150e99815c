"""Real-time scheduling of the node's process, where the system grants it."""

from __future__ import annotations

import os
from pathlib import Path

__all__ = ["use_normal_scheduling", "use_realtime_scheduling"]


def use_realtime_scheduling(priority: int) -> str:
    """Put all threads of this process under SCHED_FIFO at ``priority`` (1 to 99); what came of it, in words."""
    if not hasattr(os, "sched_setscheduler"):
        return "normal: this system has no SCHED_FIFO"
    threads = [int(entry.name) for entry in Path("/proc/self/task").glob("*")] or [0]
    try:
        for thread in threads:
            # Among them are the middleware's own, which hand over the messages: they have to be as quick as the loop.
            os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(priority))
    except ProcessLookupError:
        pass  # a thread that ended meanwhile
    except OSError as error:
        return f"normal: SCHED_FIFO was refused ({error.strerror}); see ulimit -r"
    return f"SCHED_FIFO {priority}"


def use_normal_scheduling() -> None:
    """Put the calling thread under normal scheduling: one that a real-time thread starts would be as urgent as that."""
    if hasattr(os, "sched_setscheduler"):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
