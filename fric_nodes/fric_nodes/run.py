"""The main function that all loop nodes share."""

from __future__ import annotations

import gc
import sys
import time
from collections.abc import Callable

import rclpy
from fric.errors import InputError
from rclpy.executors import ExternalShutdownException

from .base import LoopNode
from .lean_executor import LeanExecutor

__all__ = ["run"]


def run(make: Callable[[], LoopNode], args: list[str] | None = None) -> None:
    """Run the node that ``make`` makes until it has finished or a signal ends it.

    SIGINT, SIGTERM and the end of its work are exit status 0; an input that can't be used is one line and status 2.
    """
    refusal: InputError | None = None
    rclpy.init(args=args)
    try:
        executor = LeanExecutor()
        node = None
        try:
            node = make()
            executor.add_node(node)
            node.settle()
            # What was imported stays: without this, the first full collection looks at all of it and takes 100 ms and more.
            gc.collect()
            gc.freeze()
            executor.spin_until_future_complete(node.finished)
        except (KeyboardInterrupt, ExternalShutdownException):
            _let_the_signal_pass()
        except InputError:
            raise
        except Exception:
            # While the node is being made a signal may also show as a compilation broken off or a publisher refused.
            _let_the_signal_pass(0.2)
            if rclpy.ok():
                raise
        finally:
            executor.shutdown()
            if node is not None:
                node.close()
                node.destroy_node()
    except KeyboardInterrupt:
        _let_the_signal_pass()  # before the node was there
    except InputError as error:
        refusal = error
    finally:
        rclpy.try_shutdown()
    if refusal is not None:
        sys.stderr.write(f"{refusal}\n")
        sys.exit(2)


def _let_the_signal_pass(limit: float = 0.5) -> None:
    """Wait until the middleware has dealt with the signal: its own thread still wakes what is about to be destroyed."""
    deadline = time.monotonic() + limit
    while rclpy.ok() and time.monotonic() < deadline:
        time.sleep(0.002)
    time.sleep(0.01)
