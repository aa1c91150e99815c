"""A graph of processes with one axis in motion, whose topics pass a relay that can spoil them.

The plant's joint states, the excitation's references and the controller's forces have a topic of their own (``raw/...``); the
relay, a node of this process, hands them on under the names that the others listen to. What it hears on ``/diagnostics`` is
kept.
"""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from fric.bench.fault_rig import LIMITS
from fric.errors import InputError
from fric.shared_files import config_file
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.client import Client
from rclpy.context import Context
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from fric_interfaces.msg import Reference

from ..qos import LATEST, SAMPLES
from .judge import Judge
from .judged_plant import FOLDER

__all__ = ["PERIOD", "GraphRig", "RigError"]

PERIOD = 0.004  # [s]
_WATCHDOG = 0.05  # [s]
_JUMP = 0.003  # physical scale: [m] no axis of this graph moves so far between two looks
_BOUNDS: Mapping[str, float] = {
    "force_limit": LIMITS.force, "force_rate": LIMITS.force_rate, "speed_limit": LIMITS.speed,
    "position_min": LIMITS.position_min, "position_max": LIMITS.position_max, "inertia_min": LIMITS.inertia_min,
    "inertia_max": LIMITS.inertia_max, "friction": LIMITS.friction, "viscous": LIMITS.viscous, "load": LIMITS.load,
}  # fmt: skip


class _Setup(NamedTuple):
    module: str
    remapped: tuple[str, ...]
    parameters: Mapping[str, object]


_NODES: Mapping[str, _Setup] = {
    "plant": _Setup(
        "fric_nodes.fault_graph.judged_plant", ("joint_states",), {**_BOUNDS, "watchdog_time": _WATCHDOG, "force_noise": 0.0}
    ),
    "pid": _Setup(
        "fric_nodes.nodes.pid", ("force_command",),
        # The relay is another process on the way: the latency that the layer reckons with is larger than without it.
        {**_BOUNDS, "kp": 8000.0, "ki": 1.5e5, "kd": 200.0, "filter_time": 0.001, "position_noise": 1e-6, "latency": 0.02,
         "brake_time": 0.06, "following_error": 0.03, "reference_speed": 0.5, "reference_min": -0.08, "reference_max": 0.08},
    ),
    "excitation": _Setup(
        "fric_nodes.nodes.excitation", ("reference",),
        {"multisine.duration": 4.0, "multisine.frequency_low": 0.25, "multisine.frequency_high": 1.0,
         "multisine.amplitude": 0.02, "multisine.speed": 0.1, "multisine.ramp": 0.2, "start_delay": 0.2, "pause": 0.0,
         "repeat": True},
    ),
    "compensator": _Setup("fric_nodes.nodes.compensator", (), {"model_file": config_file("demo_axis.yaml")}),
}  # fmt: skip
_LIMITED = "import os, resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, 2 * ({},)); os.execv(sys.argv[1], sys.argv[1:])"
_RELAYED = {"joint_states": JointState, "reference": Reference, "force_command": Float64}


def _as_yaml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.9f}" if isinstance(value, float) else str(value)


class RigError(InputError):
    """The graph didn't come up, or a node of it doesn't answer."""


