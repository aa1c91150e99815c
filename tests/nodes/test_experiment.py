"""The experiment as a node: over topics with a plant, through the controller, in both clocks, cut off, stopped by a signal."""

from __future__ import annotations

import json
import signal
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from fric.bagio import read_record
from fric.experiment.motion import Drive, Sample
from fric.model_file import read_model
from fric_nodes.experiment_drive import ControllerDrive
from fric_nodes.forces import STAMPED
from fric_nodes.loop import LOCK_STEP, LoopNode
from fric_nodes.nodes.experiment import ExperimentNode
from fric_nodes.nodes.pid import PidNode
from fric_nodes.nodes.plant import PlantNode
from rcl_interfaces.srv import SetParameters
from rclpy.executors import Executor, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from fric_interfaces.msg import StampedForce

if TYPE_CHECKING:
    from .conftest import Graph

H = 0.002
J, C, K, FC = 0.012, 2.0e-3, 0.6, 0.04
MODEL = f"""format: fric-model/1
joint: axis
units: {{position: rad, force: N m}}
plant: {{type: rigid, mass: {J}}}
terms:
  - {{effect: stiffness, stiffness: {K}}}
  - {{effect: coulomb, force: {FC}}}
  - {{effect: viscous, coefficient: {C}}}
"""
LIMITS: dict[str, object] = {"force_limit": 1.0, "travel": 2.0, "deflection": 0.8}
QUICK: dict[str, object] = {
    "period": H, "kind": "free", "position_unit": "rad", "force_unit": "N m", "proportional_low": 0.1, "proportional_high": 1.0,
    "place_time": 0.3, "settle_time": 1.0, "quiet_time": 0.1, "oscillation_time": 3.0, "more_terms": [""], **LIMITS,
}  # fmt: skip
DEEP = QoSProfile(depth=20_000)
RUNS: dict[str, Any] = {}
"""The run of the executor that came first."""


def _overrides(**values: object) -> list[Parameter]:
    return [Parameter(name, value=value) for name, value in values.items()]


def _model(folder: Path) -> str:
    path = folder / "model.yaml"
    path.write_text(MODEL, encoding="utf-8")
    return str(path)


def _plant(folder: Path, lock_step: bool = True, audience: int = 1) -> dict[str, object]:
    return {
        "lock_step": lock_step, "period": H, "model_file": _model(folder), "resolution": 1e-4, "force_noise": 1e-4,
        "force_limit": 1.0, "wait_for_subscribers": audience, "seed": 3,
    }  # fmt: skip


def _within_the_goals(out: Path) -> None:
    """Inertia and stiffness within 1 %, damping within 2 %, by de Marchi's method and in model.yaml."""
    found = json.loads((out / "experiment.json").read_text())
    parameters = found["oscillation"]["parameters"]
    assert parameters["mass"]["value"] == pytest.approx(J, rel=0.01)
    assert parameters["stiffness.stiffness"]["value"] == pytest.approx(K, rel=0.01)
    assert parameters["viscous.coefficient"]["value"] == pytest.approx(C, rel=0.02)
    model = read_model(out / "model.yaml")
    assert model.value("mass") == pytest.approx(J, rel=0.01)
    assert model.value("stiffness.stiffness") == pytest.approx(K, rel=0.01)
    assert model.value("viscous.coefficient") == pytest.approx(C, rel=0.02)


class Hearer:
    """Keeps what is commanded."""

    def __init__(self, graph: Graph, kind: Any) -> None:
        self.node: Node = graph.node("hearer")
        self.forces: list[float] = []
        field = "data" if kind is Float64 else "force"
        self.node.create_subscription(kind, "force_command", lambda m: self.forces.append(getattr(m, field)), DEEP)
        graph.spin(self.node, kind=EventsExecutor)


