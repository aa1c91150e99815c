"""The monitor on a running graph in lock-step: what is switched on in the plant is raised, named, and nothing else is."""

from __future__ import annotations

import math
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from fric.diagnosis.watch import Phase
from fric.model import Model, build_model, term
from fric.model_file import write_model
from fric_nodes.nodes.monitor import MonitorNode
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState

from fric_interfaces.msg import Mismatch

H = 0.002
COMPILING = 400.0  # [s] in a fresh cache, on a busy machine


def axis(amplitude: float = 0.0, lag: float = 1e-5) -> Model:
    """With friction that is larger by the share ``amplitude`` at one place, and a drive that follows after ``lag`` [s]."""
    place = term("position_dependence", "local", amplitude=amplitude, position=0.0, width=0.004)
    return build_model(
        "rigid",
        {"mass": 2.0},
        [term("coulomb", force=8.0), term("viscous", coefficient=20.0), place, term("actuator_lag", time=lag)],
    )


class Machine:
    """A plant with its controller in lock-step, the monitor on it, and what the monitor says."""

    def __init__(self, graph: Any, **monitor: object) -> None:
        self.graph = graph
        self.mismatches: list[Mismatch] = []
        self.diagnostics: list[DiagnosticArray] = []
        self.node = graph.node("listener")
        latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.node.create_subscription(Mismatch, "friction/mismatch", self.mismatches.append, latched)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self.diagnostics.append, 10)
        self.change = graph.model_change(self.node)
        graph.spin(self.node)
        nominal = graph.folder / "nominal.yaml"
        write_model(
            build_model("rigid", {"mass": 2.0}, [term("coulomb", force=8.0), term("viscous", coefficient=20.0)]), nominal
        )
        given = {"model_file": str(nominal), "learning_time": 4.0, **monitor}
        overrides = [Parameter(name, value=value) for name, value in given.items()]
        self.monitor = MonitorNode(context=graph.context(), parameter_overrides=overrides)
        graph.owns(self.monitor)
        graph.spin(self.monitor)

    def start(self) -> None:
        """The machine begins to move."""
        write_model(axis(), self.graph.folder / "before.yaml")
        common = {"lock_step": "true", "period": H}
        motion = {"duration": 600.0, "ramp": 0.2, "frequency_low": 0.5, "frequency_high": 4.0, "amplitude": 0.02, "speed": 0.15}
        parameters = {
            "excitation": {
                **{f"multisine.{key}": value for key, value in motion.items()},
                "wait_for_subscribers": 2,
                "repeat": "true",
            },
            "compensator": {"model_file": self.graph.folder / "before.yaml"},
            "pid": {"kp": 2e4, "ki": 5e5, "kd": 300.0, "filter_time": 0.001, "force_limit": 80.0},
            "plant": {
                "model_file": self.graph.folder / "before.yaml",
                "force_noise": 0.2,
                "wait_for_subscribers": 3,
                "seed": 2,
            },
        }
        for name, own in parameters.items():
            self.graph.start_node(name, **common, **own)

    def become(self, model: Model) -> float:
        """Switch something on in the running plant, and give the time [s] of it."""
        write_model(model, self.graph.folder / "after.yaml")
        return self.change.to(self.graph.folder / "after.yaml")

    def time(self) -> float:
        """Stamp of the newest sample that the monitor has seen [s]."""
        return self.monitor.newest * 1e-9

    def until(self, condition: Any, what: str, limit: float = 60.0) -> None:
        self.graph.until(condition, what, limit)


@pytest.fixture
def machine(graph: Any) -> Iterator[Any]:
    made: list[Machine] = []

    def make(**monitor: object) -> Machine:
        made.append(Machine(graph, **monitor))
        return made[-1]

    yield make
    for each in made:
        each.monitor.close()


def stamp(message: Mismatch) -> float:
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec


