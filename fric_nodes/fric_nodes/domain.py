"""A ROS domain that no other graph of ours on this machine uses meanwhile."""

from __future__ import annotations

import fcntl
import os
import random
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["graph_domain", "reserved_domain"]

_DOMAINS = range(1, 101)  # above that, the ports of DDS fall into those that the system gives away


@contextmanager
def reserved_domain() -> Iterator[int]:
    """A ROS domain id; until the context ends, no other process on this machine gets it from here.

    Raises:
        RuntimeError: all hundred are taken.
    """
    for domain in random.sample(_DOMAINS, len(_DOMAINS)):
        try:
            file = (Path(tempfile.gettempdir()) / f"fric-domain-{domain}.lock").open("w")
        except PermissionError:  # another user's
            continue
        with file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            yield domain
            return
    raise RuntimeError("no free ROS domain among 1 to 100: too many graphs run on this machine")


@contextmanager
def graph_domain() -> Iterator[int]:
    """The ROS domain of the environment (``ROS_DOMAIN_ID``); a reserved one where it names none."""
    given = os.environ.get("ROS_DOMAIN_ID")
    if given:
        yield int(given)
        return
    with reserved_domain() as domain:
        yield domain
