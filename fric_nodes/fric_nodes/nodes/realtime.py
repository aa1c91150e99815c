"""Real-time priority for a node's threads, where the system grants it."""

from __future__ import annotations

import os
from pathlib import Path

__all__ = ["raise_priority"]


def raise_priority(priority: int) -> str | None:
    """Put every thread of this process, the middleware's too, under SCHED_FIFO; why not, when it can't be done.

    Args:
        priority: 1 to 99; above the middle only for what the machine itself depends on.
    """
    if not hasattr(os, "sched_setscheduler"):
        return "this system has no real-time scheduling"
    try:
        for thread in Path("/proc/self/task").iterdir():
            os.sched_setscheduler(int(thread.name), os.SCHED_FIFO, os.sched_param(priority))
    except PermissionError:
        return "not permitted: grant CAP_SYS_NICE or an rtprio limit"
    except OSError as error:
        return str(error)
    return None
