"""The main function of nodes that have something to finish: a bag to close, last messages to deliver, a last estimate.

rclpy's own signal handlers shut the context down at once, and with it the queues that are still to be emptied, and an exception
out of a handler may interrupt a write half-way. Here a signal only sets a flag, which is looked at between two rounds of the
executor; then the node closes in its own time, with a graph that still works.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable

import rclpy
from fric.errors import InputError
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

__all__ = ["OrderlyNode", "run"]


class OrderlyNode(Node):
    """A node that :func:`run` can serve."""

    @property
    def done(self) -> bool:
        """True when the node's work has come to its end; never, unless the node says otherwise."""
        return False

    def close(self) -> None:
        """Finish what has been begun.

        Raises:
            InputError: the work failed.
        """


def run(
    name: str,
    make: Callable[[], OrderlyNode],
    args: list[str] | None = None,
    kind: Callable[[], Executor] = SingleThreadedExecutor,
) -> None:
    """Serve the node that ``make`` makes until it is done, or SIGINT or SIGTERM comes: exit status 0.

    An input that cannot be used is one line, which begins with ``name``, and exit status 2. ``kind`` makes the executor.
    """
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = make()
        executor = kind()
        executor.add_node(node)
        try:
            while not (stop.is_set() or node.done):
                executor.spin_once(timeout_sec=0.1)
        finally:
            node.close()
            executor.shutdown()
            node.destroy_node()
    except InputError as error:
        sys.stderr.write(f"{name}: {' '.join(str(error).split())}\n")
        sys.exit(2)
    finally:
        rclpy.try_shutdown()