@pytest.mark.long
def test_processes_in_lock_step_find_the_axis(graph: Graph) -> None:
    out = graph.folder / "found"
    graph.start_node("plant", **_plant(graph.folder))
    process = graph.start_node("experiment", lock_step=True, out=str(out), most_runs=6, **{**QUICK, "more_terms": "['']"})
    status, _, words = graph.finish(process, limit=240.0)
    assert status == 0, words
    _within_the_goals(out)
    runs = json.loads((out / "experiment.json").read_text())["runs"]
    assert len(runs) >= 4
    assert len({run["proportional"] for run in runs}) > 1
    for run in runs:
        record = read_record(out / f"run_{run['run']:02d}")
        assert record.units.position == "rad"
        assert np.ptp(record.position) > 0.5 * abs(run["deflection"])
    assert (out / "report.html").read_text(encoding="utf-8").startswith("<!")


@pytest.mark.parametrize("kind", [SingleThreadedExecutor, MultiThreadedExecutor, EventsExecutor])
def test_every_executor_gives_the_same_run(graph: Graph, kind: type[Executor], quick_switches: None) -> None:
    context = graph.context()
    plant = graph.owns(PlantNode(context=context, parameter_overrides=_overrides(**_plant(graph.folder))))
    out = graph.folder / "found"
    few = {**QUICK, "lock_step": True, "out": str(out), "fewest_runs": 1, "most_runs": 1, "oscillation_time": 1.5}
    node = graph.owns(ExperimentNode(context=context, parameter_overrides=_overrides(**few)))
    graph.spin(plant, node, kind=kind)
    graph.until(lambda: node.done, "the experiment ends", 240.0)
    record = read_record(out / "run_01")
    first = RUNS.setdefault("run", record)
    assert np.array_equal(record.position, first.position)
    assert np.array_equal(record.effort, first.effort)


def test_the_gains_of_a_controller_are_set(graph: Graph) -> None:
    context = graph.context()
    out = graph.folder / "found"
    plant = graph.owns(PlantNode(context=context, parameter_overrides=_overrides(**_plant(graph.folder, audience=2))))
    pid = graph.owns(PidNode(context=context, parameter_overrides=_overrides(lock_step=True, period=H, force_limit=5.0)))
    few = {**QUICK, "lock_step": True, "out": str(out), "controller": "pid", "fewest_runs": 2, "most_runs": 2}
    node = graph.owns(ExperimentNode(context=context, parameter_overrides=_overrides(**few)))
    graph.spin(plant, pid, node, kind=EventsExecutor)
    graph.until(lambda: node.done, "the experiment ends", 240.0)
    runs = json.loads((out / "experiment.json").read_text())["runs"]
    assert [run["problem"] for run in runs] == ["", ""]
    for run in runs:
        assert run["acting_proportional"] == pytest.approx(run["proportional"], rel=0.01)
    assert pid.settings.number("kp") == pytest.approx(runs[-1]["proportional"])
    assert pid.settings.number("ki") == 0.0
    graph.until(lambda: pid.settings.number("force_limit") == 0.0, "the controller is left without force")


def test_a_controller_that_is_begun_anew_before_it_answered_is_asked_again(graph: Graph) -> None:
    gone = Node("pid", context=graph.context())  # served by nobody
    service = "pid/set_parameters"
    context = graph.context()
    asker = LoopNode("asker", (LOCK_STEP, STAMPED), context=context, parameter_overrides=_overrides(stamped=True))
    graph.owns(asker)
    client = asker.create_client(SetParameters, service)
    drive = ControllerDrive(asker, "pid", 1.0, 0.001)
    graph.until(client.service_is_ready, service)
    wanted, sample = Drive(proportional=2.0, reference=0.1), Sample(0.0, 0.0, 0.0)
    assert drive.give(1, wanted, sample) is None
    gone.destroy_node()
    graph.until(lambda: not client.service_is_ready(), "it is gone")
    pid = graph.owns(PidNode(context=context, parameter_overrides=_overrides(lock_step=True, period=H, force_limit=5.0)))
    graph.spin(pid, asker, kind=EventsExecutor)
    graph.until(lambda: drive.give(2, wanted, sample) is not None, "the setting is made", 30.0)
    assert pid.settings.number("kp") == 2.0


