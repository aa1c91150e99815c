"""An executor for a sample-by-sample loop: it keeps its list of entities and calls subscriptions and timers directly.

rclpy's SingleThreadedExecutor collects all entities anew for every wait and wraps every callback into a task, which costs in
the order of 100 us for each message. Here the entities are collected when one was made or destroyed, a wait then only names
their handles, and a message goes from the middleware straight to its callback: about a quarter of the time for a sample of the
lock-step loop. Services, clients and event handlers, which are not in a hurry, are left to the parent class.
"""

from __future__ import annotations

import time
from contextlib import ExitStack
from threading import RLock
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.executors import ExternalShutdownException, ShutdownException, SingleThreadedExecutor, TimeoutException
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

__all__ = ["LeanExecutor"]

_EVENTS = 64  # at most so many events of the middleware in one look, so that a storm of them can't hold up the samples
_HOUSEKEEPING = 0.5  # [s] between looks at what is not in the wait set (event handlers, tasks)
_SIGNAL_TIME = 0.1  # [s] from a signal to the end of the context
_BATCH = 256  # messages taken from one subscription before the others get their turn


class LeanExecutor(SingleThreadedExecutor):
    """Single-threaded executor with little work per message; spin as with any other."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._held = ExitStack()
        self._turning = RLock()
        self._wait_set: Any = None
        self._known: tuple[int, ...] = ()
        self._next_look = 0.0

    def _signature(self) -> tuple[int, ...]:
        """Changes when an entity of a node was made or destroyed."""
        return tuple(
            id(entity)
            for node in self.get_nodes()
            for kind in (node.subscriptions, node.timers, node.services, node.clients, node.guards)
            for entity in kind
        )

    def _collect(self) -> None:
        """Hold the handles of all entities and make a wait set that fits them."""
        self._release()
        nodes = self.get_nodes()
        self._subscriptions = [s for n in nodes for s in n.subscriptions if self.can_execute(s)]
        self._timers = [t for n in nodes for t in n.timers if self.can_execute(t)]
        self._services = [s for n in nodes for s in n.services]
        self._clients = [c for n in nodes for c in n.clients]
        self._guards: list[Any] = [self._guard, self._sigint_gc, *(g for n in nodes for g in n.guards)]
        # One that is being destroyed can't be held any more, and isn't waited on.
        self._subscriptions = [s for s in self._subscriptions if self._hold(s)]
        self._timers = [t for t in self._timers if self._hold(t)]
        self._services = [s for s in self._services if self._hold(s)]
        self._clients = [c for c in self._clients if self._hold(c)]
        self._guards = [g for g in self._guards if self._hold(g)]
        context: Any = self._context.handle
        self._held.enter_context(context)
        self._wait_set = _rclpy.WaitSet(
            len(self._subscriptions), len(self._guards), len(self._timers), len(self._clients), len(self._services), 0,
            context,
        )  # fmt: skip

    def _hold(self, entity: Any) -> bool:
        try:
            self._held.enter_context(entity.handle)
        except InvalidHandle:
            return False
        return True

    def _release(self) -> None:
        self._held.close()
        self._held = ExitStack()
        self._wait_set = None

    def _wait(self, timeout: float) -> None:
        wait_set = self._wait_set
        wait_set.clear_entities()
        for subscription in self._subscriptions:
            wait_set.add_subscription(subscription.handle)
        for timer in self._timers:
            wait_set.add_timer(timer.handle)
        for service in self._services:
            wait_set.add_service(service.handle)
        for client in self._clients:
            wait_set.add_client(client.handle)
        for guard in self._guards:
            wait_set.add_guard_condition(guard.handle)
        wait_set.wait(int(timeout * 1e9))
        if not self._context.ok():
            raise ExternalShutdownException

    def _look_around(self) -> None:
        """Let the parent class do what is left, and notice new entities."""
        for _ in range(2 * (len(self._services) + len(self._clients)) + _EVENTS):
            try:
                task = self.wait_for_ready_callbacks(timeout_sec=0.0)[0]
            except (TimeoutException, ShutdownException):
                break
            task()
            task.result()
        signature = self._signature()
        if signature != self._known:
            self._known = signature
            self._collect()

    def _spin_once_impl(self, timeout_sec: Any = None, *_: Any) -> None:
        """Wait for something to do, at most ``timeout_sec`` [s], and do all that is ready."""
        try:
            with self._turning:
                if not self._is_shutdown:
                    self._turn(timeout_sec)
        except RuntimeError:
            # A signal may end the context between any two calls, or interrupt a message on its way into Python; that is a
            # shutdown and not a fault. The middleware's own handler may take a moment to say so.
            deadline = time.monotonic() + _SIGNAL_TIME
            while self._context.ok():
                if time.monotonic() > deadline:
                    raise
                time.sleep(0.005)
            raise ExternalShutdownException from None

    def _turn(self, timeout_sec: Any) -> None:
        if self._wait_set is None:
            self._known = self._signature()
            self._collect()
        given = getattr(timeout_sec, "timeout", timeout_sec)
        timeout = _HOUSEKEEPING if given is None or given < 0.0 else min(given, _HOUSEKEEPING)
        self._wait(timeout)
        wait_set = self._wait_set
        ready = wait_set.get_ready_entities("subscription")
        timers = wait_set.get_ready_entities("timer")
        # Guards wake the wait when an entity was made or destroyed, and for shutdown.
        others = any(wait_set.get_ready_entities(kind) for kind in ("guard_condition", "service", "client"))
        for timer in self._timers:
            handle = timer.handle
            if handle.pointer in timers and handle.is_timer_ready():
                handle.call_timer()
                timer.callback()
        for subscription in self._subscriptions:
            handle = subscription.handle
            if handle.pointer in ready:
                take, kind, raw, callback = handle.take_message, subscription.msg_type, subscription.raw, subscription.callback
                for _n in range(_BATCH):
                    taken = take(kind, raw)
                    if taken is None:
                        break
                    callback(taken[0])
        if self._is_shutdown:
            return
        now = time.monotonic()
        if others or now >= self._next_look:
            self._next_look = now + _HOUSEKEEPING
            self._look_around()

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Stop, and let go of the nodes' entities."""
        # Another thread may be waiting: it is woken first, and what it waits on is let go only when it has come back.
        self._is_shutdown = True
        self.wake()
        with self._turning:
            self._release()
        return bool(super().shutdown(timeout_sec))
