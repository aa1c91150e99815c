"""Services without arguments that do something at once, or say in one line why not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from fric.errors import InputError
from rclpy.node import Node
from std_srvs.srv import Trigger

__all__ = ["add_triggers"]


def add_triggers(node: Node, actions: Mapping[str, Callable[[], object]]) -> None:
    """Offer each action as a service ``~/NAME``; its answer is what the action gives, or the text of its refusal."""
    for name, action in actions.items():
        node.create_service(Trigger, f"~/{name}", _answering(action))


def _answering(action: Callable[[], object]) -> Callable[[Any, Any], Any]:
    def answer(_request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            response.message, response.success = str(action()), True
        except InputError as error:
            response.message, response.success = str(error), False
        return response

    return answer