@pytest.mark.parametrize("lock_step", [True, pytest.param(False, marks=pytest.mark.long)])
def test_a_signal_leaves_the_drive_without_force(graph: Graph, lock_step: bool) -> None:
    hearer = Hearer(graph, StampedForce if lock_step else Float64)
    out = graph.folder / "found"
    graph.start_node("plant", **_plant(graph.folder, lock_step))
    more = {**QUICK, "more_terms": "['']", "oscillation_time": 60.0, "quiet_time": 50.0, "settle_time": 0.5}
    process = graph.start_node("experiment", lock_step=lock_step, out=str(out), wait_for_subscribers=2, **more)
    graph.until(lambda: len(hearer.forces) > 500 and max(map(abs, hearer.forces[-50:])) > 0.1, "a force acts", 150.0)
    status, _, words = graph.finish(process, signal.SIGINT)
    assert status == 0, words
    assert "Traceback" not in words
    time.sleep(0.1)
    assert hearer.forces[-1] == 0.0
    assert all(np.isfinite(hearer.forces))
    assert max(map(abs, hearer.forces)) <= 1.0


def test_an_axis_that_runs_away_is_cut_with_one_message(graph: Graph) -> None:
    """A plant of the test's own, which pushes itself: whatever is commanded, it leaves its travel."""
    out = graph.folder / "found"
    context = graph.context()
    few = {**QUICK, "lock_step": True, "out": str(out), "most_runs": 1, "fewest_runs": 1}
    node = graph.owns(ExperimentNode(context=context, parameter_overrides=_overrides(**few)))
    plant, position, sent = graph.node("plant"), [0.0], []
    publisher = plant.create_publisher(JointState, "joint_states", DEEP)

    def state(number: int) -> JointState:
        message = JointState(name=["axis"], position=[position[0]], effort=[0.0])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(number * 2_000_000, 1_000_000_000)
        return message

    def on_command(message: StampedForce) -> None:
        sent.append((position[0], message.force))
        # Still until it is pushed for the first time, then away for good, whatever is commanded, to an end stop.
        if position[0] < 2.5 and (abs(message.force) > 0.02 or position[0] > 0.0):
            position[0] += 0.02
        publisher.publish(state(len(sent)))

    plant.create_subscription(StampedForce, "force_command", on_command, DEEP)
    plant.create_timer(0.2, lambda: publisher.publish(state(len(sent))))
    graph.spin(plant, node, kind=EventsExecutor)
    graph.until(lambda: node.done, "the experiment ends", 240.0)
    messages = json.loads((out / "experiment.json").read_text())["messages"]
    assert sum("the force is cut" in message for message in messages) == 1
    # One state may be under way while the first beyond the limit is answered.
    beyond = [force for where, force in sent if where > 2.03]
    assert beyond
    assert set(beyond) == {0.0}


def test_what_can_not_be_made_is_refused(graph: Graph) -> None:
    (graph.folder / "there").mkdir()
    for parameters, says in (
        ({"out": str(graph.folder / "there")}, "exists already"),
        ({"deflection": 3.0, "travel": 1.0}, "deflection"),
        ({"controller": "pid", "proportional_low": 0.0}, "proportional_low"),
    ):
        status, _, words = graph.finish(graph.start_node("experiment", **parameters))
        assert status == 2
        assert says in words
        assert len(words.strip().splitlines()) == 1


def test_states_that_are_not_finite_are_never_answered_with_a_force(graph: Graph) -> None:
    hearer = Hearer(graph, Float64)
    context = graph.context()
    few = {**QUICK, "out": str(graph.folder / "found"), "quiet_time": 0.05}
    node = graph.owns(ExperimentNode(context=context, parameter_overrides=_overrides(**few)))
    plant = graph.node("plant")
    publisher = plant.create_publisher(JointState, "joint_states", DEEP)
    graph.spin(node, kind=EventsExecutor)
    graph.meet(plant, hearer.node, node)
    for number in range(400):
        bad = number % 10 == 5
        message = JointState(name=["axis"], position=[float("nan") if bad else 0.0], effort=[float("inf") if bad else 0.0])
        message.header.stamp = plant.get_clock().now().to_msg()
        publisher.publish(message)
        time.sleep(0.002)
    graph.until(lambda: len(hearer.forces) > 200, "it answers")
    assert all(np.isfinite(hearer.forces))
    assert node.counters["refused joint state"] == 40
