"""Models for a running loop: taken in, compiled on a thread of their own, then handed over between two samples."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

from fric.control.feedforward import prepare
from fric.errors import InputError
from fric.model import Model
from fric.model_file import read_model

from fric_interfaces.msg import FrictionModel
from fric_interfaces.srv import LoadModel

from .base import FricNode
from .convert import model_from_message
from .qos import MODEL

__all__ = ["ModelIntake"]


class _Prepared(NamedTuple):
    """A model that was compiled, what went wrong, and whom to tell."""

    model: Model
    error: Exception | None
    done: Callable[[Exception | None], None]


class ModelIntake:
    """Prepares models for ``node`` and gives each to ``use``, in the node's own thread.

    The answer of ``~/load_model`` comes when the model is in use. rclpy 7.1's events executor doesn't await the callback of
    a service, so it isn't the callback that waits here, but the sending of what it returns.

    Args:
        node: whose executor calls ``use``; a setting ``follow_topic`` says whether models of the topic count.
        check: gives the model to use; raises InputError when it can't be used.
        use: takes over a model that is ready.
    """

    def __init__(self, node: FricNode, check: Callable[[Model], Model], use: Callable[[Model], None]) -> None:
        self._node = node
        self._check = check
        self._use = use
        self._ready: deque[_Prepared] = deque()
        node.create_timer(0.05, self._hand_over)
        node.create_subscription(FrictionModel, "friction/model", self._on_model, MODEL)
        pair: Any = lambda request, response: (request, response)  # noqa: E731
        service: Any = node.create_service(LoadModel, "~/load_model", pair)
        self._send, service.send_response = service.send_response, self._answer

    def _on_model(self, message: FrictionModel) -> None:
        if not self._node.settings.flag("follow_topic"):
            return
        try:
            self._take(self._check(model_from_message(message)), self._refuse)
        except InputError as error:
            self._refuse(error)

    def _refuse(self, error: Exception | None) -> None:
        if error is not None:
            self._node.refuse("model", error)

    def _answer(self, asked: tuple[LoadModel.Request, LoadModel.Response], header: Any) -> None:
        """Answer a request of ``~/load_model`` once its model is in use, or can't be used."""
        request, response = asked

        def answer(error: Exception | None) -> None:
            if error is not None:
                response.success, response.message = False, str(error)
            self._send(response, header)

        try:
            model = read_model(request.path) if request.path else model_from_message(request.model)
            response.success, response.message = True, f"{model.plant.id} with {', '.join(model.prefixes) or 'no terms'}"
            self._take(self._check(model), answer)
        except InputError as error:
            answer(error)

    def _take(self, model: Model, done: Callable[[Exception | None], None]) -> None:
        """Prepare ``model``, while the loop goes on; ``done`` is called when it is in use, or with what went wrong."""

        def work() -> None:
            error = None
            try:
                prepare(model)
            except Exception as failure:  # whatever it was, it belongs to who asked for the model
                error = failure
            self._ready.append(_Prepared(model, error, done))

        threading.Thread(target=work, daemon=True).start()

    def _hand_over(self) -> None:
        while self._ready:
            model, error, done = self._ready.popleft()
            if error is None:
                self._use(model)
                self._node.counters["models"] += 1
            done(error)
