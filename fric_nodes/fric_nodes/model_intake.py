"""Models for a running loop: compiled on a thread of their own, then handed over between two samples."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable

from fric.control.feedforward import prepare
from fric.model import Model
from rclpy.node import Node
from rclpy.task import Future

__all__ = ["ModelIntake"]


class ModelIntake:
    """Prepares models for ``node`` and gives each to ``use``, in the node's own thread.

    Args:
        node: whose executor calls ``use``.
        use: takes over a model that is ready.
    """

    def __init__(self, node: Node, use: Callable[[Model], None]) -> None:
        self._node = node
        self._use = use
        self._ready: deque[tuple[Model, Future]] = deque()
        node.create_timer(0.05, self._hand_over)

    def take(self, model: Model) -> Future:
        """Prepare ``model``, while the loop goes on; the result is done when it is in use."""
        done = Future(executor=self._node.executor)

        def work() -> None:
            try:
                prepare(model)
                self._ready.append((model, done))
            except Exception as error:  # whatever it was, it belongs to who asked for the model
                done.set_exception(error)

        threading.Thread(target=work, daemon=True).start()
        return done

    def _hand_over(self) -> None:
        while self._ready:
            model, done = self._ready.popleft()
            self._use(model)
            done.set_result(None)
