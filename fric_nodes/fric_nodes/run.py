"""The main function of every node.

rclpy's own signal handlers shut the context down at once, and with it the queues that are still to be emptied, and an exception
out of a handler may interrupt a write half-way. Here a signal only sets a flag once the node is made. The flag is looked at
between two rounds of the executor; then the node closes in its own time, with a graph that still works. While the node is being
made, which may take a compilation, a signal breaks that off.
"""

from __future__ import annotations

import gc
import re
import signal
import sys
from collections.abc import Callable
from contextlib import ExitStack
from types import FrameType

import rclpy
from fric.errors import InputError
from fric.threads import keep_linear_algebra_in_one
from rclpy.signals import SignalHandlerOptions

from .arguments import check_arguments, help_text, params_files
from .base import Described, FricNode

__all__ = ["run"]

# [s] at most between a signal and the end of the executor's round; without a limit rclpy 7.1's events executor waits for ever
_LOOK = 0.1


class _Stop:
    """What SIGINT and SIGTERM have asked for."""

    def __init__(self) -> None:
        self.asked = False
        self.made = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._on_signal)

    @staticmethod
    def ignore() -> None:
        """Let further signals pass."""
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        first, self.asked = not self.asked, True
        if first and not self.made:
            raise KeyboardInterrupt


def run(kind: Callable[..., FricNode], args: list[str] | None = None) -> None:
    """Make the node and serve it until it is done, or SIGINT or SIGTERM comes: exit status 0.

    Args:
        kind: the node's class.
        args: ROS arguments; those of the process when None.

    An input that can't be used is one line, which begins with the node's name, and exit status 2. ``--help`` lists the
    parameters.
    """
    stop = _Stop()
    keep_linear_algebra_in_one()
    name = re.sub(r"(?<!^)(?=[A-Z])", "_", kind.__name__.removesuffix("Node")).lower()
    try:
        args = sys.argv if args is None else args
        if check_arguments(args):
            sys.stdout.write(_help(kind, name))
            return
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        node = kind()
        stop.made = True
        files = params_files(args)
        if files and not node._parameter_overrides:  # rclpy has no public way to ask for them
            said = f"nothing in {', '.join(files)} is for {node.get_fully_qualified_name()}: see the name above ros__parameters"
            node.get_logger().warning(said)
        _serve(node, stop)
    except InputError as error:
        sys.stderr.write(f"{name}: {' '.join(str(error).split())}\n")
        sys.exit(2)
    except BaseException:
        # A signal may also show as a compilation that was broken off.
        if stop.made or not stop.asked:
            raise
    finally:
        stop.made = True
        rclpy.try_shutdown()
        # A launch system passes on a signal that the terminal has sent already; the interpreter, about to end, would die of it.
        stop.ignore()


def _help(kind: Callable[..., FricNode], name: str) -> str:
    try:
        kind(describe=True)
    except Described as found:
        about = " ".join((sys.modules[kind.__module__].__doc__ or "").split("\n\n", maxsplit=1)[0].split())
        return help_text(name, about.replace("``", ""), found.declarations)
    raise TypeError(f"{kind.__name__} does not hand its options on to FricNode")


def _serve(node: FricNode, stop: _Stop) -> None:
    executor = node.make_executor()
    with ExitStack() as ending:
        ending.callback(node.destroy_node)
        ending.callback(executor.shutdown)
        ending.callback(node.close)
        executor.add_node(node)
        node.begin()
        node.introduce()
        # What was imported stays: without this, the first full collection looks at all of it and takes 100 ms and more.
        gc.collect()
        gc.freeze()
        while not (stop.asked or node.done):
            executor.spin_once(timeout_sec=_LOOK)
