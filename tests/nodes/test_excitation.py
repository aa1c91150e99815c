"""Excitations that answer the motion, in both clocks over the real middleware; and what a node refuses to publish."""

from __future__ import annotations

import re
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from fric.axis import SimulatedAxis
from fric.excitation import EXCITATIONS
from fric.excitation.sequence import Sequence
from fric.excitation_kind import ExcitationError
from fric.model import build_model, term
from fric.model_file import write_model
from fric_nodes.nodes.excitation import ExcitationNode
from rclpy.experimental import EventsExecutor
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from fric_interfaces.msg import Reference, StampedForce

if TYPE_CHECKING:
    from .conftest import Graph

H = 0.002
SAMPLES = 1500
MODEL = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=0.5), term("viscous", coefficient=20.0)])
ANSWER = {
    "stiffness_low": 1000.0, "stiffness_high": 2000.0, "gains": 2.0, "damping": -15.0, "deflection": 0.04, "set_time": 0.3,
    "hold": 0.2, "oscillation_time": 0.7,
}  # fmt: skip
PUSH = {"force_high": 3.0, "releases": 1.0, "rise_time": 0.1, "hold": 0.05, "decay_time": 0.1}
DEEP = QoSProfile(depth=20_000)


def _parts() -> Sequence:
    parts = []
    for name, given in (("free_decay", PUSH), ("parametric_oscillation", ANSWER)):
        kind = EXCITATIONS[name]
        values: dict[str, Any] = {parameter.name: parameter.default for parameter in kind.parameters}
        parts.append(kind.part({**values, **given}, {}, np.random.default_rng(0)))
    return Sequence(parts, delay=0.1, pause=0.05)


def _parameters() -> dict[str, object]:
    """Parameters of an excitation that pushes once and then answers the motion."""
    return {
        "kinds": ["free_decay", "parametric_oscillation"],
        "output": "force",
        "start_delay": 0.1,
        "pause": 0.05,
        **{f"free_decay.{key}": value for key, value in PUSH.items()},
        **{f"parametric_oscillation.{key}": value for key, value in ANSWER.items()},
    }


def _node(graph: Graph, **values: object) -> ExcitationNode:
    overrides = [Parameter(name, value=value) for name, value in values.items()]
    return graph.owns(ExcitationNode(context=graph.context(), parameter_overrides=overrides))


def _write(folder: Path) -> str:
    write_model(MODEL, folder / "axis.yaml")
    return str(folder / "axis.yaml")


def _sample(message: Any) -> int:
    return round((message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec) / H)


@pytest.mark.long
def test_in_lock_step_the_answers_are_those_of_the_core(graph: Graph) -> None:
    axis = SimulatedAxis(MODEL, resolution=1e-7)
    axis.advance(0.0, 1e-12)
    axis.measure()
    sequence = _parts()
    expected = []
    for k in range(SAMPLES):
        position = axis.measure().position
        expected.append((position, sequence.force(k * H, position)))
        axis.advance(expected[-1][1], H)
    wanted = np.array(expected)
    # It did oscillate, around 0 and from both sides.
    assert np.count_nonzero(np.diff(np.sign(wanted[:, 0]))) > 10
    assert min(wanted[:, 0].max(), -wanted[:, 0].min()) > 0.03

    said: dict[int, float] = {}
    seen: dict[int, float] = {}
    node = graph.node("listener")
    node.create_subscription(StampedForce, "force_command", lambda m: said.__setitem__(_sample(m), m.force), DEEP)
    node.create_subscription(JointState, "joint_states", lambda m: seen.__setitem__(_sample(m), m.position[0]), DEEP)
    graph.spin(node, kind=EventsExecutor)
    values = {key: f"[{','.join(value)}]" if isinstance(value, list) else value for key, value in _parameters().items()}
    excitation = graph.start_node("excitation", lock_step=True, period=H, wait_for_subscribers=2, **values)
    file = _write(graph.folder)
    for _ in range(2):  # the second plant begins again at sample 0, with the same excitation
        said.clear()
        seen.clear()
        plant = graph.start_node(
            "plant", lock_step=True, period=H, model_file=file, wait_for_subscribers=2, duration=SAMPLES * H
        )
        status, _, error = graph.finish(plant)
        assert status == 0, error
        graph.until(lambda: len(seen) > SAMPLES and len(said) >= SAMPLES, "the last messages arrive")
        found = np.array([(seen[k], said[k]) for k in range(SAMPLES)])
        assert np.abs(found - wanted).max(axis=0) == pytest.approx([0.0, 0.0], abs=1e-6)
    assert graph.finish(excitation, signal.SIGINT)[0] == 0


