"""A program for tests: publishes stamped joint states on several topics, once every topic has a subscriber.

Arguments: rate [1/s] (0: as fast as it goes), number of messages per topic, topics. Message k has stamp and position k ms.
"""

from __future__ import annotations

import sys
import time

import rclpy
from rclpy.duration import Duration
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState


def main() -> None:
    rate, count, topics = float(sys.argv[1]), int(sys.argv[2]), sys.argv[3:]
    rclpy.init()
    node = rclpy.create_node("talker")
    # The publisher must be able to send again what a busy machine let slip: with a queue of 32, a pause of 8 ms of the
    # receiving process would lose messages at 4000 a second.
    publishers = [node.create_publisher(JointState, topic, QoSProfile(depth=2000)) for topic in topics]
    while any(publisher.get_subscription_count() == 0 for publisher in publishers):
        time.sleep(0.01)
    time.sleep(0.3)  # the other side needs a moment more than this one to know
    message = JointState(name=["axis"], position=[0.0], velocity=[0.0], effort=[1.0])
    begin = time.monotonic()
    for k in range(count):
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(k * 1_000_000, 1_000_000_000)
        message.position[0] = k * 1e-3
        for publisher in publishers:
            publisher.publish(message)
        if rate:
            time.sleep(max(begin + (k + 1) / rate - time.monotonic(), 0.0))
    # What was lost on the way is asked for again every 3 s only: on a busy machine, a few rounds of that are to be expected.
    arrived = [publisher.wait_for_all_acked(Duration(seconds=60.0)) for publisher in publishers]
    rclpy.shutdown()
    if not all(arrived):
        sys.exit(f"not acknowledged: {[topic for topic, there in zip(topics, arrived, strict=True) if not there]}")


if __name__ == "__main__":
    main()