@pytest.mark.alone
@pytest.mark.parametrize(
    ("after", "force_from", "component", "effects"),
    [
        (axis(amplitude=0.6), "joint_states", "guideway friction", {"position_dependence"}),
        pytest.param(axis(lag=0.006), "force_command", "command path", {"actuator_lag", "delay"}, marks=pytest.mark.long),
    ],
    ids=["friction at one place", "a slower actuator"],
)
def test_what_is_switched_on_is_raised_within_five_seconds_and_named(
    machine: Any, after: Model, force_from: str, component: str, effects: set[str]
) -> None:
    rig = machine(force_from=force_from)
    rig.until(rig.monitor.prepared, "everything is compiled", COMPILING)
    rig.start()
    rig.until(lambda: rig.monitor.watch.phase is Phase.WATCHING, "the floor is learnt")
    silent_from = rig.time()
    rig.until(lambda: rig.time() > silent_from + 4.0, "four more seconds")
    assert rig.mismatches == []
    switched = rig.become(after)
    rig.until(lambda: rig.mismatches, "a mismatch")
    first = rig.mismatches[0]
    assert first.detected
    assert first.joint == "axis"
    assert stamp(first) - switched < 5.0
    # The stamp is the end of what was looked at, so the machine that simulates may be as slow or fast as it likes. The last
    # look is 8 s after the beginning that the monitor took for it, which may be a little before the change itself.
    rig.until(lambda: any(stamp(message) - switched > 7.0 for message in rig.mismatches), "the last look", 200.0)
    looks = [message for message in rig.mismatches if message.component]
    # Time is simulated: how many looks fit into it depends on how fast the machine is, so on a busy one the first is too late.
    early = [look for look in looks if stamp(look) - switched < 5.0] or looks[:1]
    assert early[-1].component == component, [(stamp(look) - switched, look.effect, look.detail) for look in looks]
    # The look that has seen most tells the effect, too.
    named = looks[-1]
    assert named.component == component
    assert named.effect in effects
    assert 0.0 < named.confidence <= 1.0
    assert named.regime
    assert named.effect in named.detail
    rig.until(lambda: rig.diagnostics and rig.diagnostics[-1].status[0].message == "mismatch detected", "a diagnosis")


@pytest.mark.long
@pytest.mark.timeout(2400)
def test_half_an_hour_in_which_nothing_changes_is_silent(machine: Any) -> None:
    rig = machine(name_component=False)
    rig.start()
    rig.until(lambda: rig.monitor.watch.phase is Phase.WATCHING, "the floor is learnt")
    rig.until(lambda: rig.time() > 1800.0, "half an hour of the machine's time", 2300.0)
    assert rig.mismatches == []
    assert rig.monitor.watch.phase is Phase.WATCHING


def test_bad_messages_are_counted_and_survived(machine: Any) -> None:
    rig = machine(name_component=False, joint="axis")
    publisher = rig.node.create_publisher(JointState, "joint_states", 100)
    rig.graph.meet(rig.node, rig.monitor)
    for bad in (
        JointState(name=["axis"], position=[math.nan], effort=[1.0]),
        JointState(name=["axis"], position=[1.0], effort=[math.inf]),
        JointState(name=["elbow"], position=[1.0], effort=[1.0]),
        JointState(name=["axis"]),
        JointState(),
    ):
        publisher.publish(bad)
    rig.until(lambda: rig.monitor.counters["refused joint state"] == 5, "five refusals")
    good = JointState(name=["axis"], position=[0.0], effort=[0.0])
    for k in range(1, 1001):
        good.header.stamp.sec, good.header.stamp.nanosec = divmod(k * 2_000_000, 1_000_000_000)
        good.effort = [] if k % 7 == 0 else [0.0]  # some say nothing of the force, and there is no command
        publisher.publish(good)
        if k % 50 == 0:
            rig.until(lambda: rig.monitor.newest >= (k - 10) * 2_000_000, "the samples")  # noqa: B023
    assert rig.monitor.watch.phase is not Phase.DETECTED
    assert rig.mismatches == []


def test_a_model_file_that_cannot_be_used(graph: Any, tmp_path: Path) -> None:
    (tmp_path / "bad.yaml").write_text("format: fric-model/1\nplant: {type: rigid, mass: -1.0}\n")
    status, _, error = graph.finish(graph.start_node("monitor", model_file=tmp_path / "bad.yaml"))
    assert status == 2
    assert error.count("\n") == 1
    assert "bad.yaml" in error


def test_it_ends_cleanly_while_it_compiles(graph: Any) -> None:
    process = graph.start_node("monitor")
    node = graph.node("watcher")
    graph.until(lambda: node.count_publishers("/friction/mismatch") == 1, "the monitor is there")
    status, _, error = graph.finish(process, signal.SIGINT)
    assert status == 0, error
    assert "Traceback" not in error