def test_in_wall_time_an_axis_oscillates(graph: Graph) -> None:
    positions: list[float] = []
    node = graph.node("listener")
    node.create_subscription(JointState, "joint_states", lambda m: positions.append(m.position[0]), DEEP)
    graph.spin(node, kind=EventsExecutor)
    values = {key: f"[{','.join(value)}]" if isinstance(value, list) else value for key, value in _parameters().items()}
    # Long enough for many more crossings than are asked for, whatever the machine does meanwhile.
    values["parametric_oscillation.oscillation_time"] = 2.0
    running = [
        graph.start_node("excitation", period=0.005, **values),
        graph.start_node("plant", period=0.005, model_file=_write(graph.folder)),
    ]
    graph.until(lambda: np.count_nonzero(np.diff(np.sign(positions))) > 8, "the axis crosses 0 again and again")
    assert max(positions) > 0.02
    for process in running:
        status, _, error = graph.finish(process, signal.SIGINT)
        assert status == 0, error


def test_states_that_cannot_be_used_are_refused_and_counted(graph: Graph) -> None:
    excitation = _node(graph, **_parameters())
    forces: list[float] = []
    node = graph.node("tester")
    from std_msgs.msg import Float64

    node.create_subscription(Float64, "force_command", lambda m: forces.append(m.data), DEEP)
    publisher = node.create_publisher(JointState, "joint_states", 100)
    graph.spin(node, kind=EventsExecutor)
    graph.spin(excitation, kind=EventsExecutor)
    graph.meet(node, excitation)

    def send(stamp: int, **fields: object) -> None:
        message = JointState(**{"name": ["axis"], "position": [0.0], **fields})
        message.header.stamp.nanosec = stamp
        publisher.publish(message)

    send(1000)
    graph.until(lambda: len(forces) == 1, "an answer")
    send(2000, name=["other"])
    send(2000, position=[float("nan")])
    send(1000)
    graph.until(lambda: excitation.counters["refused joint state"] == 3, "three refusals")
    send(3000)
    graph.until(lambda: len(forces) == 2, "an answer to a good state")


@pytest.mark.parametrize("name", ["free_decay", "parametric_oscillation"])
def test_what_is_a_force_is_not_published_as_a_reference(graph: Graph, name: str) -> None:
    with pytest.raises(ExcitationError, match=f"{name} can't be published as a reference"):
        _node(graph, kinds=[name])


def test_a_recorded_motion_is_chosen_by_a_text(graph: Graph) -> None:
    t = np.arange(0.0, 2.0, 0.01)
    table = np.stack([t, 0.1 * np.sin(3.0 * t)], axis=1)
    np.savetxt(graph.folder / "motion.csv", table, delimiter=",", header="time,reference", comments="")
    references: list[Reference] = []
    node = graph.node("listener")
    node.create_subscription(Reference, "reference", references.append, DEEP)
    graph.spin(node, kind=EventsExecutor)
    values = {"kinds": ["recorded"], "recorded.file": str(graph.folder / "motion.csv"), "recorded.lead_time": 0.05}
    graph.spin(_node(graph, **values, start_delay=0.0, period=0.005), kind=EventsExecutor)
    graph.until(lambda: len(references) > 100, "references arrive")
    q = np.array([m.position for m in references])
    start = references[0].header.stamp
    s = np.array([m.header.stamp.sec - start.sec + 1e-9 * (m.header.stamp.nanosec - start.nanosec) for m in references])
    inside = (s > 0.1) & (s < 2.0)
    # The motion's own time begins with the first tick, which the first stamp marks.
    assert np.count_nonzero(inside) > 50
    assert q[inside] == pytest.approx(0.1 * np.sin(3.0 * (s[inside] - 0.05)), abs=1e-5)


CONFIG = Path(__file__).resolve().parents[2] / "config"
FILES = [path.name for path in sorted(CONFIG.glob("*.yaml")) if "kinds:" in path.read_text(encoding="utf-8")]


@pytest.mark.parametrize("file", FILES)
def test_every_excitation_of_the_configuration_can_be_planned_and_ends_when_it_says(graph: Graph, file: str) -> None:
    node = graph.owns(ExcitationNode(context=graph.context("--params-file", str(CONFIG / file))))
    planned = float(node.condition()["planned duration [s]"])
    said = re.search(r"([\d.]+) s\.", (CONFIG / file).read_text(encoding="utf-8").split("/**:")[0].replace("\n# ", " "))
    assert said is not None, "the head of the file says when the motion ends"
    assert float(said[1]) == pytest.approx(planned, abs=0.051)
