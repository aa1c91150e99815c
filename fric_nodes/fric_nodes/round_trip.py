"""A message through the middleware and back, in one process: does DDS work on this machine at all."""

from __future__ import annotations

import time

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from fric_interfaces.msg import StampedForce

from .qos import SAMPLES

__all__ = ["round_trip"]

_MESSAGES = 20


def round_trip(limit: float = 10.0) -> float | None:
    """Median time from publishing to hearing [s]; None when nothing is heard within ``limit`` [s].

    It has a context of its own, so that it may run beside anything else.
    """
    context = Context()
    context.init()
    speaker = listener = executor = None
    heard: list[float] = []

    def hear(message: StampedForce) -> None:
        heard.append(message.force)

    try:
        speaker = Node("fric_doctor_speaker", context=context, start_parameter_services=False, enable_rosout=False)
        listener = Node("fric_doctor_listener", context=context, start_parameter_services=False, enable_rosout=False)
        topic = f"/fric_doctor_{time.monotonic_ns()}"
        publisher = speaker.create_publisher(StampedForce, topic, SAMPLES)
        listener.create_subscription(StampedForce, topic, hear, SAMPLES)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(listener)
        deadline = time.monotonic() + limit
        times: list[float] = []
        while len(times) < _MESSAGES and time.monotonic() < deadline:
            if publisher.get_subscription_count() == 0:
                executor.spin_once(timeout_sec=0.05)
                continue
            wanted, sent = float(len(times)) + 0.5, time.monotonic()
            publisher.publish(StampedForce(force=wanted))
            while wanted not in heard and time.monotonic() < deadline:
                executor.spin_once(timeout_sec=0.05)
            if wanted in heard:
                times.append(time.monotonic() - sent)
        return sorted(times)[len(times) // 2] if len(times) == _MESSAGES else None
    finally:
        if executor is not None:
            executor.shutdown()
        for node in (speaker, listener):
            if node is not None:
                node.destroy_node()
        context.try_shutdown()
