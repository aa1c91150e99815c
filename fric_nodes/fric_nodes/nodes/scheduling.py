"""Real-time scheduling of the node's process, where the system grants it."""

from __future__ import annotations

import os
from pathlib import Path

__all__ = ["use_realtime_scheduling"]


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
