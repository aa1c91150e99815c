"""The services of the node ``identifier``: start, freeze, reset, save."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fric.errors import InputError
from fric.identification.online.session import Session
from fric.record import Units
from rclpy.node import Node

from fric_interfaces.srv import FreezeIdentification, ResetIdentification, SaveIdentification, StartIdentification

__all__ = ["offer_services"]


def offer_services(node: Node, session: Session, units: Units, joint: Callable[[], str], changed: Callable[[], None]) -> None:
    """Offer the services of ``node``.

    Args:
        node: whose services they are.
        session: what they act on.
        units: of terms that are started.
        joint: name of the joint, for a model that is saved.
        changed: called after what was estimated has been frozen or forgotten.
    """

    def start(request: Any, response: Any) -> Any:
        return _answer(response, lambda: session.start(list(request.terms), units, request.forgetting_time))

    def freeze(request: Any, response: Any) -> Any:
        return _answer(response, lambda: session.freeze(request.freeze), changed)

    def reset(_request: Any, response: Any) -> Any:
        return _answer(response, session.reset, changed)

    def save(request: Any, response: Any) -> Any:
        def written() -> str:
            response.path = str(session.save(request.path, joint()))
            return f"written: {response.path}"

        return _answer(response, written)

    node.create_service(StartIdentification, "~/start", start)
    node.create_service(FreezeIdentification, "~/freeze", freeze)
    node.create_service(ResetIdentification, "~/reset", reset)
    node.create_service(SaveIdentification, "~/save", save)


def _answer(response: Any, act: Callable[[], str], afterwards: Callable[[], None] = lambda: None) -> Any:
    """``response`` with what came of ``act``, in words; ``afterwards`` follows where it went well."""
    try:
        response.success, response.message = True, act()
    except (InputError, OSError) as error:
        response.success, response.message = False, str(error)
        return response
    afterwards()
    return response