class GraphRig:
    """The graph; a context manager.

    Args:
        folder: for logs and records.
        domain: ROS domain id.

    Attributes:
        wires: by topic, what the relay makes of a message; None: it hands it on unharmed.
        processes: by node.
        judge: of what reached the drive.
        node: of this process.
    """

    def __init__(self, folder: Path, domain: int) -> None:
        self._folder, self._domain = folder, domain
        self.wires: dict[str, Callable[[Any], list[Any]] | None] = dict.fromkeys(_RELAYED)
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        self.judge = Judge(folder, LIMITS, _WATCHDOG)
        self._counted: dict[tuple[str, str], str] = {}
        self._said: set[str] = set()
        self._position = math.nan
        self._bags = 0
        self._over = False
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain)
        self.node = Node("relay", context=self._context)
        self._publishers = {topic: self.node.create_publisher(kind, topic, SAMPLES) for topic, kind in _RELAYED.items()}
        for topic, kind in _RELAYED.items():
            self.node.create_subscription(kind, f"raw/{topic}", self._relay(topic), LATEST)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_report, 50)
        self._clients: dict[tuple[str, str], Client] = {}
        self._executor = EventsExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, name="relay")

    def __enter__(self) -> GraphRig:
        self._thread.start()
        for name in _NODES:
            self.start(name)
        self.until(self.recover, "the axis moves", 60.0)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        for process in self.processes.values():
            process.kill()
            process.wait()
        self._over = True
        self._thread.join()
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def _spin(self) -> None:
        while not self._over:
            self._executor.spin_once(timeout_sec=0.1)

    def _relay(self, topic: str) -> Callable[[Any], None]:
        publisher = self._publishers[topic]

        def hand_on(message: Any) -> None:
            if topic == "joint_states":
                self._position = message.position[0]
            wire = self.wires[topic]
            for each in [message] if wire is None else wire(message):
                publisher.publish(each)

        return hand_on

    def _on_report(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self._said.add(status.message)
            for pair in status.values:
                key = (status.name, pair.key)
                if pair.value != self._counted.get(key):
                    # A process that has started anew counts from zero.
                    self._said.add(f"{pair.key} {pair.value}" if pair.key == "faults" else pair.key)
                self._counted[key] = pair.value

    # Processes

    def start(self, name: str) -> None:
        """Start the process of a node."""
        setup = _NODES[name]
        for known in [known for known in list(self._counted) if known[0] == name]:
            del self._counted[known]
        command = [sys.executable, "-m", setup.module, "--ros-args"]
        for topic in setup.remapped:
            command += ["-r", f"{topic}:=raw/{topic}"]
        for key, value in {"period": PERIOD, "diagnostics_period": 0.1, **setup.parameters}.items():
            command += ["-p", f"{key}:={_as_yaml(value)}"]
        environment = {**os.environ, "ROS_DOMAIN_ID": str(self._domain), FOLDER: str(self._folder)}
        environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        with (self._folder / f"{name}.log").open("ab") as log:
            self.processes[name] = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT, env=environment
            )

    def record(self, most: int) -> subprocess.Popen[str]:
        """Start a recorder that may write so many bytes into a file, as on a disk that is full then; its output is piped."""
        self._bags += 1
        command = [sys.executable, "-m", "fric_nodes.nodes.recorder"]
        command += ["--ros-args", "-p", f"bag:={self._folder / f'bag{self._bags}'}"]
        environment = {**os.environ, "ROS_DOMAIN_ID": str(self._domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        return subprocess.Popen(
            [sys.executable, "-c", _LIMITED.format(most), *command],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=environment,
        )

    def kill(self, name: str) -> None:
        """End the process of a node at once."""
        self.processes[name].kill()
        self.processes[name].wait()

    def send(self, name: str, number: signal.Signals) -> None:
        """Send a signal to the process of a node."""
        self.processes[name].send_signal(number)

    # What is heard, and asked

    def forget(self) -> None:
        """Forget what was said on ``/diagnostics``."""
        self._said.clear()

    def heard(self, name: str) -> None:
        """Count ``name`` as said: an answer names the cause, too."""
        self._said.add(name)

    @property
    def said(self) -> frozenset[str]:
        """Names of what has been counted or found since then, and the texts of the reports."""
        return frozenset(self._said.copy())

    @staticmethod
    def until(condition: Callable[[], object], what: str, limit: float) -> None:
        """Wait until ``condition`` holds.

        Raises:
            RigError: it doesn't within ``limit`` [s].
        """
        end = time.monotonic() + limit
        while not condition():
            if time.monotonic() > end:
                raise RigError("graph", f"not within {limit:g} s: {what}", "a busy machine may need longer; try again")
            time.sleep(0.01)

    def moves(self, limit: float = 5.0) -> bool:
        """True when the axis goes over more than 4 mm within ``limit`` [s]."""
        end = time.monotonic() + limit
        low = high = before = self._position
        while time.monotonic() < end:
            now = self._position
            if not abs(now - before) < _JUMP:  # nothing known yet, or a plant that has started anew
                low = high = now
            low, high, before = min(low, now), max(high, now), now
            if high - low > 0.004:
                return True
            time.sleep(0.01)
        return False

    def _ask(self, kind: Any, service: str, request: Any, limit: float = 3.0) -> Any:
        client = self._clients.setdefault((kind.__name__, service), self.node.create_client(kind, service))
        if not client.wait_for_service(timeout_sec=limit):
            return None
        future = client.call_async(request)
        end = time.monotonic() + limit
        while not future.done() and time.monotonic() < end:
            time.sleep(0.005)
        return future.result() if future.done() else None

    def set(self, name: str, parameter: str, value: float) -> bool | None:
        """Set a parameter; True when it was accepted, None without an answer."""
        given = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)
        request = SetParameters.Request(parameters=[Parameter(name=parameter, value=given)])
        answer = self._ask(SetParameters, f"{name}/set_parameters", request)
        return None if answer is None else bool(answer.results[0].successful)

    @property
    def enabled(self) -> bool:
        """True when plant and controller have said that they let forces through."""
        return all(self._counted.get((name, "safety state")) == "enabled" for name in ("plant", "pid"))

    def recover(self) -> bool:
        """Reset what is latched and enable again; True when every node has reported and the axis moves."""
        end = time.monotonic() + 30.0
        while time.monotonic() < end:
            if not set(_NODES) <= {name for name, _ in list(self._counted)}:
                time.sleep(0.05)
                continue
            for name in ("plant", "pid"):
                state = self._counted.get((name, "safety state"), "")
                if state == "fault":
                    self._ask(Trigger, f"{name}/reset_fault", Trigger.Request())
                if state in {"fault", "disabled"}:
                    self._ask(Trigger, f"{name}/enable", Trigger.Request())
            if self.moves(1.5):
                return True
        return False
