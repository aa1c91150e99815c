"""The bridge over the real graph: a drive on a pseudo-terminal, one on a virtual CAN bus, and one behind topics."""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from fric.axis import SimulatedAxis
from fric.drives.serial_emulator import SerialEmulator
from fric.errors import InputError
from fric.model import build_model, term
from fric_nodes.nodes.hardware_bridge import HardwareBridgeNode
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray
from std_srvs.srv import Trigger

if TYPE_CHECKING:
    from .conftest import Graph

DEEP = QoSProfile(depth=2000)
# Timeouts are generous: the machine may be busy, and it isn't its speed that is tested.
LIMITS = {
    "force_limit": 50.0, "force_rate": 2000.0, "inertia_min": 1.6, "inertia_max": 2.4, "friction": 40.0, "latency": 0.05,
    "brake_time": 0.2, "command_timeout": 0.5, "state_timeout": 0.5, "position_noise": 1e-3, "period": 0.005,
    "diagnostics_period": 0.05, "wait_for_subscribers": 0,
}  # fmt: skip


def axis() -> SimulatedAxis:
    made = SimulatedAxis(build_model("rigid", {"mass": 2.0}, [term("coulomb", force=5.0), term("viscous", coefficient=35.0)]))
    made.advance(0.0, 1e-12)  # compiled here and not while a drive waits for its answer
    made.measure()
    return made


class Partner:
    """Commands, listens and asks."""

    def __init__(self, graph: Graph, **parameters: object) -> None:
        self.graph = graph
        overrides = [Parameter(name, value=value) for name, value in {**LIMITS, **parameters}.items()]
        self.bridge = graph.owns(HardwareBridgeNode(context=graph.context(), parameter_overrides=overrides))
        self.node = graph.node("partner")
        self.states: list[JointState] = []
        self.reports: list[DiagnosticStatus] = []
        self.force: float | None = None
        self.node.create_subscription(JointState, "joint_states", self.states.append, DEEP)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", lambda m: self.reports.extend(m.status), 10)
        self.publisher = self.node.create_publisher(Float64, "force_command", DEEP)
        self.node.create_timer(0.005, self._command)
        self.clients = {
            name: self.node.create_client(Trigger, f"hardware_bridge/{name}") for name in ("enable", "disable", "reset_fault")
        }
        graph.spin(self.bridge)
        graph.spin(self.node)

    def _command(self) -> None:
        if self.force is not None:
            self.publisher.publish(Float64(data=self.force))

    def ask(self, name: str) -> Any:
        return self.graph.ask(self.clients[name], Trigger.Request(), name)

    def says(self, text: str) -> Callable[[], bool]:
        """True when the newest report has ``text`` somewhere."""
        return lambda: bool(self.reports) and text in str([self.reports[-1].message, *self.reports[-1].values])

    def enable(self) -> None:
        self.graph.until(lambda: len(self.states) > 5, "joint states")
        self.graph.until(lambda: self.ask("enable").success, "enabled")


@pytest.fixture
def emulator(tmp_path: Path) -> Iterator[SerialEmulator]:
    made = SerialEmulator(axis(), tmp_path / "drive", time.monotonic_ns, watchdog=0.3)
    made.plug()
    made.serve()
    yield made
    made.close()


def test_commands_act_only_when_enabled_and_every_cause_is_named(
    graph: Graph, emulator: SerialEmulator, tmp_path: Path
) -> None:
    partner = Partner(graph, **{"driver": "serial", "serial.port": str(tmp_path / "drive"), "serial.timeout": 0.3})
    partner.force = 10.0
    graph.until(lambda: len(partner.states) > 20, "joint states")
    assert emulator.force == 0.0
    assert partner.says("disabled")()
    partner.enable()
    graph.until(lambda: emulator.force == 10.0, "the force acts")
    graph.until(lambda: partner.states[-1].effort[0] == pytest.approx(10.0), "and is reported")
    # Not finite: refused by name, and lost in the end.
    partner.force = math.nan
    graph.until(lambda: emulator.force == 0.0, "the axis is stopped")
    graph.until(partner.says("command lost (last one refused: not finite)"), "the cause is named")
    assert partner.reports[-1].level in {DiagnosticStatus.ERROR, DiagnosticStatus.WARN, DiagnosticStatus.OK}
    partner.force = 5.0
    assert "command lost" in partner.ask("enable").message
    graph.until(lambda: partner.ask("reset_fault").success, "reset")
    partner.enable()
    graph.until(lambda: emulator.force == 5.0, "it moves again")
    # A second publisher.
    other = graph.node("intruder")
    second = other.create_publisher(Float64, "force_command", DEEP)
    time.sleep(0.2)
    assert emulator.force == 5.0  # as long as it is silent, nothing happens: a process that was killed looks like that
    other.create_timer(0.005, lambda: second.publish(Float64(data=40.0)))
    graph.spin(other)
    graph.until(partner.says("second command source (2 publishers"), "the second publisher is named")
    graph.until(lambda: emulator.force == 0.0, "and stops the axis")


