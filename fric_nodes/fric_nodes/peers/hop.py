"""One hop of the loop in lock-step beside one of a bare ping-pong of two rclpy nodes.

A sample of the loop takes two hops, one after the other: the joint state from the plant to the controller, and the command
back; references and feedforward are sent ahead. An answer of the ping-pong takes two as well. So a hop is half the time of
either. Between the hops of the loop its nodes simulate, control and check; it runs in four processes, and the ping-pong in
two. The ping-pong spins once with the executor of ``rclpy.spin``, and once with the events executor that the loop itself uses.
"""

from __future__ import annotations

import functools
import os
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from fric.bench.peer import Pair, Peer
from fric.errors import InputError

from ..benchmarks.lock_step import samples_per_second
from ..domain import graph_domain

__all__ = ["PEER", "answers_per_second"]

_DURATION = 8.0  # [s] of the axis, at 500 Hz
_MESSAGES = 4_000
_LIMIT = 60.0  # [s] physical scale: ten times what two processes take to find each other and to exchange so many
_TURNS = 5


def answers_per_second(executor: str, messages: int = _MESSAGES) -> float:
    """How many answers per second a ping-pong gives with the ``executor`` of :mod:`fric_nodes.ping_pong`.

    Raises:
        InputError: the two didn't hear each other.
    """
    with graph_domain() as domain:
        environment = os.environ | {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        command = [sys.executable, "-m", "fric_nodes.ping_pong"]
        with subprocess.Popen([*command, "pong", executor, "0"], env=environment) as pong:
            try:
                done = subprocess.run(
                    [*command, "ping", executor, str(messages)],
                    env=environment,
                    capture_output=True,
                    text=True,
                    timeout=_LIMIT,
                    check=False,
                )
            except subprocess.TimeoutExpired:
                raise InputError("ping-pong", f"no end within {_LIMIT:.0f} s", "try fric doctor") from None
            finally:
                pong.kill()
    found = re.search(r"(\d+\.\d+) answers/s", done.stdout)
    if found is None:
        raise InputError("ping-pong", f"ended without a rate: {done.stderr.strip()[-200:]}", "try fric doctor")
    return float(found.group(1))


def _bare_hop(executor: str) -> float:
    return 0.5 / answers_per_second(executor)


class _Loop:
    """The loop in lock-step, started anew for each measurement."""

    def __init__(self) -> None:
        self.hop = 0.0  # [s]

    def __call__(self) -> float:
        self.hop = 0.5 / samples_per_second(_DURATION)
        return self.hop


def prepare(_: Path) -> Sequence[Pair]:
    """With both executors; the loop, which takes longest to start, runs once for both of them in each round."""
    loop = _Loop()
    name = "lock-step hop against a bare rclpy ping-pong"

    def pair(executor: str, ours: Callable[[], float]) -> Pair:
        theirs = functools.partial(_bare_hop, executor)
        return Pair(f"{name}, {executor} executor", ours, theirs, "<= 1.5", _TURNS, warm=False)

    return pair("events", loop), pair("default", lambda: loop.hop)


PEER = Peer("hop", prepare)
