"""Publishes a recording into the running graph: the same bytes, in the same order, at the recording's own pace or another."""

from __future__ import annotations

import math
import signal
import sys
import threading
from pathlib import Path
from typing import Any

import rclpy
from builtin_interfaces.msg import Time
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rosgraph_msgs.msg import Clock

from ..bagio.errors import BagError
from ..bagio.read import bag_info, iterate_raw
from ..bagio.topics import Raw
from ..errors import InputError
from .bulk import message_class
from .playback import Due, Pace, schedule

__all__ = ["PlayerNode", "main"]