def test_a_drive_that_is_unplugged_comes_back_without_force(graph: Graph, emulator: SerialEmulator, tmp_path: Path) -> None:
    partner = Partner(
        graph, **{"driver": "serial", "serial.port": str(tmp_path / "drive"), "serial.timeout": 0.3, "enable_at_start": True}
    )
    partner.force = 10.0
    graph.until(lambda: emulator.force == 10.0, "it starts by itself")
    emulator.close()
    graph.until(partner.says("drive"), "the loss is named")
    seen = len(partner.states)
    begin = time.monotonic()
    emulator.plug()
    emulator.serve()
    graph.until(lambda: len(partner.states) > seen, "joint states are back")
    assert time.monotonic() - begin < 5.0  # a second on a machine that isn't busy
    time.sleep(0.2)
    assert emulator.force == 0.0
    assert partner.says("fault")()


def test_a_drive_behind_topics(graph: Graph) -> None:
    partner = Partner(
        graph, driver="ros2_control", enable_at_start=True, drive_states="drive/joint_states",
        **{"ros2_control.joint": "j2", "ros2_control.joints": "j1, j2", "ros2_control.ratio": 10.0},
        **{"ros2_control.timeout": 0.5},
    )  # fmt: skip
    robot = graph.node("robot")
    efforts: list[Any] = []
    robot.create_subscription(Float64MultiArray, "effort_controller/commands", efforts.append, DEEP)
    publisher = robot.create_publisher(JointState, "drive/joint_states", DEEP)

    def state() -> None:
        message = JointState(name=["j2", "j1"], position=[5.0, 1.0], velocity=[0.0, 0.0], effort=[0.1, 0.0])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(time.time_ns(), 10**9)
        publisher.publish(message)

    robot.create_timer(0.005, state)
    graph.spin(robot)
    partner.force = 20.0
    graph.until(lambda: efforts and list(efforts[-1].data) == [0.0, 2.0], "efforts in the controller's order")
    graph.until(lambda: partner.states, "states of the axis")
    assert partner.states[-1].name == ["axis"]
    assert partner.states[-1].position[0] == 0.5
    assert partner.states[-1].effort[0] == pytest.approx(1.0)


def test_a_can_drive(graph: Graph) -> None:
    pytest.importorskip("canopen", reason="the drive 'cia402' needs the extra 'can'")
    from fric.drives.cia402_emulator import Cia402Emulator

    drive = Cia402Emulator(axis(), "fric-bridge", 50.0, 1e7)
    partner = Partner(
        graph, driver="cia402", enable_at_start=True,
        **{
            "cia402.interface": "virtual", "cia402.channel": "fric-bridge", "cia402.rated_force": 50.0,
            "cia402.increments": 1e7, "cia402.heartbeat": 2.0,
        },
    )  # fmt: skip
    try:
        partner.force = 10.0
        graph.until(lambda: drive.force == pytest.approx(10.0), "the torque acts")
        drive.fail(0x2310)
        graph.until(partner.says("emergency 0x2310"), "the drive's fault is named")
    finally:
        partner.bridge.close()
        drive.close()


@pytest.mark.parametrize(
    ("parameters", "named"),
    [
        ({"driver": "serial"}, "no port"),
        ({"driver": "ros2_control", "ros2_control.joints": "a, b"}, "no joint 'axis' among a, b"),
        ({"driver": "serial", "serial.port": "/dev/x", "position_min": 2.0, "position_max": 1.0}, "position_min"),
        ({"driver": "ethercat"}, "driver"),
    ],
)
def test_parameters_that_make_no_sense_are_refused_in_one_line(graph: Graph, parameters: dict[str, object], named: str) -> None:
    overrides = [Parameter(name, value=value) for name, value in parameters.items()]
    with pytest.raises(InputError, match=named) as caught:
        HardwareBridgeNode(context=graph.context(), parameter_overrides=overrides)
    assert "\n" not in str(caught.value)


def test_the_process_waits_for_its_drive_and_ends_on_sigint(graph: Graph) -> None:
    process = graph.start_node("hardware_bridge", **{"serial.port": "/dev/fric-no-such-device"})
    node = graph.node("watcher")
    reports: list[DiagnosticStatus] = []
    node.create_subscription(DiagnosticArray, "/diagnostics", lambda m: reports.extend(m.status), 10)
    graph.spin(node)
    graph.until(lambda: any("can't be opened" in str(r.values) for r in reports), "says that there is no drive")
    status, out, error = graph.finish(process, signal.SIGINT)
    assert status == 0, out + error
    assert "Traceback" not in error
